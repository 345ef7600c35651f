//! Finding out what a slot holds.

use trueaxis::{HEADER, Header};

use super::layout::{self, Record, TRAILER};
use super::{Damage, Slot, SlotState, Slots, TableFlash};

/// What a scan has found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub state: SlotState,
    /// Erase cycles.
    pub wear: u32,
    /// The sequence number, of a damaged blob too.
    pub committed: Option<u32>,
}

impl Found {
    pub const NOTHING: Self = Self {
        state: SlotState::Damaged(Damage::Record),
        wear: 0,
        committed: None,
    };

    /// The sequence number of a valid slot.
    pub fn valid(&self) -> Option<u32> {
        match self.state {
            SlotState::Valid { sequence, .. } => Some(sequence),
            _ => None,
        }
    }

    /// Whether blocks that read blank are: their record was written after the last erase.
    pub fn proven(&self) -> bool {
        !matches!(
            self.state,
            SlotState::Blank
                | SlotState::Erasing
                | SlotState::Damaged(
                    Damage::Record | Damage::UnknownLayout { .. } | Damage::Commit
                )
        )
    }
}

/// Whether sequence number `a` is newer than `b`, across the wrap.
pub(super) fn newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).wrapping_sub(1) < u32::MAX / 2
}

/// What the bytes of a whole slot are; the sequence number also if the blob is damaged.
fn state(slot: &[u8]) -> (SlotState, Option<u32>) {
    let damaged = |damage| (SlotState::Damaged(damage), None);
    if slot.len() < TRAILER + HEADER {
        return damaged(Damage::Record);
    }
    let (blob, trailer) = slot.split_at(slot.len() - TRAILER);
    if layout::blank(trailer) {
        return if layout::blank(blob) {
            (SlotState::Blank, None)
        } else {
            damaged(Damage::Record)
        };
    }
    if !layout::blank(&slot[layout::mark_at(slot.len())]) {
        return (SlotState::Erasing, None);
    }
    let record = match Record::decode(slot) {
        Ok(record) if record.length as usize <= blob.len() => record,
        Ok(_) => return damaged(Damage::Record),
        Err(damage) => return damaged(damage),
    };
    let Record { length, crc, .. } = record;
    if layout::blank(&slot[layout::commit_at(slot.len())]) {
        let uploading = SlotState::Uploading {
            received: 0,
            length,
            crc,
        };
        return (uploading, None);
    }
    let sequence = match record.committed(slot) {
        Ok(sequence) => sequence,
        Err(damage) => return damaged(damage),
    };
    let state = match Header::check_slot(blob) {
        Err(error) => SlotState::Damaged(Damage::Blob(error)),
        Ok(header) if header != (Header { length, crc }) => SlotState::Damaged(Damage::OtherBlob),
        Ok(_) => SlotState::Valid {
            sequence,
            length,
            crc,
        },
    };
    (state, Some(sequence))
}

impl<F: TableFlash> Slots<F> {
    /// Reads a slot into `found`.
    pub(super) fn scan(&mut self, slot: Slot) {
        let bytes = self.flash.mapped(slot);
        let (state, committed) = state(bytes);
        let own = record(bytes).map(|record| record.wear);
        let seen = record(self.flash.mapped(slot.other())).map(|record| record.other_wear);
        let found = &mut self.found[slot.index()];
        // Of all that is known the largest: counts only grow.
        let wear = found.wear.max(own.unwrap_or(0)).max(seen.unwrap_or(0));
        *found = Found {
            state,
            wear,
            committed,
        };
    }
}

impl<F: TableFlash> Slots<F> {
    /// Whether a slot that seems to be uploaded to holds a part of a blob, and not all of it.
    ///
    /// An erase from the end that was cut between mark and record leaves the same, but with the first
    /// block erased or, where there is only one, with the whole blob. Then nothing that reads blank
    /// is sure to be.
    pub(super) fn is_in_part(&self, slot: Slot) -> bool {
        let bytes = self.flash.mapped(slot);
        let blob = bytes.get(..bytes.len().saturating_sub(TRAILER));
        let blob = blob.unwrap_or(&[]);
        // Not merely another word than blank: a bit may have flipped.
        let begun = blob.starts_with(&trueaxis::MAGIC);
        begun && Header::check_slot(blob).is_err()
    }
}

/// The record of a slot, of one that is being erased too.
fn record(slot: &[u8]) -> Option<Record> {
    if slot.len() < TRAILER {
        return None;
    }
    Record::decode(slot).ok()
}
