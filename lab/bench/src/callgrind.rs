//! Instructions on this computer, counted by valgrind.

use programs::files;
use programs::process::{output, target};
use std::process::Command;

/// Runs a program; returns its number of instructions, or that of one of its functions including callees, and its
/// output.
///
/// # Errors
/// If it does not run or succeed, or nothing is counted.
pub fn count(command: &Command, function: Option<&str>) -> Result<(u64, String), String> {
    let file = target("counts.callgrind");
    let mut valgrind = Command::new("valgrind");
    valgrind
        .args(["--tool=callgrind", "-q"])
        .arg(format!("--callgrind-out-file={}", file.display()))
        .args(function.map(|name| format!("--toggle-collect={name}")))
        .arg(command.get_program())
        .args(command.get_args())
        .envs(command.get_envs().filter_map(|(k, v)| Some((k, v?))));
    if let Some(folder) = command.get_current_dir() {
        valgrind.current_dir(folder);
    }
    let printed = output(&mut valgrind)?;
    let text = files::read_text(&file)?;
    let _ = std::fs::remove_file(&file);
    let line = text.lines().find_map(|l| l.strip_prefix("totals: "));
    let instructions = line.and_then(|l| l.trim().parse().ok());
    match instructions {
        Some(instructions) if instructions > 0 => Ok((instructions, printed)),
        _ => Err(format!("{valgrind:?} counts nothing")),
    }
}
