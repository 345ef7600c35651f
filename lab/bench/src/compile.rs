//! Time of `compile` on every example, on one machine with more and more error parameters, and on random machines,
//! beside another program such as that of the last release.

use programs::process::{root, run as start, target};
use programs::trueaxis;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// Machine and errors in `examples`.
const EXAMPLES: [[&str; 2]; 12] = [
    ["huron-k2x8/machine", "huron-k2x8/errors-13"],
    ["huron-k2x8/machine-tool-length", "huron-k2x8/errors-13"],
    ["kolibri/machine", "kolibri/errors-12"],
    ["kolibri/machine", "kolibri/errors-81"],
    ["hu40/machine", "hu40/errors-13"],
    ["hu40/machine", "hu40/errors-84"],
    ["fork-head/machine", "fork-head/errors-13"],
    ["table-head/machine", "table-head/errors-13"],
    ["router/machine", "router/errors-10"],
    ["mill-21/machine", "mill-21/errors-21"],
    ["five-axis-30/machine", "five-axis-30/errors-30"],
    ["linuxcnc-xyzac-trt/machine", "linuxcnc-xyzac-trt/errors-11"],
];
/// Numbers of error parameters of the Huron.
const COUNTS: [usize; 4] = [13, 30, 60, 120];
/// Axes with the ends of their travels (mm, rad).
const AXES: [(char, f64); 5] = [
    ('X', 350.0),
    ('Y', 350.0),
    ('Z', 350.0),
    ('A', 2.1),
    ('C', 6.3),
];
/// Number of random machines.
const RANDOM: &str = "20";
/// What each error motion amounts to at an end of the travel: mm for x, y and z, rad for the others.
const SIZES: [f64; 2] = [5e-3, 2e-5];

/// Prints the times side by side.
///
/// # Errors
/// If the program does not build, or one of the programs cannot be started.
pub fn run(other: Option<&str>) -> Result<(), String> {
    let program = trueaxis::shipped()?;
    let programs: Vec<PathBuf> = std::iter::once(program)
        .chain(other.map(PathBuf::from))
        .collect();
    println!("seconds of `compile`, and what it made; one column per program:");
    let examples = root().join("examples");
    for [machine, errors] in EXAMPLES {
        let [machine, errors] = [machine, errors].map(|f| examples.join(format!("{f}.toml")));
        line(&programs, &machine, &errors)?;
    }
    for count in COUNTS {
        let errors = target(&format!("errors-{count}.toml"));
        std::fs::write(&errors, parameters(count)).map_err(|e| e.to_string())?;
        let machine = examples.join("huron-k2x8/machine.toml");
        line(&programs, &machine, &errors)?;
    }
    for [machine, errors] in random_machines()? {
        line(&programs, &machine, &errors)?;
    }
    Ok(())
}

/// The files of [`RANDOM`] machines with their errors, in the order of their numbers.
fn random_machines() -> Result<Vec<[PathBuf; 2]>, String> {
    trueaxis::build()?;
    let folder = target("random-machines");
    let fresh = std::fs::remove_dir_all(&folder).or_else(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Ok(()),
        _ => Err(e),
    });
    let made = fresh.and_then(|()| std::fs::create_dir_all(&folder));
    made.map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut write = trueaxis::example("random-machines");
    start(write.args([RANDOM, "--files"]).arg(&folder))?;
    let entries = std::fs::read_dir(&folder).map_err(|e| e.to_string())?;
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let number = |name: String| {
        let name = name.strip_prefix("machine-")?.strip_suffix(".toml")?;
        name.parse::<u64>().ok()
    };
    let mut numbers: Vec<u64> = names.filter_map(number).collect();
    numbers.sort_unstable();
    let files = |n| ["machine", "errors"].map(|kind| folder.join(format!("{kind}-{n}.toml")));
    Ok(numbers.into_iter().map(files).collect())
}

/// The first `count` error motions of the Huron: all of degree 1, then of degree 2, and so on.
fn parameters(count: usize) -> String {
    let mut text = "machine = \"Huron K2X8-Five\"\n[parameters]\n".to_owned();
    let all = (1..).flat_map(|degree| {
        let axes = AXES.into_iter();
        axes.flat_map(move |axis| (0..6).map(move |component| (degree, axis, component)))
    });
    for (degree, (axis, end), component) in all.take(count) {
        let size = SIZES[component / 3] / f64::powi(end, degree);
        let letter = char::from(b"XYZABC"[component]);
        writeln!(text, "E{letter}{axis}{degree} = {size:e}").expect("strings take everything");
    }
    text
}

/// Compiles with every program.
fn line(programs: &[PathBuf], machine: &Path, errors: &Path) -> Result<(), String> {
    let blob = target("compile.trax");
    let stem = |path: &Path| path.file_stem().unwrap_or_default().display().to_string();
    let folder = machine.parent().and_then(Path::file_name);
    let folder = folder.unwrap_or_default().display();
    let mut columns = String::new();
    for program in programs {
        let mut compile = Command::new(program);
        compile
            .args(["compile", "--allow-large"])
            .args([machine, errors])
            .arg("-o")
            .arg(&blob);
        let started = Instant::now();
        let output = compile.output().map_err(|e| e.to_string())?;
        let seconds = started.elapsed().as_secs_f64();
        let made = String::from_utf8_lossy(&output.stdout);
        let made = made.lines().nth(1).unwrap_or("nothing");
        write!(columns, "  {seconds:>7.2}  {made:<70}").expect("strings take everything");
    }
    let [machine, errors] = [machine, errors].map(stem);
    println!("  {:<46}{columns}", format!("{folder} {machine}, {errors}"));
    Ok(())
}
