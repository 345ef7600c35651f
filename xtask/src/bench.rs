//! `cargo xtask bench`: run times beside their rivals, instruction counts where valgrind is there.

pub mod policies;

use crate::process::{self, cargo, root, target, works};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Calls of each workload under callgrind: enough that what surrounds them is below 1 %.
const CALLS: u32 = 1000;
/// The update while nothing but positions changes, and what must not make it long.
const STEADY: &str = "steady";
const LIKE_STEADY: [&str; 4] = [
    "steady-tool-length",
    "steady-unreferenced",
    "steady-endless",
    "steady-parked",
];
/// Most times the instructions of `STEADY`.
const MOST: f64 = 1.2;

/// # Errors
/// A benchmark that does not build or run, or one of [`LIKE_STEADY`] that is too long.
pub fn run() -> Result<(), String> {
    process::run(cargo().args([
        "bench",
        "-q",
        "--profile",
        "dist",
        "-p",
        "trueaxis-tests",
        "--bench",
        "speed",
    ]))?;
    if !works(Command::new("valgrind").arg("--version")) {
        println!("instructions per call: valgrind is not installed");
        return Ok(());
    }
    let steady = instructions();
    policies::run()?;
    steady
}

/// Instructions per call: those of two runs that differ only in their number of calls.
fn instructions() -> Result<(), String> {
    let program = build()?;
    println!("instructions per call (callgrind, x86-64):");
    let per_call = |name| {
        let once = count(&program, name, 1)?;
        let many = count(&program, name, 1 + CALLS)?;
        Ok::<f64, String>((many - once) as f64 / f64::from(CALLS))
    };
    for name in ["evaluate", "servo", "grid"] {
        println!("  {name:<20} {:>6.0}", per_call(name)?);
    }
    let steady = per_call(STEADY)?;
    println!("  {STEADY:<20} {steady:>6.0}");
    let mut long = Vec::new();
    for name in LIKE_STEADY {
        let found = per_call(name)?;
        let times = found / steady;
        println!("  {name:<20} {found:>6.0}   {times:.2} × {STEADY} (at most {MOST})");
        if times > MOST {
            long.push(name);
        }
    }
    crate::capi::cost()?;
    if long.is_empty() {
        return Ok(());
    }
    Err(format!(
        "longer than {MOST} × {STEADY}: {}",
        long.join(", ")
    ))
}

/// Builds the benchmark for a plain x86-64 and finds the program.
fn build() -> Result<PathBuf, String> {
    let mut command = cargo();
    command.args([
        "bench",
        "-q",
        "--profile",
        "dist",
        "-p",
        "trueaxis-tests",
        "--bench",
        "speed",
        "--no-run",
        "--message-format=json",
    ]);
    let output = command.output().map_err(|e| e.to_string())?;
    // One JSON object per line; the one of the benchmark names its executable.
    let text = String::from_utf8_lossy(&output.stdout);
    let key = "\"executable\":\"";
    let line = text
        .lines()
        .rfind(|l| l.contains(key) && l.contains("\"name\":\"speed\""));
    let path = line
        .and_then(|l| l.split(key).nth(1))
        .and_then(|l| l.split('"').next());
    path.map(PathBuf::from)
        .ok_or_else(|| "cargo does not say where the benchmark is".to_owned())
}

/// All instructions of one run.
fn count(program: &Path, workload: &str, calls: u32) -> Result<u64, String> {
    let file = target("bench.callgrind");
    let output = Command::new("valgrind")
        .current_dir(root())
        .args(["--tool=callgrind", "-q"])
        .arg(format!("--callgrind-out-file={}", file.display()))
        .arg(program)
        .args(["--calls", workload, &calls.to_string()])
        .output()
        .map_err(|e| e.to_string())?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{workload} under valgrind:\n{said}"));
    }
    collected(&file)
}

/// The instructions that callgrind wrote down, whose file is removed.
fn collected(file: &Path) -> Result<u64, String> {
    let place = file.display();
    let text = std::fs::read_to_string(file).map_err(|e| format!("{place}: {e}"))?;
    let _ = std::fs::remove_file(file);
    let line = text.lines().find_map(|l| l.strip_prefix("totals: "));
    line.and_then(|l| l.trim().parse().ok())
        .ok_or_else(|| format!("{place} has no totals"))
}
