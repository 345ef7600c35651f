//! Run times compared with rivals, and instruction counts if valgrind is available.

use crate::{c_interface, callgrind};
use programs::process::{self, cargo, has, output, root};
use std::process::Command;

/// The build command of the benchmark.
const SPEED: &str = "bench -q --profile dist -p trueaxis-tests --bench speed";
/// Calls of each workload under callgrind: enough to keep the overhead below 1 %.
const CALLS: u32 = 1000;
/// The update while only positions change, and the cases that must not take longer.
const STEADY: &str = "steady";
const LIKE_STEADY: [&str; 4] = [
    "steady-tool-length",
    "steady-unreferenced",
    "steady-endless",
    "steady-parked",
];
/// Maximum instructions, as a multiple of those of `STEADY`.
const MOST: f64 = 1.2;

/// # Errors
/// If a benchmark does not build or run, or one of [`LIKE_STEADY`] takes too long.
pub fn run() -> Result<(), String> {
    process::run(cargo().args(SPEED.split(' ')))?;
    if !has("valgrind") {
        println!("instructions per call: valgrind is not installed");
        return Ok(());
    }
    instructions()
}

/// Instructions per call, from two runs that differ only in the number of calls.
fn instructions() -> Result<(), String> {
    let program = build()?;
    println!("instructions per call (callgrind, x86-64):");
    let count = |name, calls: u32| {
        let mut command = Command::new(&program);
        command.current_dir(root());
        command.args(["--calls", name, &calls.to_string()]);
        callgrind::count(&command, None).map(|(instructions, _)| instructions)
    };
    let per_call = |name| {
        let (once, many) = (count(name, 1)?, count(name, 1 + CALLS)?);
        Ok::<f64, String>((many - once) as f64 / f64::from(CALLS))
    };
    let evaluate = per_call("evaluate")?;
    println!("  {:<20} {evaluate:>6.0}", "evaluate");
    let code = per_call("generated")?;
    println!(
        "  {:<20} {code:>6.0}   {:.2} × evaluate",
        "generated code",
        code / evaluate
    );
    for name in ["servo", "grid"] {
        println!("  {name:<20} {:>6.0}", per_call(name)?);
    }
    let steady = per_call(STEADY)?;
    println!("  {STEADY:<20} {steady:>6.0}");
    let mut long = Vec::new();
    for name in LIKE_STEADY {
        let found = per_call(name)?;
        let times = found / steady;
        println!("  {name:<20} {found:>6.0}   {times:.2} × {STEADY} (at most {MOST})");
        long.extend((times > MOST).then_some(name));
    }
    c_interface::print()?;
    match long.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "longer than {MOST} × {STEADY}: {}",
            long.join(", ")
        )),
    }
}

/// Builds the benchmark for plain x86-64 and returns the program.
fn build() -> Result<String, String> {
    let json = ["--no-run", "--message-format=json"];
    // One JSON object per line; that of the benchmark contains the path of its executable.
    let text = output(cargo().args(SPEED.split(' ')).args(json))?;
    let key = "\"executable\":\"";
    let line = text
        .lines()
        .rfind(|l| l.contains(key) && l.contains("\"name\":\"speed\""));
    let path = line
        .and_then(|l| l.split(key).nth(1))
        .and_then(|l| l.split('"').next());
    path.map(str::to_owned)
        .ok_or_else(|| "cargo does not say where the benchmark is".to_owned())
}
