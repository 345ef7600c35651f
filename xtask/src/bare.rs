//! `cargo xtask bare`: builds the crates that must work without `std` and a heap for a target that has neither.

use crate::cross::{CORTEX_M, Cross};
use crate::process::{root, run};

/// The board programs contain the whole runtime, but only the parts of the kinematics that they measure.
///
/// # Errors
/// If something cannot be built.
pub fn execute() -> Result<(), String> {
    let manifest = root().join("shared/kinematics/Cargo.toml");
    let cross = Cross::provide(CORTEX_M)?;
    let (mut build, _) = cross.cargo("stm32f405", "build -q --no-default-features");
    run(build.arg("--manifest-path").arg(manifest))
}
