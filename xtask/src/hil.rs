//! `cargo xtask hil`: the firmware in QEMU, flashed and driven over its serial line.

use crate::cross::Cross;
use crate::process::{cargo, run, target};
use crate::qemu;
use std::process::Command;

/// # Errors
/// What cannot be built, or what did not hold.
pub fn execute(parts: &[&str]) -> Result<(), String> {
    let cross = Cross::provide()?;
    qemu::provide()?;
    let mut folder = None;
    // The one for the real part is linked, if not run.
    for board in ["stm32f405", "qemu"] {
        let words = [
            "build",
            "-q",
            "--release",
            "--features",
            board,
            "--bin",
            board,
        ];
        let (mut build, profiles) = cross.cargo("stm32f405", &words);
        run(&mut build)?;
        folder = Some(profiles);
    }
    let firmware = folder.unwrap_or_default().join("release/qemu");
    run(cargo()
        .args(["build", "-q", "-p", "trueaxis-host", "-p", "trueaxis-tests"])
        .args(["--bin", "trueaxis", "--bin", "hil"]))?;
    // Of the usual profile, whatever this was built with.
    let programs = target("debug");
    let mut hil = Command::new(programs.join("hil"));
    hil.arg(firmware)
        .arg(programs.join("trueaxis"))
        .arg(target("hil"))
        .args(parts);
    run(&mut hil)
}
