//! `cargo xtask random-machines`: the scheme `exact` on machines nobody drew.

use crate::process::{self, RANDOM_MACHINES};
use std::process::Command;

/// # Errors
/// What is claimed about them does not hold, or the program does not build.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let program = process::example(RANDOM_MACHINES)?;
    process::run(Command::new(program).args(options))
}
