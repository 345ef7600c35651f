//! A program that stops: it restarts and reports the reason.

use crate::board::Setup;
use crate::cases;
use crate::{Failure, Seen};
use trueaxis::link::Restart;

pub fn run(setup: &Setup<'_>) -> Seen {
    let case = cases::compile(setup, "huron-13")?;
    let mut shown = Vec::new();
    for wanted in ["panic", "exception"] {
        let mut board = setup.board(wanted)?;
        // First a normal start, so that there is a compensation to start with.
        board.start()?;
        board.flash(&case.path, &["--activate"])?;
        board.start_wanting(Some(wanted))?;
        let (mut client, controller) = board.connect()?;
        if controller.active.is_none() {
            return Err(format!("after a {wanted} the slots are not there").into());
        }
        let health = client.health()?.ok_or("health is not known")?;
        let known = match (wanted, health.restart) {
            ("panic", Restart::Panic { line, file }) => {
                line > 0 && file.to_string().ends_with("lib.rs")
            }
            // Undefined instruction, inside the program.
            ("exception", Restart::Exception { address, status }) => {
                status == 1 << 16 && (0x400..0x40_0000).contains(&address)
            }
            _ => false,
        };
        if !known {
            return Err(format!("after a {wanted}: {}", health.restart).into());
        }
        drop(client);
        shown.push(monitor(setup, &board.port(), &health.restart)?);
        // The reason is reported once.
        board.start()?;
        let (mut client, _) = board.connect()?;
        let health = client.health()?.ok_or("health is not known")?;
        if health.restart.is_fault() {
            return Err(format!("without a fault: {}", health.restart).into());
        }
    }
    Ok(shown.join("; "))
}

/// The command's output about it.
fn monitor(setup: &Setup<'_>, port: &str, restart: &Restart) -> Result<String, Failure> {
    let output = setup.trueaxis(&["monitor", "--port", port, "--count", "1"])?;
    let text = String::from_utf8(output.stdout)?;
    let line = text.lines().find(|line| line.starts_with("started"));
    match line {
        Some(line) if line.ends_with(&restart.to_string()) => Ok(restart.to_string()),
        _ => Err(format!("the monitor does not show it: {text}").into()),
    }
}
