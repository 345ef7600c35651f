//! `trueaxis linuxcnc start` on every sample configuration of LinuxCNC: what it accepts, LinuxCNC then starts; what it
//! refuses, it leaves as it was, and gives the reason.

use super::bench::Bench;
use crate::packages;
use crate::process::{root, run, target, works};
use std::process::Command;

/// # Errors
/// If LinuxCNC does not start with a configuration that was accepted, though it does without the component.
pub fn check(bench: &Bench) -> Result<(), String> {
    if !works(Command::new("xvfb-run").arg("--help")) {
        packages::install(&["xvfb"], "the test of sample configurations")?;
    }
    run(Command::new("python3")
        .arg(root().join("firmware/linuxcnc/tests/samples.py"))
        .arg(bench.trueaxis_path())
        .arg(bench.modules())
        .arg(target("linuxcnc").join("samples")))
}
