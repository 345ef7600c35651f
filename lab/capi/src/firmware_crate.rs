//! The published crate `trueaxis-firmware`: folders beside its sources have another licence and must be excluded.

use programs::process::{cargo, output};

/// # Errors
/// If the crate has a file with this in its path.
pub fn leaves_out(folder: &str) -> Result<(), String> {
    let words = "package -q --list --allow-dirty -p trueaxis-firmware";
    let files = output(cargo().args(words.split(' ')))?;
    if !files.contains("src/lib.rs") {
        return Err(format!("cargo package does not list the crate:\n{files}"));
    }
    match files.lines().find(|file| file.contains(folder)) {
        Some(file) => Err(format!("the crate trueaxis-firmware contains {file}")),
        None => Ok(()),
    }
}
