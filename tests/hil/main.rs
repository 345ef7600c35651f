//! Hardware in the loop: the firmware in QEMU, driven by the real command and by the host's end of the link. `cargo
//! xtask hil` builds everything and runs this.
//!
//! The emulated processor must compute the same bits as this computer: there is no tolerance. One part covers the whole
//! process, from a plan to a machine that is measured with its compensation on.

mod board;
mod cases;
mod change;
mod line;
mod power;
mod same;
mod stop;
mod way;
mod widths;

use board::Setup;
use cases::Compiled;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

/// Why a part failed.
type Failure = Box<dyn std::error::Error>;
/// Result of a part, in a few words.
type Seen = Result<String, Failure>;

/// A part: its name, and the function that runs it.
type Part = (&'static str, fn(&Setup<'_>) -> Seen);

/// The longest first, so that it is not left running alone at the end.
const PARTS: [Part; 7] = [
    ("bit identity", same::run),
    ("power cuts", power::run),
    ("bad slots", power::run_bad_slots),
    ("change under way", change::run),
    ("bad lines", line::run),
    ("restarts", stop::run),
    ("whole way", way::run),
];

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let mut groups = arguments.split(|word| word == "--");
    let Some([command, folder]) = groups.next() else {
        eprintln!("usage: hil COMMAND FOLDER [-- MACHINE FIRMWARE PART…]…");
        return ExitCode::from(2);
    };
    let folder = Path::new(folder);
    let compiled = Compiled::new(command.into(), folder.join("blobs"));
    let mut boards = Vec::new();
    for group in groups {
        let [machine, firmware, chosen @ ..] = group else {
            eprintln!("a board needs its machine and its firmware");
            return ExitCode::from(2);
        };
        let setup = Setup {
            machine: machine.to_string_lossy().into_owned(),
            firmware: firmware.into(),
            command: command.into(),
            folder: folder.join(machine),
            compiled: &compiled,
        };
        boards.push((setup, chosen));
    }
    let folders = boards.iter().map(|(setup, _)| &setup.folder);
    for folder in folders.chain([&compiled.folder]) {
        if let Err(error) = std::fs::create_dir_all(folder) {
            eprintln!("{}: {error}", folder.display());
            return ExitCode::from(2);
        }
    }
    let mut jobs = Vec::new();
    for part in &PARTS {
        for (setup, chosen) in &boards {
            if chosen.iter().any(|chosen| chosen == part.0) {
                jobs.push((setup, part));
            }
        }
    }
    if run_all(&jobs) {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs parts in parallel, continuing after a failure; returns whether all succeeded. As many at a time as there are
/// processors: each has two boards, one of which may be waiting for the other end of its line.
fn run_all(jobs: &[(&Setup<'_>, &Part)]) -> bool {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let work = || {
        while let Some((setup, (name, run))) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            let start = Instant::now();
            let verdict = match run(setup) {
                Ok(seen) => format!("ok      {seen}"),
                Err(failure) => {
                    failed.store(true, Ordering::Relaxed);
                    format!("FAILED  {failure}")
                }
            };
            println!(
                "{:<11} {name:<17} {:>4.0} s  {verdict}",
                setup.machine,
                start.elapsed().as_secs_f32()
            );
        }
    };
    let others = thread::available_parallelism().map_or(1, |all| all.get() - 1);
    thread::scope(|scope| {
        for _ in 0..others.max(1) {
            scope.spawn(work);
        }
        work();
    });
    !failed.into_inner()
}
