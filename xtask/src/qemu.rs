//! QEMU, which stands in for a board.

use crate::packages::install;
use crate::process::works;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = "qemu-system-arm";

/// Installs QEMU for Cortex-M if it is missing.
///
/// # Errors
/// It cannot be installed.
pub fn provide() -> Result<(), String> {
    if works(Command::new(PROGRAM).arg("--version")) {
        return Ok(());
    }
    install(&[PROGRAM], "running on an emulated Cortex-M")
}

/// What makes QEMU translate, and log, one instruction at a time.
pub fn single_steps() -> &'static [&'static str] {
    let help = Command::new(PROGRAM).arg("--help").output();
    // Since version 8.1 it is a property of the translator.
    let old = help.is_ok_and(|o| String::from_utf8_lossy(&o.stdout).contains("\n-singlestep"));
    if old {
        &["-singlestep"]
    } else {
        &["-accel", "tcg,one-insn-per-tb=on"]
    }
}

/// An MPS2 board with a Cortex-M4F that runs `program`, which may use semihosting.
pub fn board(program: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command
        .args(["-machine", "mps2-an386", "-nographic", "-monitor", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(program);
    command
}
