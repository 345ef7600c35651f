//! `cargo xtask bare`: what must do without `std` and a heap, built where there is neither.

use crate::cross::Cross;
use crate::process::{root, run};

/// The runtime is in the firmware's programs; nothing that runs on a board links the kinematics.
///
/// # Errors
/// What cannot be built.
pub fn execute() -> Result<(), String> {
    let manifest = root().join("shared/kinematics/Cargo.toml");
    let cross = Cross::provide()?;
    let (mut build, _) = cross.cargo(&["build", "-q", "--no-default-features"]);
    run(build.arg("--manifest-path").arg(manifest))
}
