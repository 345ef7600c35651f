//! Erasing and programming, each read back.

use embedded_storage::nor_flash::NorFlashError;

use super::layout::{self, Record};
use super::upload::{Progress, Session, Upload};
use super::{Slot, SlotError, Slots, TableFlash, WhileBusy};

impl<F: TableFlash> Slots<F> {
    /// Bytes of a slot; 0 if the driver describes slots that cannot be.
    pub(super) fn length(&self) -> u32 {
        let [a, b] = Slot::BOTH.map(|slot| {
            let range = self.flash.range(slot);
            let length = range.end.saturating_sub(range.start);
            let fits = self.flash.mapped(slot).len() == length as usize;
            let whole =
                [range.start, length].map(|edge| (edge as usize).is_multiple_of(F::ERASE_SIZE));
            if fits && whole == [true; 2] {
                length
            } else {
                0
            }
        });
        if a == b { a } else { 0 }
    }

    /// Blocks of a slot.
    pub(super) fn blocks(&self) -> u32 {
        self.length() / F::ERASE_SIZE as u32
    }

    /// The slot that the next upload goes to.
    pub(super) fn target(&self) -> Slot {
        match self.active.or_else(|| self.newest()) {
            Some(kept) => kept.other(),
            None => Slot::A,
        }
    }

    /// Refuses what would stall a servo that runs.
    pub(super) fn may_stall(&self) -> Result<(), SlotError> {
        match self.flash.while_busy() {
            WhileBusy::Standstill if !self.standstill => Err(SlotError::NotStandstill),
            _ => Ok(()),
        }
    }

    /// Until the caller stores a better state of the upload, it cannot go on.
    pub(super) fn spoil(&mut self) {
        if let Some(session) = &mut self.session {
            session.upload.progress = Progress::Spoiled;
        }
    }

    /// Block `number` of a slot as it reads.
    pub(super) fn block(&self, slot: Slot, number: u32) -> Result<&[u8], SlotError> {
        let start = number as usize * F::ERASE_SIZE;
        let block = self.flash.mapped(slot).get(start..start + F::ERASE_SIZE);
        block.ok_or(SlotError::LogicBug)
    }

    /// Writes the mark before anything is erased, so that what an erase leaves is never valid.
    pub(super) fn mark(&mut self, slot: Slot) -> Result<(), SlotError> {
        let place = layout::mark_at(self.length() as usize);
        let result = self.program(slot, place.start, &[0; 32]);
        self.scan(slot);
        result
    }

    /// Erases one block.
    pub(super) fn erase(&mut self, slot: Slot, number: u32) -> Result<(), SlotError> {
        let size = F::ERASE_SIZE as u32;
        let start = self.flash.range(slot).start + number * size;
        let result = self.flash.erase(start, start + size);
        result.map_err(|error| SlotError::Flash(error.kind()))?;
        if !layout::blank(self.block(slot, number)?) {
            return Err(SlotError::Readback {
                offset: number * size,
            });
        }
        Ok(())
    }

    /// Writes the record of a slot that has just been erased.
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

    /// Programs whole words at offset `at` of a slot. Words that read so already are left alone;
    /// no word is written twice between erases.
    pub(super) fn program(&mut self, slot: Slot, at: usize, bytes: &[u8]) -> Result<(), SlotError> {
        let base = self.flash.range(slot).start as usize + at;
        let mut done = 0;
        while done < bytes.len() {
            let held = self.flash.mapped(slot).get(at..at + bytes.len());
            let held = held.ok_or(SlotError::LogicBug)?;
            let words = |from: usize| {
                let wanted = bytes[from..].chunks(F::WRITE_SIZE);
                wanted.zip(held[from..].chunks(F::WRITE_SIZE))
            };
            let equal = words(done).take_while(|(wanted, held)| wanted == held);
            let start = done + equal.count() * F::WRITE_SIZE;
            let changes = |(wanted, held): &(&[u8], &[u8])| wanted != held && layout::blank(held);
            let end = start + words(start).take_while(changes).count() * F::WRITE_SIZE;
            if start >= bytes.len() {
                break;
            }
            if end == start {
                return Err(SlotError::NotBlank {
                    offset: (at + start) as u32,
                });
            }
            let result = self.flash.write((base + start) as u32, &bytes[start..end]);
            result.map_err(|error| SlotError::Flash(error.kind()))?;
            let written = self.flash.mapped(slot).get(at + start..at + end);
            if written != Some(&bytes[start..end]) {
                return Err(SlotError::Readback {
                    offset: (at + start) as u32,
                });
            }
            done = end;
        }
        Ok(())
    }

    /// Compares bytes that have arrived before with those that come again at `offset`.
    pub(super) fn compare(
        &self,
        session: &Session,
        offset: u32,
        again: &[u8],
    ) -> Result<(), SlotError> {
        let next = session.receiving()? as usize;
        let written = next - session.tail.held().len();
        let held = self.flash.mapped(session.upload.slot).get(..written);
        let held = held.ok_or(SlotError::LogicBug)?;
        for (place, &byte) in (offset as usize..).zip(again) {
            let before = held
                .get(place)
                .or_else(|| session.tail.held().get(place - written));
            if before != Some(&byte) {
                return Err(SlotError::Conflict {
                    offset: place as u32,
                });
            }
        }
        Ok(())
    }
}
