//! `cargo xtask reproduce`: the pages in `docs/evidence` about the source document's figures.

use crate::process::{self, cargo, root};

/// Writes the pages, or with `--check` recomputes and compares them.
///
/// # Errors
/// If the program does not build, a figure cannot be recomputed, or a page shows something else.
pub fn execute(check: bool) -> Result<(), String> {
    if check {
        return process::run(cargo().args(["test", "--release", "-p", "trueaxis-reproduce"]));
    }
    let program = ["run", "-q", "--release", "-p", "trueaxis-reproduce", "--"];
    process::run(cargo().args(program).arg(root().join("docs/evidence")))
}
