//! Why an operation on the slots was refused or failed.

use core::fmt;
use embedded_storage::nor_flash::NorFlashErrorKind;
use trueaxis::LoadError;
use trueaxis::link::{Refusal, Slot};

/// Why an operation on the slots was refused or failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotError {
    /// The flash stalls the processor and the machine does not stand still; nothing was done.
    NotStandstill,
    /// The blob is shorter than a header or longer than a slot; nothing was done.
    Length {
        /// Capacity of a slot in bytes.
        capacity: u32,
    },
    /// No upload has begun, or it was aborted.
    NoUpload,
    /// The slot is still being erased.
    Erasing,
    /// Bytes are missing before these: continue at `expected`.
    Gap {
        /// Offset of the first byte that has not arrived.
        expected: u32,
    },
    /// A chunk extends beyond the end of the blob.
    Beyond {
        /// Announced length of the blob in bytes.
        length: u32,
    },
    /// A byte differs from the one received earlier at the same offset.
    Conflict {
        /// Offset of that byte.
        offset: u32,
    },
    /// An interrupted upload left bytes that differ from those to be written there: begin again, which erases the slot.
    NotBlank {
        /// Offset of the first byte of the word.
        offset: u32,
    },
    /// The flash does not contain what was written to it: begin again, which erases the slot.
    Readback {
        /// Offset of the first byte of the word.
        offset: u32,
    },
    /// A block has failed again after the whole slot was erased: the slot accepts no upload before the next start.
    Unusable {
        /// The slot.
        slot: Slot,
        /// Number of the block within the slot, from 0.
        block: u32,
    },
    /// A compensation in the slot is still being read; nothing was done.
    Leased,
    /// An error has spoiled the upload: begin again.
    Spoiled,
    /// Not all bytes have arrived: continue at `expected`.
    Incomplete {
        /// Offset of the first byte that has not arrived.
        expected: u32,
    },
    /// The blob is complete but not valid: header, length or checksum.
    Blob(LoadError),
    /// The blob is complete, but its header has another length or checksum than announced.
    OtherBlob,
    /// The compensation to be used is not in a valid slot.
    NotChosen,
    /// The slot has no room for another choice; an upload makes room.
    Full,
    /// The caller's check rejected the blob.
    Refused,
    /// The flash driver reports an error.
    Flash(NorFlashErrorKind),
    /// A bug in this crate or in the flash driver.
    LogicBug,
}

impl From<SlotError> for Refusal {
    fn from(error: SlotError) -> Self {
        match error {
            SlotError::NotStandstill => Self::NotStandstill,
            SlotError::Length { capacity } => Self::TooLong { held: capacity },
            SlotError::NoUpload => Self::NoUpload,
            SlotError::Erasing => Self::Erasing,
            SlotError::Gap { expected } | SlotError::Incomplete { expected } => {
                Self::Missing { expected }
            }
            SlotError::Beyond { length } => Self::Beyond { length },
            SlotError::Conflict { offset } => Self::Conflict { offset },
            SlotError::NotBlank { .. } | SlotError::Readback { .. } | SlotError::Spoiled => {
                Self::Spoiled
            }
            SlotError::Unusable { slot, block } => Self::Unusable { slot, block },
            SlotError::Leased => Self::Busy,
            SlotError::Blob(error) => Self::Load(error),
            SlotError::OtherBlob => Self::OtherBlob,
            SlotError::Flash(_) => Self::Flash,
            SlotError::NotChosen => Self::NoCompensation,
            SlotError::Full => Self::Full,
            // The reason is known to the code that checks.
            SlotError::Refused | SlotError::LogicBug => Self::LogicBug,
        }
    }
}

impl fmt::Display for SlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotBlank { offset } => write!(f, "flash at {offset} is not blank: begin again"),
            Self::Readback { offset } => write!(f, "flash at {offset} reads wrong: begin again"),
            Self::Leased => f.write_str("the slot is still being read"),
            Self::NotChosen => f.write_str("no valid slot is chosen"),
            Self::Refused => f.write_str("the blob cannot be used on this target"),
            Self::Flash(kind) => write!(f, "flash: {kind}"),
            other => Refusal::from(other).fmt(f),
        }
    }
}

impl core::error::Error for SlotError {}
