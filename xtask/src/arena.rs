//! `cargo xtask arena`: machines with hidden errors, on which ways of compensation are scored.

use crate::process::{arena, run, trueaxis};

/// # Errors
/// If the program does not build, a submission is refused, or scores are not as published.
pub fn execute(options: &[&str]) -> Result<(), String> {
    trueaxis()?;
    run(arena().args(options))
}
