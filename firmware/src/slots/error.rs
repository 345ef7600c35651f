//! Why an operation on the slots was refused or failed.

use core::fmt;
use embedded_storage::nor_flash::NorFlashErrorKind;
use trueaxis::LoadError;
use trueaxis::link::Slot;

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

impl fmt::Display for SlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotStandstill => f.write_str("the machine is not at standstill with drives off"),
            Self::Length { capacity } => write!(f, "a slot holds 16 to {capacity} bytes"),
            Self::NoUpload => f.write_str("no upload has begun"),
            Self::Erasing => f.write_str("the slot is still being erased"),
            Self::Gap { expected } => write!(f, "bytes are missing from {expected} on"),
            Self::Beyond { length } => write!(f, "beyond the end of the blob at {length}"),
            Self::Conflict { offset } => write!(f, "byte {offset} was another one before"),
            Self::NotBlank { offset } => write!(f, "flash at {offset} is not blank: begin again"),
            Self::Readback { offset } => write!(f, "flash at {offset} reads wrong: begin again"),
            Self::Unusable { slot, block } => write!(
                f,
                "Slot unusable: block {block} of slot {slot} does not keep what is written to it"
            ),
            Self::Leased => f.write_str("the slot is still being read"),
            Self::Spoiled => f.write_str("the upload is spoiled: begin again"),
            Self::Incomplete { expected } => write!(f, "incomplete: go on at {expected}"),
            Self::Blob(error) => write!(f, "not a blob: {error}"),
            Self::OtherBlob => f.write_str("another blob than announced"),
            Self::NotChosen => f.write_str("no valid slot is chosen"),
            Self::Full => f.write_str("the slot has no room for another choice"),
            Self::Refused => f.write_str("the blob cannot be used on this target"),
            Self::Flash(kind) => write!(f, "flash: {kind}"),
            Self::LogicBug => f.write_str("a mistake in the firmware or its flash driver"),
        }
    }
}

impl core::error::Error for SlotError {}
