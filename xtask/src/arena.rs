//! `cargo xtask arena`: machines with hidden errors, on which ways of compensation are scored.

use crate::process::{self, cargo};

/// # Errors
/// If the program does not build, or refuses.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let program = ["run", "-q", "--release", "-p", "trueaxis-arena", "--"];
    process::run(cargo().args(program).args(options))
}
