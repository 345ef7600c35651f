//! The two slots of flash that hold blobs.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::load_error::LoadError;

/// One of the two slots of flash that hold blobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Slot {
    /// The first slot.
    A,
    /// The second slot.
    B,
}

impl Slot {
    /// Both slots, A first.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// The other slot.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }

    /// Index in arrays: 0 for A, 1 for B.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::A => 0,
            Self::B => 1,
        }
    }
}

impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::A => "A",
            Self::B => "B",
        })
    }
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotState {
    /// Every byte is erased.
    Blank,
    /// It is being erased for an upload, or the erase was interrupted.
    Erasing,
    /// An upload has begun but has not been committed.
    Uploading {
        /// Number of bytes received; 0 if the upload was interrupted by a restart.
        received: u32,
        /// Bytes of the whole blob.
        length: u32,
        /// CRC-32 in the header of the blob.
        crc: u32,
    },
    /// A complete and committed blob.
    Valid {
        /// Commit counter, which wraps; the newer slot has the larger one.
        sequence: u32,
        /// Bytes of the blob.
        length: u32,
        /// CRC-32 in the header of the blob.
        crc: u32,
    },
    /// Something else.
    Damaged(Damage),
}

impl SlotState {
    /// Whether the slot holds a complete and committed blob.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        matches!(self, Self::Valid { .. })
    }
}

/// Why a slot is not valid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Damage {
    /// The slot is not empty, but its record is invalid.
    Record,
    /// Record has a version unknown to this firmware.
    UnknownLayout {
        /// Version of the layout.
        found: u16,
    },
    /// The last word was not written completely, or has changed.
    Commit,
    /// The blob has changed.
    Blob(LoadError),
    /// The blob is not the one announced in the record.
    OtherBlob,
    /// A word of the blob cannot be read: its error-correcting code reports an error.
    Unreadable,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Record => f.write_str("its record does not hold"),
            Self::UnknownLayout { found } => write!(f, "its layout has version {found}"),
            Self::Commit => f.write_str("it was not committed completely"),
            Self::Blob(error) => write!(f, "its blob has changed: {error}"),
            Self::OtherBlob => f.write_str("its blob is not the one announced"),
            Self::Unreadable => f.write_str("a word of its blob cannot be read"),
        }
    }
}

/// State of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SlotReport {
    /// Contents of the slot.
    pub state: SlotState,
    /// Number of times it has been erased.
    pub erased: u32,
}
