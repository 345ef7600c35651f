//! Blobs to upload, and functions that perform an upload.

mod bad_words;
mod choices;
mod flips;
mod images;
mod model;
mod power_cut;
mod standstill;
mod upload;

use std::vec;
use std::vec::Vec;

use trueaxis::{
    AlignedBlob, Axis, Compensation, Direction, Draft, DraftBank, DraftGrid, GridAxis, Header,
    Holds, Interpolation, LoadError, SampleFormat, Term,
};

use super::{Progress, Slot, SlotError, Slots, TableFlash};

/// Loads every blob of these tests.
type Target<'a> = Compensation<'a, Holds<2, 4, 4, 4, 1>>;

fn draft(machine: &str) -> Draft {
    let axis = |name| Axis {
        name,
        travel: [-100.0, 100.0],
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 10.0,
        reversal_threshold: 0.01,
        ramp_rate: 0.5,
        reversal_rate: 10.0,
        reversal_acceleration: 10.0,
    };
    Draft {
        machine: machine.into(),
        axes: vec![axis(b'X'), axis(b'C')],
        ..Draft::default()
    }
}

/// A blob of one table whose samples all depend on `seed`.
fn blob(seed: u16, points: u16) -> AlignedBlob {
    let mut draft = draft("slots");
    let value = |point: u16| f32::from(seed + 1) * 1e-3 + f32::from(point) * 1e-4;
    draft.banks.push(DraftBank {
        input: 0,
        start: -100.0,
        step: 1.0,
        modulo: false,
        direction: Direction::Both,
        interpolation: Interpolation::Linear,
        format: SampleFormat::I16,
        columns: vec![(0..points).map(value).collect()],
    });
    draft.terms.push(Term {
        output: 1,
        weight: 1.0,
        limits: None,
        factors: [0].into_iter().collect(),
    });
    draft.encode().expect("a valid draft")
}

/// 25 × 25 × 25 nodes of two outputs: 125 kB.
fn large_blob() -> AlignedBlob {
    let mut draft = draft("large");
    let line = |input| GridAxis {
        input,
        start: -100.0,
        step: 5.0,
        points: 25,
        modulo: false,
    };
    draft.grids.push(DraftGrid {
        axes: vec![line(0), line(1), line(0)],
        outputs: vec![0, 1],
        format: SampleFormat::F32,
        values: (0..2 * 25_u16.pow(3))
            .map(|i| f32::from(i) * 1e-5)
            .collect(),
    });
    draft.encode().expect("a valid draft")
}

/// Whether a target accepts it, as a device checks before the commit.
fn loads(bytes: &[u8]) -> Result<(), LoadError> {
    Target::empty().load(bytes)
}

/// One attempt at an upload, in chunks, to be used from the next start on.
fn attempt<F: TableFlash>(
    slots: &mut Slots<F>,
    blob: &[u8],
    chunk: usize,
) -> Result<Slot, SlotError> {
    let slot = committed(slots, blob, chunk)?;
    slots.choose(slots.choosing(slot))?;
    Ok(slot)
}

/// Like `attempt`, without choosing it.
fn committed<F: TableFlash>(
    slots: &mut Slots<F>,
    blob: &[u8],
    chunk: usize,
) -> Result<Slot, SlotError> {
    let mut progress = begin(slots, blob)?;
    while matches!(progress, Progress::Erasing { .. }) {
        progress = slots.erase_step()?;
    }
    let Progress::Receiving { next } = progress else {
        return Err(SlotError::Spoiled);
    };
    let mut next = next as usize;
    while next < blob.len() {
        let end = blob.len().min(next + chunk);
        next = slots.write(next as u32, &blob[next..end])? as usize;
    }
    slots.commit(|bytes| loads(bytes).is_ok())
}

/// An upload as a host does it: starts again when told to.
fn begin<F: TableFlash>(slots: &mut Slots<F>, blob: &[u8]) -> Result<Progress, SlotError> {
    let Header { length, crc } = Header::read(blob).expect("a blob");
    slots.begin(length, crc)
}

/// Up to where the first byte is waited for.
fn erased<F: TableFlash>(slots: &mut Slots<F>, blob: &[u8]) {
    begin(slots, blob).expect("room");
    while slots.erase_step() != Ok(Progress::Receiving { next: 0 }) {}
}

/// Uploads one after the other, each of them active.
fn fill<'b, F: TableFlash>(
    slots: &mut Slots<F>,
    blobs: impl IntoIterator<Item = &'b AlignedBlob>,
) -> Slot {
    for blob in blobs {
        let slot = upload(slots, blob, 64);
        slots.set_active(Some(slot));
    }
    slots.active().expect("at least one blob")
}

fn upload<F: TableFlash>(slots: &mut Slots<F>, blob: &[u8], chunk: usize) -> Slot {
    for _ in 0..3 {
        match attempt(slots, blob, chunk) {
            Ok(slot) => return slot,
            Err(SlotError::NotBlank { .. } | SlotError::Readback { .. } | SlotError::Spoiled) => {}
            Err(error) => panic!("{error}"),
        }
    }
    panic!("three attempts were not enough");
}

/// What a start makes active: the slot selected for use or the one before it, with its bytes.
fn start<F: TableFlash>(slots: &mut Slots<F>) -> Option<(Slot, &[u8])> {
    let active = slots.in_use().or_else(|| slots.before())?;
    slots.set_active(Some(active));
    Some((active, slots.blob(active)?))
}

/// `count` different blobs of similar length.
fn blobs(count: u16, points: u16) -> Vec<AlignedBlob> {
    (0..count).map(|seed| blob(seed, points + seed)).collect()
}
