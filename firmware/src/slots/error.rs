//! Why an operation on the slots was refused or has failed.

use core::fmt;
use embedded_storage::nor_flash::NorFlashErrorKind;
use trueaxis::LoadError;
use trueaxis::link::Slot;

/// Why an operation on the slots was refused or has failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotError {
    /// The flash stalls the processor and the machine does not stand still: nothing was done.
    NotStandstill,
    /// The blob is shorter than a header or longer than a slot holds; nothing was done.
    Length {
        /// Bytes that a slot holds.
        capacity: u32,
    },
    /// No upload has begun, or it was aborted.
    NoUpload,
    /// The slot is still being erased.
    Erasing,
    /// Bytes before these are missing: go on at `expected`.
    Gap {
        /// Offset of the first byte that has not arrived.
        expected: u32,
    },
    /// A chunk reaches beyond the end of the blob.
    Beyond {
        /// Bytes of the blob, as announced.
        length: u32,
    },
    /// A byte that has arrived before differs now.
    Conflict {
        /// Its offset.
        offset: u32,
    },
    /// What an interrupted upload left is not what was to be written there: begin again, which
    /// erases.
    NotBlank {
        /// Offset of the first byte of the word.
        offset: u32,
    },
    /// The flash does not hold what was written to it: begin again, which erases.
    Readback {
        /// Offset of the first byte of the word.
        offset: u32,
    },
    /// A block has failed again after the whole slot was erased: the slot takes no upload before the
    /// next start.
    Unusable {
        /// The slot.
        slot: Slot,
        /// Number of the block within the slot, from 0.
        block: u32,
    },
    /// A compensation is still being read there: nothing was done.
    Leased,
    /// An error has spoiled the upload: begin again.
    Spoiled,
    /// Not all bytes have arrived: go on at `expected`.
    Incomplete {
        /// Offset of the first byte that has not arrived.
        expected: u32,
    },
    /// The blob has arrived but is not one: header, length or checksum.
    Blob(LoadError),
    /// The blob has arrived, but its header has another length or checksum than announced.
    OtherBlob,
    /// What is to be in use is in no valid slot.
    NotChosen,
    /// The slot has no room for another choice: an upload makes it.
    Full,
    /// The check of the caller did not accept the blob.
    Refused,
    /// The flash driver reports an error.
    Flash(NorFlashErrorKind),
    /// A mistake in this crate or in the flash driver.
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
