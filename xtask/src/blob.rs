//! Blobs compiled by the command `trueaxis`.

use crate::process::{output, root};
use std::path::Path;
use std::process::Command;

/// Compiles a machine and its errors (paths relative to the root of the workspace) with these options.
///
/// # Errors
/// If it does not compile.
pub fn compile(
    trueaxis: &Path,
    sources: &[impl AsRef<Path>; 2],
    options: &str,
    blob: &Path,
) -> Result<(), String> {
    let mut compile = Command::new(trueaxis);
    compile
        .current_dir(root())
        .arg("compile")
        .args(sources.each_ref().map(AsRef::as_ref))
        .args(options.split_whitespace())
        .arg("-o")
        .arg(blob);
    output(&mut compile).map(drop)
}
