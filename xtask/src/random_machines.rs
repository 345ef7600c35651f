//! `cargo xtask random-machines`: the scheme `exact` on machines nobody drew.

use crate::process::{example, run, trueaxis};

/// # Errors
/// What is claimed about them does not hold, or the program does not build.
pub fn execute(options: &[&str]) -> Result<(), String> {
    trueaxis()?;
    run(example("random-machines").args(options))
}
