//! `cargo xtask random-machines`: the scheme `exact` on machines nobody drew.

use crate::process::{self, cargo};

/// # Errors
/// What is claimed about them does not hold, or the program does not build.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let program = ["run", "-q", "--release", "-p", "trueaxis-tests"];
    let example = ["--example", "random-machines", "--"];
    process::run(cargo().args(program).args(example).args(options))
}
