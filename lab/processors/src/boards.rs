//! The runtime under RTIC and under embassy, built and linked.

use lab_processors::cross::{CORTEX_M, Cross};
use programs::process::{run, target};
use programs::{files, trueaxis};

/// Folders below `firmware/boards`.
const BOARDS: [&str; 2] = ["rtic", "embassy"];

/// Builds the boards with blobs of both policies.
///
/// # Errors
/// If something cannot be built.
pub fn build() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    let blobs = files::folder(target("board-blobs"))?;
    let trueaxis = trueaxis::build()?;
    for policy in ["orientation", "direction"] {
        let sources = ["machine-tool-length", "errors-13"]
            .map(|name| format!("examples/huron-k2x8/{name}.toml"));
        let blob = blobs.join(policy).with_extension("trax");
        trueaxis::compile(&trueaxis, &sources, &format!("--policy {policy}"), &blob)?;
    }
    for board in BOARDS {
        let (mut build, _) = cross.cargo(board, "build -q --release");
        run(build.env("TRUEAXIS_BLOBS", &blobs))?;
    }
    Ok(())
}
