//! QEMU, as a replacement for a board.

use programs::packages;
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = "qemu-system-arm";

/// Installs QEMU for Cortex-M if it is missing.
///
/// # Errors
/// If it cannot be installed.
pub fn provide() -> Result<(), String> {
    packages::provide(PROGRAM, &[PROGRAM], "running on an emulated Cortex-M")
}

/// An MPS2 board with a Cortex-M4F that runs `program`, which may use semihosting. One instruction takes 2¹⁰ ns, which
/// counting programs rely on.
pub fn board(program: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command
        .args(["-machine", "mps2-an386", "-nographic", "-monitor", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-serial", "null", "-icount", "shift=10"])
        .arg("-kernel")
        .arg(program);
    command
}
