//! The command `trueaxis`, and programs that are built with it.

use crate::process::{cargo, output, root, run, target};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Examples built with it: they generate blobs for `bench-target`, move through programs for `gcode`, and compile for
/// random machines.
const EXAMPLES: [&str; 4] = [
    "bench-blobs",
    "calibration-machine",
    "gcode_moves",
    "random-machines",
];

/// The machines with hidden errors.
const ARENA: &str = "trueaxis-arena";

/// Builds the command with the default profile; returns its path.
///
/// # Errors
/// If it does not build.
pub fn build() -> Result<PathBuf, String> {
    // Builds everything that the commands need from the workspace together: cargo selects the features of dependencies
    // by what is built, and with an example included they match `cargo test --workspace`. Otherwise half of them would
    // be built again.
    let programs = ["trueaxis", "hil", ARENA].map(|name| ["--bin", name]);
    let examples = EXAMPLES.map(|name| ["--example", name]);
    run(cargo()
        .args(["build", "-q", "--workspace"])
        .args(programs.as_flattened())
        .args(examples.as_flattened()))?;
    Ok(target("debug").join("trueaxis"))
}

/// Builds the command as shipped; returns its path.
///
/// # Errors
/// If it does not build.
pub fn shipped() -> Result<PathBuf, String> {
    let words = "build -q --profile dist -p trueaxis-cli --bin trueaxis";
    run(cargo().args(words.split(' ')))?;
    Ok(target("dist").join("trueaxis"))
}

/// The arena, built by [`build`].
pub fn arena() -> Command {
    Command::new(target("debug").join(ARENA))
}

/// An example, built by [`build`].
pub fn example(name: &str) -> Command {
    Command::new(target("debug").join("examples").join(name))
}

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
