//! `cargo xtask grblhal`: the plugin for grblHAL against a stand-in of its interface, under sanitizers.

use crate::capi::{BLOBS, Capacities, Sanitized, compilers, libraries};
use crate::process::{cargo, root, run, target};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Controllers with so many axes: the second does not have those of some of the blobs.
const AXES: [u32; 2] = [6, 3];

/// # Errors
/// What does not compile without a warning, or does not hold.
pub fn execute() -> Result<(), String> {
    compilers("the plugin for grblHAL")?;
    let libraries = libraries(&Capacities::USUAL)?;
    let folder = root().join("firmware/grblhal");
    let tests = folder.join("tests");
    let standin = tests.join("standin");
    for axes in AXES {
        let mut program = Sanitized::new("gcc", "-std=c99");
        program.frames();
        program.define(&format!("N_AXIS={axes}"));
        program.include(&folder);
        program.include(&standin);
        for sources in [&folder, &tests, &standin] {
            program.sources(in_c(sources)?);
        }
        let program = program.link(&libraries, &target("capi").join(format!("grblhal_{axes}")))?;
        run(Command::new(program).arg(root().join(BLOBS)))?;
    }
    stays_out()
}

/// It is in no crate that is published: its licence is another.
fn stays_out() -> Result<(), String> {
    let mut list = cargo();
    list.args([
        "package",
        "--list",
        "--allow-dirty",
        "-p",
        "trueaxis-firmware",
    ]);
    let output = list.output().map_err(|e| format!("cargo package: {e}"))?;
    let files = String::from_utf8_lossy(&output.stdout);
    if !files.contains("src/lib.rs") {
        return Err(format!(
            "cargo package lists nothing: {}",
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    match files.lines().find(|file| file.starts_with("grblhal/")) {
        Some(file) => Err(format!("trueaxis-firmware contains {file}")),
        None => Ok(()),
    }
}

/// The files in C of a folder.
fn in_c(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "c"))
        .collect();
    files.sort();
    Ok(files)
}
