//! Table slots whose contents are mirrored in memory and read there, for flash that cannot always be read in place: of
//! two banks, the one being erased or written cannot be read and holds both slots, or the flash is on an external bus.
//!
//! If the program is elsewhere, a servo that reads its samples here keeps running while a slot is erased and written.
#![allow(unsafe_code)]

#[cfg(test)]
mod tests;

use core::cell::UnsafeCell;
use core::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use crate::slots::{Mapped, Slot, TableFlash, WhileBusy};

/// Bytes per read while there are no errors.
const PIECE: usize = 1024;
/// Bytes per read where a piece cannot be read: one word with its error-correcting code.
const WORD: usize = 32;

/// Memory for both slots: a `static mut` of `main`, all zeros, so it takes no flash.
#[repr(C, align(32))]
pub struct Memory<const SLOT: usize>([UnsafeCell<[u8; SLOT]>; 2]);

impl<const SLOT: usize> Default for Memory<SLOT> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const SLOT: usize> Memory<SLOT> {
    /// Zeros.
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(SLOT.is_multiple_of(WORD), "a slot consists of whole words");
        }
        Self([const { UnsafeCell::new([0; SLOT]) }; 2])
    }
}

/// A flash with two slots of `SLOT` bytes, mirrored in memory.
///
/// A word that cannot be read (because the power went while it was being programmed, if there is an error-correcting
/// code) is zeros in memory: neither blank nor part of a valid blob.
pub struct Mirrored<F, const SLOT: usize> {
    flash: F,
    /// Start addresses of the slots.
    starts: [u32; 2],
    while_busy: WhileBusy,
    memory: &'static Memory<SLOT>,
}

impl<F: NorFlash, const SLOT: usize> Mirrored<F, SLOT> {
    /// Reads both slots, which begin at `starts` in the address space of the driver.
    pub fn open(
        flash: F,
        starts: [u32; 2],
        while_busy: WhileBusy,
        memory: &'static mut Memory<SLOT>,
    ) -> Self {
        let mut mirrored = Self {
            flash,
            starts,
            while_busy,
            memory,
        };
        for start in starts {
            mirrored.refresh(start, SLOT);
        }
        mirrored
    }

    /// Stops and returns the flash; the memory remains for anything that still reads it.
    pub fn close(self) -> F {
        self.flash
    }

    /// Copies the current contents of the flash.
    fn refresh(&mut self, from: u32, length: usize) {
        let mut piece = [0; PIECE];
        for at in (0..length).step_by(PIECE) {
            let (start, count) = (from + at as u32, PIECE.min(length - at));
            let Some(bytes) = piece.get_mut(..count) else {
                continue;
            };
            if self.flash.read(start, bytes).is_err() {
                for (word, start) in bytes.chunks_mut(WORD).zip((start..).step_by(WORD)) {
                    if self.flash.read(start, word).is_err() {
                        word.fill(0);
                    }
                }
            }
            self.put(start, bytes);
        }
    }

    /// Updates the bytes in memory that belong to a slot.
    fn put(&mut self, from: u32, bytes: &[u8]) {
        for (cell, start) in self.memory.0.iter().zip(self.starts) {
            let (first, end) = (from.max(start), start + SLOT as u32);
            let end = from.saturating_add(bytes.len() as u32).min(end);
            if first >= end {
                continue;
            }
            let (at, count) = ((first - start) as usize, (end - first) as usize);
            let Some(bytes) = bytes
                .get((first - from) as usize..)
                .and_then(|b| b.get(..count))
            else {
                continue;
            };
            // SAFETY: `at` and the `count` bytes after it are within the cell: `end` is at most that of the slot.
            // `bytes`, of the same length, do not overlap it because they belong to the caller. Only `self` has this
            // memory, and it is borrowed mutably: reading these bytes meanwhile would break the contract of `Mapped`.
            unsafe {
                let place = cell.get().cast::<u8>().add(at);
                place.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            }
        }
    }

    /// The first bytes of a slot; empty if there are not that many.
    fn mapped(&self, slot: Slot, length: usize) -> Mapped {
        let [a, b] = &self.memory.0;
        let cell = match slot {
            Slot::A => a,
            Slot::B => b,
        };
        if length > SLOT {
            return Mapped::constant(&[]);
        }
        // SAFETY: these bytes are within the cell, which is initialised and lives for ever. Only `put` changes them,
        // called by `open`, `erase` and `write` with `self` borrowed mutably.
        unsafe { Mapped::new(cell.get().cast::<u8>().cast_const(), length) }
    }
}

impl<F: ErrorType, const SLOT: usize> ErrorType for Mirrored<F, SLOT> {
    type Error = F::Error;
}

impl<F: NorFlash, const SLOT: usize> ReadNorFlash for Mirrored<F, SLOT> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash, const SLOT: usize> NorFlash for Mirrored<F, SLOT> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        let result = self.flash.erase(from, to);
        self.refresh(from, to.saturating_sub(from) as usize);
        result
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        let result = self.flash.write(offset, bytes);
        self.refresh(offset, bytes.len());
        result
    }
}

impl<F: NorFlash, const SLOT: usize> TableFlash for Mirrored<F, SLOT> {
    fn range(&self, slot: Slot) -> Range<u32> {
        let [a, b] = self.starts;
        let start = match slot {
            Slot::A => a,
            Slot::B => b,
        };
        start..start + SLOT as u32
    }

    fn in_place(&self, slot: Slot, length: u32) -> Mapped {
        self.mapped(slot, length as usize)
    }

    fn while_busy(&self) -> WhileBusy {
        self.while_busy
    }
}
