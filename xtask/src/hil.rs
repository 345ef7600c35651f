//! `cargo xtask hil`: the firmware in QEMU, flashed and driven over its serial line, on every board; and
//! the runtime alone on RISC-V.

use crate::cross::{CORTEX_M, Cross, RISC_V};
use crate::process::{cargo, run, target};
use crate::qemu;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

/// Boards: folder, the machine of QEMU that stands in for it, and what is tried there. What does not
/// depend on the processor or its flash is tried once.
const BOARDS: [(&str, &str, &[&str]); 2] = [
    (
        "stm32f405",
        "mps2-an386",
        &[
            "bit identity",
            "change under way",
            "power cuts",
            "bad slots",
            "bad lines",
            "restarts",
        ],
    ),
    (
        "stm32h743",
        "mps2-an500",
        &["bit identity", "power cuts", "bad slots", "restarts"],
    ),
];
/// The program for RISC-V: the same.
const ALONE: (&str, &str, &[&str]) = ("riscv", "virt", &["runtime alone"]);

/// `chosen`: of all parts only these.
///
/// # Errors
/// What cannot be built, or what did not hold.
pub fn execute(chosen: &[&str]) -> Result<(), String> {
    let known = |part: &&&str| {
        let all = BOARDS.iter().chain([&ALONE]);
        all.into_iter().any(|(_, _, parts)| parts.contains(part))
    };
    if let Some(part) = chosen.iter().find(|part| !known(part)) {
        return Err(format!("there is no part `{part}`"));
    }
    let wanted = |parts: &[&'static str]| -> Vec<&'static str> {
        let wanted = |part: &&&str| chosen.is_empty() || chosen.contains(part);
        parts.iter().filter(wanted).copied().collect()
    };
    run(cargo()
        .args(["build", "-q", "-p", "trueaxis-host", "-p", "trueaxis-tests"])
        .args(["--bin", "trueaxis", "--bin", "hil"]))?;
    let cross = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    let mut programs = Vec::new();
    for (board, machine, parts) in BOARDS {
        // The one for the real part is linked, if not run: it is what is built by default.
        let (mut build, _) = cross.cargo(board, &["build", "-q", "--release"]);
        run(&mut build)?;
        let words = "build -q --release --no-default-features --features qemu --bin qemu";
        let words: Vec<&str> = words.split(' ').collect();
        let (mut build, folder) = cross.cargo(board, &words);
        run(&mut build)?;
        programs.push((machine, folder.join("release/qemu"), wanted(parts)));
    }
    let (board, machine, parts) = ALONE;
    let cross = Cross::provide(RISC_V)?;
    qemu::provide_risc_v()?;
    let (mut build, folder) = cross.cargo(board, &["build", "-q", "--release"]);
    run(&mut build)?;
    let program = folder.join("release/trueaxis-riscv");
    programs.push((machine, program, wanted(parts)));
    // QEMU runs on one core: the first board beside the others. One that has failed does not keep the
    // others from being tried.
    let tried = |programs: &[(&str, PathBuf, Vec<&str>)]| -> Vec<String> {
        let tried = programs.iter();
        tried
            .filter_map(|(machine, program, parts)| try_on(machine, program, parts).err())
            .collect()
    };
    let (first, others) = programs.split_at(1);
    let failed = thread::scope(|scope| {
        let first = scope.spawn(|| tried(first));
        let mut failed = tried(others);
        match first.join() {
            Ok(of_first) => failed.extend(of_first),
            Err(_) => failed.push("what tries the first board has panicked".to_owned()),
        }
        failed
    });
    if failed.is_empty() {
        Ok(())
    } else {
        Err(failed.join("; "))
    }
}

/// Runs these parts on a machine of QEMU.
fn try_on(machine: &str, program: &Path, parts: &[&str]) -> Result<(), String> {
    if parts.is_empty() {
        return Ok(());
    }
    // Of the usual profile, whatever this was built with.
    let programs = target("debug");
    let mut hil = Command::new(programs.join("hil"));
    hil.arg(machine)
        .arg(program)
        .arg(programs.join("trueaxis"))
        .arg(target("hil").join(machine))
        .args(parts);
    run(&mut hil)
}
