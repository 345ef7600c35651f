//! Two slots of flash, A and B, of which one always holds a complete compensation.
//!
//! A new blob goes to the slot that is not in use, is read back in place, and counts only once the last word, with a
//! sequence number, has been written after it. Which of the two slots a start uses is stored with them, and changes
//! only when it is [chosen](Slots::choose). Layout and guarantees: `docs/src/slots.md`.
//!
//! **Panic contract.** Whatever the flash contains, and whenever power is lost, every function returns with a
//! [`SlotState`] or a [`SlotError`].

mod access;
mod bad_blocks;
mod choices;
mod error;
mod layout;
mod lease;
mod scan;
mod tail;
mod upload;

pub use choices::{Choice, Table};
pub use error::SlotError;
pub use lease::{Lease, Mapped};
pub use trueaxis::link::{Damage, Slot, SlotState, WhileBusy};
pub use upload::{Progress, Upload};

use bad_blocks::Health;
use choices::Choices;
use core::ops::Range;
use embedded_storage::nor_flash::NorFlash;
use layout::{NO_BLOB, WORD};
use scan::{ScannedSlot, newer};
use upload::Session;

/// Flash with two slots that the processor can read in place.
///
/// `READ_SIZE` and `WRITE_SIZE` divide 32, `ERASE_SIZE` is a multiple of 32, erased bytes read `FF`. A word whose
/// error-correcting code reports an error, because its programming was interrupted, makes `read` fail.
pub trait TableFlash: NorFlash {
    /// Address range of a slot in the driver's address space: whole blocks of `ERASE_SIZE`, both slots of equal length.
    fn range(&self, slot: Slot) -> Range<u32>;

    /// The first `length` bytes of a slot in place; a slot starts at a multiple of 32 bytes.
    ///
    /// Called only for bytes that [`read`](embedded_storage::nor_flash::ReadNorFlash::read) has just returned: with an
    /// error-correcting code, a bad word makes `read` fail, so that no access in place becomes a bus fault.
    fn in_place(&self, slot: Slot, length: u32) -> Mapped;

    /// The bytes of a slot, as long as nothing is erased or programmed.
    fn read_in_place(&self, slot: Slot, length: u32) -> &[u8] {
        self.in_place(slot, length).borrowed(self)
    }

    /// How the servo keeps running while this flash erases or programs.
    fn while_busy(&self) -> WhileBusy;
}

/// The two slots of a [`TableFlash`], and the upload into one of them.
///
/// An upload consists of [`begin`](Self::begin), [`erase_step`](Self::erase_step) until the progress is
/// [`Progress::Receiving`], [`write`](Self::write) and [`commit`](Self::commit). All but the last may be repeated;
/// after it a new upload begins.
#[derive(Debug)]
pub struct Slots<F> {
    flash: F,
    found: [ScannedSlot; 2],
    choices: [Choices; 2],
    health: [Health; 2],
    /// Number of outstanding leases of the blob of each slot.
    leases: [u8; 2],
    active: Option<Slot>,
    standstill: bool,
    session: Option<Session>,
}

impl<F: TableFlash> Slots<F> {
    /// Reads both slots. No slot is active.
    #[must_use]
    pub fn open(flash: F) -> Self {
        const {
            assert!(
                F::WRITE_SIZE > 0 && WORD.is_multiple_of(F::WRITE_SIZE),
                "the write size divides 32"
            );
            assert!(
                F::READ_SIZE > 0 && WORD.is_multiple_of(F::READ_SIZE),
                "the read size divides 32"
            );
            assert!(
                F::ERASE_SIZE > 0 && F::ERASE_SIZE.is_multiple_of(WORD),
                "the erase size is a multiple of 32"
            );
        }
        let mut slots = Self {
            flash,
            found: [ScannedSlot::NOTHING; 2],
            choices: [Choices::default(); 2],
            health: [Health::Sound; 2],
            leases: [0; 2],
            active: None,
            standstill: false,
            session: None,
        };
        for slot in Slot::BOTH {
            slots.scan(slot);
        }
        slots
    }

    /// The flash. Nothing that can change may be leased.
    #[cfg(any(test, feature = "mock"))]
    pub(crate) fn into_flash(self) -> F {
        self.flash
    }

    /// The flash, for reading its state.
    #[must_use]
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// Size in bytes of the largest blob that fits into a slot.
    #[must_use]
    pub fn capacity(&self) -> u32 {
        self.length().saturating_sub(NO_BLOB as u32)
    }

    /// Content of a slot, as found at start or after the last change by these functions.
    #[must_use]
    pub fn state(&self, slot: Slot) -> SlotState {
        match self.session {
            Some(Session { upload, .. }) if upload.slot == slot => match upload.progress {
                Progress::Erasing { .. } => SlotState::Erasing,
                Progress::Receiving { next } => SlotState::Uploading {
                    received: next,
                    length: upload.length,
                    crc: upload.crc,
                },
                Progress::Spoiled => SlotState::Uploading {
                    received: 0,
                    length: upload.length,
                    crc: upload.crc,
                },
            },
            _ => self.found[slot.index()].state,
        }
    }

    /// Erase cycles of a slot: those of its last block, which no other block exceeds. An erase interrupted by a power
    /// loss is not counted.
    #[must_use]
    pub fn wear(&self, slot: Slot) -> u32 {
        self.found[slot.index()].wear
    }

    /// The valid slot with the newest blob.
    #[must_use]
    pub fn newest(&self) -> Option<Slot> {
        let sequences = Slot::BOTH.map(|slot| match self.state(slot) {
            SlotState::Valid { sequence, .. } => Some(sequence),
            _ => None,
        });
        match sequences {
            [Some(a), Some(b)] if newer(b, a) => Some(Slot::B),
            [Some(_), _] => Some(Slot::A),
            [None, Some(_)] => Some(Slot::B),
            [None, None] => None,
        }
    }

    /// Sets the slot that the servo reads, which no upload touches; an upload into it is aborted.
    ///
    /// While a cross-fade reads both slots, no upload may begin.
    pub fn set_active(&mut self, slot: Option<Slot>) {
        self.active = slot;
        if self.session.is_some_and(|s| Some(s.upload.slot) == slot) {
            self.abort();
        }
    }

    /// The slot that the servo reads.
    #[must_use]
    pub fn active(&self) -> Option<Slot> {
        self.active
    }

    /// Sets whether the machine stands still with its drives off and the servo does not run. Otherwise flash that
    /// stalls the processor is neither erased nor written; other flash ignores this. False at start.
    pub fn set_standstill(&mut self, standstill: bool) {
        self.standstill = standstill;
    }

    /// The upload in progress.
    #[must_use]
    pub fn upload(&self) -> Option<Upload> {
        self.session.map(|session| session.upload)
    }
}

#[cfg(test)]
mod tests;
