//! The firmware in QEMU, flashed and driven over its serial line, on every board; and the image that is
//! shipped for the STM32F405, on a model of that chip.

use crate::cross::{CORTEX_M, Cross};
use crate::qemu;
use programs::process::{NOT_RUN, joined, root, run, target};
use programs::{files, packages, python, trueaxis};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

/// Boards: folder, the QEMU machine that replaces it, and the tests to run. Tests that do not depend on the processor
/// or its flash run once.
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
            "whole way",
        ],
    ),
    (
        "stm32h743",
        "mps2-an500",
        &["bit identity", "power cuts", "bad slots", "restarts"],
    ),
];

/// The part that runs the shipped image, and what its Python needs.
const SHIPPED: &str = "shipped image";
const UNICORN: &str = "unicorn>=2.1,<3";

/// The folders of the boards; their programs have the same names.
pub fn boards() -> impl Iterator<Item = &'static str> {
    BOARDS.iter().map(|(board, ..)| *board)
}

/// Names of all parts.
pub fn parts() -> Vec<&'static str> {
    let of_boards = BOARDS.iter().flat_map(|(_, _, parts)| *parts).copied();
    let mut all: Vec<&str> = of_boards.chain([SHIPPED]).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Runs the parts that are `chosen`, or all.
///
/// # Errors
/// If something cannot be built, or fails.
pub fn check(chosen: &[&str]) -> Result<(), String> {
    let wanted = |parts: &[&'static str]| -> Vec<&'static str> {
        let wanted = |part: &&&str| chosen.is_empty() || chosen.contains(part);
        parts.iter().filter(wanted).copied().collect()
    };
    let cortex_m = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    // The end of each build uses one processor only: in parallel none is idle.
    let (host, boards) = thread::scope(|scope| {
        let boards = BOARDS.map(|(board, ..)| scope.spawn(|| build_board(&cortex_m, board)));
        (trueaxis::build(), boards.map(joined))
    });
    let trueaxis = host?;
    let mut hil = Command::new(trueaxis.with_file_name("hil"));
    hil.arg(&trueaxis).arg(target("hil"));
    let mut image = None;
    for ((board, machine, parts), folder) in BOARDS.into_iter().zip(boards) {
        let (folder, parts) = (folder?.join("release"), wanted(parts));
        if board == "stm32f405" {
            image = Some(folder.join(board));
        }
        if !parts.is_empty() {
            hil.args(["--", machine])
                .arg(folder.join("qemu"))
                .args(parts);
        }
    }
    run(&mut hil)?;
    match image {
        Some(image) if !wanted(&[SHIPPED]).is_empty() => shipped(&image, &trueaxis),
        _ => Ok(()),
    }
}

/// Runs the image of a release, as it is, on a model of the STM32F405.
fn shipped(image: &Path, trueaxis: &Path) -> Result<(), String> {
    let folder = files::folder(target("hil").join("shipped"))?;
    packages::provide("python3", &["python3", "python3-venv"], "the shipped image")?;
    let Some(python) = python::environment(&folder.join("python"), "unicorn", &[UNICORN]) else {
        eprintln!("{NOT_RUN}{SHIPPED}: python3 with venv, or {UNICORN} could not be installed");
        return Ok(());
    };
    let program = root().join("tests/hil/shipped/run.py");
    run(Command::new(python)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .arg(program)
        .args([image, trueaxis, &folder]))
}

/// The firmware of a board for QEMU.
///
/// # Errors
/// If it cannot be built.
pub fn emulated(board: &str) -> Result<PathBuf, String> {
    Ok(build_board(&Cross::provide(CORTEX_M)?, board)?.join("release/qemu"))
}

/// Builds the programs of a board; returns their folder.
fn build_board(cross: &Cross, board: &str) -> Result<PathBuf, String> {
    // The one for the real part is linked but not run: it is the default build.
    cross.build(board, "build -q --release")?;
    let words = "build -q --release --no-default-features --features qemu --bin qemu";
    cross.build(board, words)
}
