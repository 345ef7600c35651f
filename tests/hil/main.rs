//! Hardware in the loop: the firmware in QEMU, driven by the real command and by the host's end of
//! the link. `cargo xtask hil` builds everything and runs this.
//!
//! Nothing here has a tolerance: what the emulated processor computes must have the bits that this
//! computer computes.

mod alone;
mod board;
mod cases;
mod change;
mod line;
mod power;
mod same;
mod stop;
mod widths;

use board::Setup;
use std::process::ExitCode;
use std::time::Instant;

/// What went wrong.
type Failure = Box<dyn std::error::Error>;
/// What a part has seen, in a few words.
type Seen = Result<String, Failure>;

/// A part: its name, and what runs it.
type Part = (&'static str, fn(&Setup) -> Seen);

const PARTS: [Part; 7] = [
    ("bit identity", same::run),
    ("change under way", change::run),
    ("power cuts", power::run),
    ("bad slots", power::run_bad_slots),
    ("bad lines", line::run),
    ("restarts", stop::run),
    ("runtime alone", alone::run),
];

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [machine, firmware, command, folder, chosen @ ..] = &arguments[..] else {
        eprintln!("usage: hil MACHINE FIRMWARE COMMAND FOLDER PART…");
        return ExitCode::from(2);
    };
    let setup = Setup {
        machine: machine.to_string_lossy().into_owned(),
        firmware: firmware.into(),
        command: command.into(),
        folder: folder.into(),
    };
    if let Err(error) = std::fs::create_dir_all(&setup.folder) {
        eprintln!("{}: {error}", setup.folder.display());
        return ExitCode::from(2);
    }
    let mut failed = false;
    for (name, run) in PARTS {
        if chosen.iter().all(|chosen| chosen != name) {
            continue;
        }
        let start = Instant::now();
        let verdict = match run(&setup) {
            Ok(seen) => format!("ok      {seen}"),
            Err(failure) => {
                failed = true;
                format!("FAILED  {failure}")
            }
        };
        println!(
            "{:<11} {name:<17} {:>4.0} s  {verdict}",
            setup.machine,
            start.elapsed().as_secs_f32()
        );
    }
    if failed {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}
