//! `cargo xtask random-machines`: the scheme `exact` on randomly generated machines.

use crate::process::{example, run, trueaxis};

/// # Errors
/// If a claim about them does not hold, or the program does not build.
pub fn execute(options: &[&str]) -> Result<(), String> {
    trueaxis()?;
    run(example("random-machines").args(options))
}
