//! `cargo xtask bench`: run times beside their rivals, instruction counts where valgrind is there.

use crate::process::{self, cargo, root, target, works};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Calls of each workload under callgrind: enough that what surrounds them is below 1 %.
const CALLS: u32 = 1000;

/// # Errors
/// A benchmark that does not build or run.
pub fn run() -> Result<(), String> {
    process::run(cargo().args(["bench", "-q", "-p", "trueaxis-tests", "--bench", "speed"]))?;
    if !works(Command::new("valgrind").arg("--version")) {
        println!("instructions per call: valgrind is not installed");
        return Ok(());
    }
    instructions()
}

/// Instructions per call: those of two runs that differ only in their number of calls.
fn instructions() -> Result<(), String> {
    let program = build()?;
    println!("instructions per call (callgrind, x86-64):");
    for name in ["evaluate", "servo", "grid"] {
        let once = count(&program, name, 1)?;
        let many = count(&program, name, 1 + CALLS)?;
        println!(
            "  {name:<10} {:>6.0}",
            (many - once) as f64 / f64::from(CALLS)
        );
    }
    Ok(())
}

/// Builds the benchmark for a plain x86-64 and finds the program.
fn build() -> Result<PathBuf, String> {
    let mut command = cargo();
    command.args([
        "bench",
        "-q",
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
    let file = target("callgrind.out");
    let output = Command::new("valgrind")
        .current_dir(root())
        .args([
            "--tool=callgrind",
            &format!("--callgrind-out-file={}", file.display()),
        ])
        .arg(program)
        .args(["--calls", workload, &calls.to_string()])
        .output()
        .map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let collected = text
        .lines()
        .find_map(|l| l.split("Collected : ").nth(1)?.trim().parse().ok());
    let _ = std::fs::remove_file(file);
    collected.ok_or_else(|| format!("valgrind does not count:\n{text}"))
}
