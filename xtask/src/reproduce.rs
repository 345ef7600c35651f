//! `cargo xtask reproduce`: the manual's pages about the source document's figures.

use crate::process::{self, cargo, root};

/// # Errors
/// If the program does not build, or a figure cannot be recomputed.
pub fn execute() -> Result<(), String> {
    let program = ["run", "-q", "--release", "-p", "trueaxis-reproduce", "--"];
    process::run(cargo().args(program).arg(root().join("docs/src")))
}
