//! What an update through the C border costs beside the Rust one in it: instructions, by callgrind.

use super::build::{self, Capacities};
use crate::process::{root, run, target};
use std::path::Path;
use std::process::Command;

/// Periods of `soft_motion` in 5 s.
const PERIODS: f64 = 20_000.0;

/// # Errors
/// What does not build or cannot be counted.
pub fn print() -> Result<(), String> {
    let libraries = build::libraries(&Capacities::USUAL)?;
    let folder = root().join("firmware/capi");
    let program = target("capi").join("soft_motion_plain");
    run(Command::new("gcc")
        .args(["-std=c99", "-O2"])
        .arg(format!("-I{}", folder.display()))
        .arg(folder.join("examples/soft_motion.c"))
        .arg(libraries.join("libtrueaxis_capi.a"))
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program))?;
    println!("instructions per update through the C border, and of the Rust servo in it:");
    for name in ["huron-13", "table-head-13"] {
        let blob = root().join(super::BLOBS).join(name).with_extension("trax");
        let whole = count(&program, &blob, "trueaxis_servo_update")?;
        let inner = count(&program, &blob, "trueaxis::servo::*::advance*")?;
        println!("  {name:<20} {whole:>6.0} {inner:>6.0}");
    }
    Ok(())
}

/// Instructions per period within a function, with what it calls.
fn count(program: &Path, blob: &Path, function: &str) -> Result<f64, String> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(format!("--toggle-collect={function}"))
        .arg(program)
        .arg(blob)
        .arg("5")
        .output()
        .map_err(|e| format!("valgrind: {e}"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|l| l.split("Collected : ").nth(1));
    let collected = collected.and_then(|n| n.trim().parse::<f64>().ok());
    match collected {
        Some(instructions) if instructions > 0.0 => Ok(instructions / PERIODS),
        _ => Err(format!("valgrind does not count {function}:\n{text}")),
    }
}
