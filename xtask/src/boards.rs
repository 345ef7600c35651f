//! `cargo xtask boards`: builds and links the runtime under RTIC and under embassy.

use crate::cross::{CORTEX_M, Cross};
use crate::process::{run, target, trueaxis};
use crate::{blob, files};

/// Folders below `firmware/boards`.
const BOARDS: [&str; 2] = ["rtic", "embassy"];

/// # Errors
/// If something cannot be built.
pub fn execute() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    let blobs = files::folder(target("board-blobs"))?;
    let trueaxis = trueaxis()?;
    for policy in ["orientation", "direction"] {
        let sources = ["machine-tool-length", "errors-13"]
            .map(|name| format!("examples/huron-k2x8/{name}.toml"));
        let blob = blobs.join(policy).with_extension("trax");
        blob::compile(&trueaxis, &sources, &format!("--policy {policy}"), &blob)?;
    }
    for board in BOARDS {
        let (mut build, _) = cross.cargo(board, "build -q --release");
        run(build.env("TRUEAXIS_BLOBS", &blobs))?;
    }
    Ok(())
}
