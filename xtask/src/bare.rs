//! `cargo xtask bare`: what must do without `std` and a heap, built where there is neither.

use crate::cross::{CORTEX_M, Cross};
use crate::process::{root, run};

/// The runtime is in the programs of the board; of the kinematics those link only what they measure.
///
/// # Errors
/// What cannot be built.
pub fn execute() -> Result<(), String> {
    let manifest = root().join("shared/kinematics/Cargo.toml");
    let cross = Cross::provide(CORTEX_M)?;
    let (mut build, _) = cross.cargo("stm32f405", "build -q --no-default-features");
    run(build.arg("--manifest-path").arg(manifest))
}
