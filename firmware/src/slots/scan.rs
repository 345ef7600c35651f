//! Determines the content of a slot. Every byte is read in a way that may fail: a torn word is a possible result.

use trueaxis::{HEADER, Header};

use super::layout::{self, NO_BLOB, Record, TRAILER, WORD};
use super::{Damage, Slot, SlotState, Slots, TableFlash};

/// Result of a scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScannedSlot {
    pub state: SlotState,
    /// Erase cycles.
    pub wear: u32,
    /// The sequence number, also of a damaged blob.
    pub committed: Option<u32>,
}

impl ScannedSlot {
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

    /// Whether sequence number `a` is newer than `b`, across the wrap.
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

/// A word of the flash cannot be read.
pub(super) struct Unreadable;

impl<F: TableFlash> Slots<F> {
    /// Reads whole lines of a slot.
    pub(super) fn read(&mut self, slot: Slot, at: usize, out: &mut [u8]) -> Result<(), Unreadable> {
        let start = self.flash.range(slot).start as usize + at;
        self.flash.read(start as u32, out).map_err(|_| Unreadable)
    }

    /// One line of a slot; `None` if it cannot be read.
    pub(super) fn line(&mut self, slot: Slot, at: usize) -> Option<[u8; WORD]> {
        let mut line = [0; WORD];
        self.read(slot, at, &mut line).ok().map(|()| line)
    }

    /// Whether the bytes from `start` to `end`, whole lines, read blank.
    pub(super) fn is_blank(&mut self, slot: Slot, start: usize, end: usize) -> bool {
        (start..end)
            .step_by(WORD)
            .all(|at| self.line(slot, at).is_some_and(|line| layout::blank(&line)))
    }

    /// Reads a slot into `found`.
    pub(super) fn scan(&mut self, slot: Slot) {
        let (state, committed) = self.look(slot);
        let own = self.read_record(slot).ok().map(|record| record.wear);
        let seen = self.read_record(slot.other()).ok();
        let seen = seen.map(|record| record.other_wear);
        let found = &mut self.found[slot.index()];
        // The largest of all known values, because counts only grow.
        let wear = found.wear.max(own.unwrap_or(0)).max(seen.unwrap_or(0));
        *found = ScannedSlot {
            state,
            wear,
            committed,
        };
        self.scan_choices(slot);
    }

    /// The record of a slot, even of one being erased.
    pub(super) fn read_record(&mut self, slot: Slot) -> Result<Record, Damage> {
        let length = self.length() as usize;
        if length < TRAILER {
            return Err(Damage::Record);
        }
        let mut bytes = [0; 64];
        let read = self.read(slot, layout::record_at(length).start, &mut bytes);
        read.map_err(|_| Damage::Record)?;
        Record::decode(&bytes)
    }

    /// Content of a slot, with the sequence number even if the blob is damaged.
    fn look(&mut self, slot: Slot) -> (SlotState, Option<u32>) {
        let damaged = |damage| (SlotState::Damaged(damage), None);
        let length = self.length() as usize;
        if length < NO_BLOB + HEADER {
            return damaged(Damage::Record);
        }
        if self.is_blank(slot, length - TRAILER, length) {
            return if self.is_blank(slot, 0, length - TRAILER) {
                (SlotState::Blank, None)
            } else {
                damaged(Damage::Record)
            };
        }
        let mark = layout::mark_at(length);
        if !self.is_blank(slot, mark.start, mark.end) {
            return (SlotState::Erasing, None);
        }
        let record = match self.read_record(slot) {
            Ok(record) if record.length <= self.capacity() => record,
            Ok(_) => return damaged(Damage::Record),
            Err(damage) => return damaged(damage),
        };
        let Record {
            length: size, crc, ..
        } = record;
        let Some(commit) = self.line(slot, layout::commit_at(length).start) else {
            return damaged(Damage::Commit);
        };
        if layout::blank(&commit) {
            let uploading = SlotState::Uploading {
                received: 0,
                length: size,
                crc,
            };
            return (uploading, None);
        }
        let sequence = match record.committed(&commit) {
            Ok(sequence) => sequence,
            Err(damage) => return damaged(damage),
        };
        let state = match self.check_blob(slot) {
            Err(_) => SlotState::Damaged(Damage::Unreadable),
            Ok(Err(error)) => SlotState::Damaged(Damage::Blob(error)),
            Ok(Ok(header)) if header != (Header { length: size, crc }) => {
                SlotState::Damaged(Damage::OtherBlob)
            }
            Ok(Ok(_)) => SlotState::Valid {
                sequence,
                length: size,
                crc,
            },
        };
        (state, Some(sequence))
    }

    /// Header, length and checksum of the blob in a slot, or the offset from which it cannot be read.
    pub(super) fn check_blob(
        &mut self,
        slot: Slot,
    ) -> Result<Result<Header, trueaxis::LoadError>, u32> {
        let capacity = self.capacity();
        Header::check_pieces(capacity, |at, out| {
            self.read(slot, at as usize, out).map_err(|_| at)
        })
    }

    /// Whether an upload into a slot has begun to write the blob, so that no block of it belongs to an interrupted
    /// erase: its first block is erased before anything else, and its record is erased with its last block.
    ///
    /// With a single block, an erase from the end that was interrupted between mark and record looks the same.
    pub(super) fn is_begun(&mut self, slot: Slot) -> bool {
        // It must not merely differ from blank, because a bit may have flipped.
        let first = self.line(slot, 0);
        self.blocks() > 1 && first.is_some_and(|line| line.starts_with(&trueaxis::MAGIC))
    }
}
