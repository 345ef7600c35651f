//! `trueaxis linuxcnc start` on every sample configuration of LinuxCNC: what it accepts, LinuxCNC then starts; what it
//! refuses, it leaves as it was, and gives the reason.

use super::bench::LinuxCncBench;
use programs::packages;
use programs::process::{root, run, target, works};
use std::path::Path;
use std::process::Command;

/// The package `xfonts-base`.
const FONTS: &str = "/usr/share/fonts/X11/misc";

/// # Errors
/// If LinuxCNC does not start with a configuration that was accepted, though it does without the component.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    with(bench, "all")
}

/// The first configuration of each folder.
///
/// # Errors
/// As of [`check`].
pub fn few(bench: &LinuxCncBench) -> Result<(), String> {
    with(bench, "few")
}

fn with(bench: &LinuxCncBench, which: &str) -> Result<(), String> {
    // The machines that LinuxCNC draws beside its screen need a font.
    if !works(Command::new("xvfb-run").arg("--help")) || !Path::new(FONTS).exists() {
        packages::install(
            &["xvfb", "xfonts-base"],
            "the test of sample configurations",
        )?;
    }
    run(Command::new("python3")
        .arg(root().join("firmware/linuxcnc/tests/samples.py"))
        .arg(bench.trueaxis_path())
        .arg(bench.modules())
        .arg(target("linuxcnc").join("samples"))
        .arg(which))
}
