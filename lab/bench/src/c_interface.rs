//! Cost of an update through the C interface compared with the Rust update inside it: instructions, by callgrind.

use crate::callgrind;
use lab_capi::{BuildCapacities, CProgram, blob, libraries};
use programs::process::root;
use std::process::Command;

/// Number of periods of `soft_motion` in 5 s.
const PERIODS: f64 = 20_000.0;

/// # Errors
/// If something does not build or cannot be counted.
pub fn print() -> Result<(), String> {
    let libraries = libraries(&BuildCapacities::USUAL)?;
    let mut program = CProgram::plain("gcc", &["-std=c99", "-O2"]);
    program.sources([root().join("firmware/capi/examples/soft_motion.c")]);
    let program = program.link(&libraries, "soft_motion_plain")?;
    println!("instructions per update through the C border, and of the Rust servo in it:");
    for name in ["huron-13", "table-head-13"] {
        let mut command = Command::new(&program);
        command.arg(blob(name)).arg("5");
        let per_period = |function| {
            let (instructions, _) = callgrind::count(&command, Some(function))?;
            Ok::<f64, String>(instructions as f64 / PERIODS)
        };
        let whole = per_period("trueaxis_servo_update")?;
        let inner = per_period("trueaxis::servo::*::advance*")?;
        println!("  {name:<20} {whole:>6.0} {inner:>6.0}");
    }
    Ok(())
}
