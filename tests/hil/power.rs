//! Power cuts during uploads, and bit flips in the flash: after every restart one complete compensation is active.

use crate::board::{Board, Setup};
use crate::cases::{self, Case};
use crate::{Failure, Seen};
use std::fs;
use std::thread;
use std::time::{Duration, Instant};
use trueaxis::link::{Fault, Slot, SlotState};
use trueaxis_link::LinkedController;
use trueaxis_tests::Fixed;

/// Number of power cuts during uploads.
const CUTS: u32 = 40;
/// Number of evaluations after each, to determine which compensation is active.
const LOOKS: usize = 40;
/// Length of a slot in bytes.
const SLOT: usize = 256 * 1024;

pub fn run(setup: &Setup<'_>) -> Seen {
    // Two boards at a time, each with every other cut, because each sometimes waits for its line and its file.
    let [even, odd] = thread::scope(|scope| {
        let other = scope.spawn(|| cuts(setup, "power-odd", 1).map_err(|e| e.to_string()));
        let own = cuts(setup, "power-even", 0).map_err(|e| e.to_string());
        [
            own,
            other.join().unwrap_or_else(|_| Err("a panic".to_owned())),
        ]
    });
    let (even, odd) = (even?, odd?);
    let (unfinished, finished) = (even.0 + odd.0, even.1 + odd.1);
    // Otherwise nothing was tested.
    if unfinished < CUTS / 5 {
        return Err(format!("only {unfinished} of {CUTS} cuts hit an upload").into());
    }
    Ok(format!(
        "{CUTS} cuts, {unfinished} within an upload, {finished} behind it; all were completed \
         afterwards"
    ))
}

/// Every second cut from `first` on; returns how many were within an upload, and how many after it.
fn cuts(setup: &Setup<'_>, name: &str, first: u32) -> Result<(u32, u32), Failure> {
    let old = cases::compile(setup, "kolibri-10")?;
    let new = cases::compile(setup, "kolibri-12")?;
    let mut board = setup.board(name)?;
    board.start()?;
    board.flash(&old.path, &["--activate"])?;
    board.stop();
    let before = fs::read(board.flash_file())?;

    // Duration of an upload, to spread the cuts over it.
    board.start()?;
    let start = Instant::now();
    board.flash(&new.path, &[])?;
    let whole = start.elapsed();
    board.stop();

    let (mut unfinished, mut finished) = (0, 0);
    for cut in (first..CUTS).step_by(2) {
        let moment = whole * cut / (CUTS - 4);
        let found = cut_once(&mut board, &before, [&old, &new], moment)
            .map_err(|e| format!("cut {cut} after {moment:?}: {e}"))?;
        match found.slots[Slot::B.index()].state {
            SlotState::Valid { .. } => finished += 1,
            SlotState::Erasing | SlotState::Uploading { .. } => unfinished += 1,
            _ => {}
        }
    }
    Ok((unfinished, finished))
}

/// One interrupted upload, the restart, and the upload again; returns the controller's report in between.
fn cut_once(
    board: &mut Board<'_>,
    first: &[u8],
    [old, new]: [&Case; 2],
    moment: Duration,
) -> Result<LinkedController, Failure> {
    board.stop();
    fs::write(board.flash_file(), first)?;
    board.start()?;
    let mut upload = board.begin_flash(&new.path)?;
    std::thread::sleep(moment);
    board.stop();
    // The host does not continue before power is back.
    let _ = upload.kill();
    upload.wait()?;

    board.start()?;
    let controller = active_is(board, &[old, new])?;
    board.flash(&new.path, &["--activate"])?;
    active_is(board, &[new])?;
    Ok(controller)
}

/// Checks that one of `cases` is active, the newest of the valid slots, and complete.
fn active_is(board: &Board<'_>, cases: &[&Case]) -> Result<LinkedController, Failure> {
    let (mut client, controller) = board.connect()?;
    let active = controller.active.ok_or("nothing is active")?;
    let SlotState::Valid { length, crc, .. } = controller.slots[active.index()].state else {
        return Err("the active slot is not valid".into());
    };
    let stated = (length.to_le_bytes(), crc.to_le_bytes());
    let case = cases
        .iter()
        .find(|case| case.blob[8..12] == stated.0 && case.blob[12..16] == stated.1)
        .ok_or("another compensation is active")?;
    let c = case.load()?;
    let mut random = Fixed::new(u64::from(crc));
    let rows: Vec<_> = (0..LOOKS).map(|_| cases::row(&c, &mut random)).collect();
    let found = client.evaluate(&rows, c.axes().len(), c.auxiliaries().len())?;
    for (row, found) in rows.iter().zip(found) {
        if c.evaluate(&row.inputs, &row.travelling, &c.weights()) != found {
            return Err(format!("{} is not what is evaluated", case.name).into());
        }
    }
    Ok(controller)
}

/// Flipped bits and random flash at start.
pub fn run_bad_slots(setup: &Setup<'_>) -> Seen {
    const FLIPS: usize = 24;
    let old = cases::compile(setup, "kolibri-10")?;
    let new = cases::compile(setup, "kolibri-12")?;
    let mut board = setup.board("slots")?;
    board.start()?;
    board.flash(&old.path, &["--activate"])?;
    board.flash(&new.path, &["--activate"])?;
    board.stop();
    let good = fs::read(board.flash_file())?;
    let mut random = Fixed::new(7);
    for _ in 0..FLIPS {
        // Anywhere in the newest blob: the other one is used.
        let bit = random.bits() as usize % (8 * new.blob.len());
        let mut bad = good.clone();
        bad[SLOT + bit / 8] ^= 1 << (bit % 8);
        restart_with(&mut board, &bad)?;
        active_is(&board, &[&old]).map_err(|e| format!("bit {bit}: {e}"))?;
    }
    // Only noise, and an empty flash: no corrections, and the reason is reported.
    let noise: Vec<u8> = (0..2 * SLOT).map(|_| random.bits() as u8).collect();
    for bytes in [noise, vec![0; 2 * SLOT], vec![0xFF; 2 * SLOT], Vec::new()] {
        restart_with(&mut board, &bytes)?;
        let (_, controller) = board.connect()?;
        if (controller.active, controller.fault) != (None, Some(Fault::NoCompensation)) {
            return Err(format!("{controller:?}").into());
        }
        board.flash(&old.path, &["--activate"])?;
        active_is(&board, &[&old])?;
    }
    Ok(format!(
        "{FLIPS} flipped bits: the other slot; noise, zeros, blank, nothing: no correction, and \
         an upload helps"
    ))
}

fn restart_with(board: &mut Board<'_>, flash: &[u8]) -> Result<(), Failure> {
    board.stop();
    fs::write(board.flash_file(), flash)?;
    board.start()
}
