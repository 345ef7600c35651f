//! `cargo xtask boards`: the runtime under RTIC and under embassy, built and linked.

use crate::cross::{CORTEX_M, Cross};
use crate::process::{root, run, target, trueaxis};
use std::fs;
use std::process::Command;

/// Folders below `firmware/boards`.
const BOARDS: [&str; 2] = ["rtic", "embassy"];

/// # Errors
/// What cannot be built.
pub fn execute() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    let blobs = target("board-blobs");
    fs::create_dir_all(&blobs).map_err(|e| format!("{}: {e}", blobs.display()))?;
    let trueaxis = trueaxis()?;
    for policy in ["orientation", "direction"] {
        run(Command::new(&trueaxis)
            .current_dir(root())
            .arg("compile")
            .arg("examples/huron-k2x8/machine-tool-length.toml")
            .arg("examples/huron-k2x8/errors-13.toml")
            .args(["--policy", policy, "-o"])
            .arg(blobs.join(policy).with_extension("trax"))
            .stdout(std::process::Stdio::null()))?;
    }
    for board in BOARDS {
        let (mut build, _) = cross.cargo(board, &["build", "-q", "--release"]);
        run(build.env("TRUEAXIS_BLOBS", &blobs))?;
    }
    Ok(())
}
