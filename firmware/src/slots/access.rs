//! Erases and programs flash, reading back each time.

use embedded_storage::nor_flash::NorFlashError as _;

use super::layout::{self, Record, WORD};
use super::upload::{Progress, Session, Upload};
use super::{Slot, SlotError, Slots, TableFlash, WhileBusy};

/// Words that could not be programmed.
pub(super) struct Failure {
    /// Offset of the first of them.
    pub offset: u32,
    pub error: SlotError,
}

impl<F: TableFlash> Slots<F> {
    /// Length of a slot in bytes; 0 if the driver describes invalid slots.
    pub(super) fn length(&self) -> u32 {
        let [a, b] = Slot::BOTH.map(|slot| {
            let range = self.flash.range(slot);
            let length = range.end.saturating_sub(range.start);
            let whole =
                [range.start, length].map(|edge| (edge as usize).is_multiple_of(F::ERASE_SIZE));
            if whole == [true; 2] { length } else { 0 }
        });
        if a == b { a } else { 0 }
    }

    /// Number of blocks in a slot.
    pub(super) fn blocks(&self) -> u32 {
        self.length() / F::ERASE_SIZE as u32
    }

    /// The slot for the next upload.
    pub(super) fn target(&self) -> Slot {
        match self.active.or_else(|| self.newest()) {
            Some(kept) => kept.other(),
            None => Slot::A,
        }
    }

    /// Refuses operations that would stall a running servo.
    pub(super) fn may_stall(&self) -> Result<(), SlotError> {
        match self.flash.while_busy() {
            WhileBusy::Standstill if !self.standstill => Err(SlotError::NotStandstill),
            _ => Ok(()),
        }
    }

    /// Marks the upload as spoiled until the caller stores a better state.
    pub(super) fn spoil(&mut self) {
        if let Some(session) = &mut self.session {
            session.upload.progress = Progress::Spoiled;
        }
    }

    /// Whether writing a choice to this slot stalls a running servo.
    #[must_use]
    pub(crate) fn choosing_stalls(&self, slot: Slot) -> bool {
        match self.flash.while_busy() {
            WhileBusy::Standstill => true,
            // The servo reads this slot's bank.
            WhileBusy::DualBank => self.active == Some(slot),
            WhileBusy::ServoInRam => false,
        }
    }

    /// Whether block `number` of a slot reads blank.
    pub(super) fn is_block_blank(&mut self, slot: Slot, number: u32) -> bool {
        let start = number as usize * F::ERASE_SIZE;
        self.is_blank(slot, start, start + F::ERASE_SIZE)
    }

    /// Marks the slot as being erased, before any erase, so that no interrupted erase leaves a valid slot. Returns
    /// false if the mark cannot be written: then blocks that read blank cannot be relied on.
    pub(super) fn mark(&mut self, slot: Slot) -> bool {
        let length = self.length() as usize;
        // One word is enough. If it is bad, a commit without a matching record serves the same purpose.
        for place in [layout::mark_at(length), layout::commit_at(length)] {
            for at in place.step_by(F::WRITE_SIZE) {
                let _ = self.try_program(slot, at, &[0; WORD][..F::WRITE_SIZE]);
            }
            self.scan(slot);
            if !self.found[slot.index()].proven() {
                return true;
            }
        }
        false
    }

    /// Erases one block.
    pub(super) fn erase(&mut self, slot: Slot, number: u32) -> Result<(), SlotError> {
        let size = F::ERASE_SIZE as u32;
        let offset = number * size;
        let start = self.flash.range(slot).start + offset;
        let error = match self.flash.erase(start, start + size) {
            Err(error) => SlotError::Flash(error.kind()),
            Ok(()) if self.is_block_blank(slot, number) => return Ok(()),
            Ok(()) => SlotError::Readback { offset },
        };
        Err(self.failed(slot, offset, error))
    }

    /// Writes the record of a freshly erased slot.
    pub(super) fn record(&mut self, upload: &Upload) -> Result<(), SlotError> {
        let slot = upload.slot;
        let wear = &mut self.found[slot.index()].wear;
        *wear = wear.saturating_add(1);
        let record = Record {
            length: upload.length,
            crc: upload.crc,
            wear: *wear,
            other_wear: self.wear(slot.other()),
        };
        let place = layout::record_at(self.length() as usize);
        self.program(slot, place.start, &record.encode())
    }

    /// Programs whole words at offset `at` of a slot, and records a block that fails. Words that already read so are
    /// skipped; no word is written twice between erases.
    pub(super) fn program(&mut self, slot: Slot, at: usize, bytes: &[u8]) -> Result<(), SlotError> {
        self.try_program(slot, at, bytes)
            .map_err(|Failure { offset, error }| match error {
                SlotError::NotBlank { .. } => error,
                _ => self.failed(slot, offset, error),
            })
    }

    /// Programs, if a single failing word does not matter.
    pub(super) fn try_program(
        &mut self,
        slot: Slot,
        at: usize,
        bytes: &[u8],
    ) -> Result<(), Failure> {
        let mut done = 0;
        while done < bytes.len() {
            let place = at + done;
            let within = place % WORD;
            let part = &bytes[done..bytes.len().min(done + WORD - within)];
            self.program_line(slot, place - within, within, part)?;
            done += part.len();
        }
        Ok(())
    }

    /// Like `try_program`, within one line, which starts at `line`, from byte `within` on.
    fn program_line(
        &mut self,
        slot: Slot,
        line: usize,
        within: usize,
        wanted: &[u8],
    ) -> Result<(), Failure> {
        let not_blank = |offset| {
            let error = SlotError::NotBlank { offset };
            Failure { offset, error }
        };
        let place = |word: usize| (line + within + word) as u32;
        // A torn word cannot be read and is not blank.
        let held = self.line(slot, line).ok_or(not_blank(place(0)))?;
        let words = (0..wanted.len()).step_by(F::WRITE_SIZE);
        let mut first = None;
        for word in words {
            let new = &wanted[word..word + F::WRITE_SIZE];
            let old = &held[within + word..][..F::WRITE_SIZE];
            if new == old {
                continue;
            }
            let offset = place(word);
            if !layout::blank(old) {
                return Err(not_blank(offset));
            }
            first = first.or(Some(offset));
            let start = self.flash.range(slot).start;
            let result = self.flash.write(start + offset, new);
            result.map_err(|error| Failure {
                offset,
                error: SlotError::Flash(error.kind()),
            })?;
        }
        let Some(offset) = first else {
            return Ok(());
        };
        let written = self.line(slot, line);
        let holds = |line: [u8; WORD]| line[within..].starts_with(wanted);
        if written.is_some_and(holds) {
            Ok(())
        } else {
            let error = SlotError::Readback { offset };
            Err(Failure { offset, error })
        }
    }

    /// Compares bytes that were received before with those repeated at `offset`.
    pub(super) fn compare(
        &mut self,
        session: &Session,
        offset: u32,
        again: &[u8],
    ) -> Result<(), SlotError> {
        let tail = session.tail.held();
        let written = session.receiving()? as usize - tail.len();
        let slot = session.upload.slot;
        let mut line = None;
        for (place, &byte) in (offset as usize..).zip(again) {
            let start = place - place % WORD;
            let offset = place as u32;
            let before = if place < written {
                if line.is_none_or(|(known, _)| known != start) {
                    let read = self.line(slot, start);
                    line = Some((start, read.ok_or(SlotError::Readback { offset })?));
                }
                line.map(|(_, bytes)| bytes[place % WORD])
            } else {
                tail.get(place - written).copied()
            };
            if before != Some(byte) {
                return Err(SlotError::Conflict { offset });
            }
        }
        Ok(())
    }
}
