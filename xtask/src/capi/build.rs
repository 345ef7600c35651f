//! The libraries for this computer.

use crate::process::{cargo, run, target};
use std::path::PathBuf;

/// Builds both; the folder that has them.
///
/// # Errors
/// They do not build.
pub fn libraries() -> Result<PathBuf, String> {
    let folder = target("capi");
    run(cargo()
        .args(["rustc", "-q", "--release", "-p", "trueaxis-capi", "--lib"])
        .args([
            "--features",
            "std,model",
            "--crate-type",
            "staticlib,cdylib",
            "--",
        ])
        .args(["-C", "link-arg=-Wl,-soname,libtrueaxis.so.0"])
        .env("CARGO_TARGET_DIR", &folder))?;
    Ok(folder.join("release"))
}
