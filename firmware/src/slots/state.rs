//! What a slot holds.

use trueaxis::LoadError;

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SlotState {
    /// Every byte is erased.
    Blank,
    /// It is being erased for an upload, or that was interrupted.
    Erasing,
    /// An upload has begun and has not been committed.
    Uploading {
        /// Bytes that have arrived; 0 if the upload was interrupted by a restart.
        received: u32,
        /// Bytes of the whole blob.
        length: u32,
        /// CRC-32 in the header of the blob.
        crc: u32,
    },
    /// A complete blob that was committed.
    Valid {
        /// Counts the commits, with wrap; the newer slot has the larger one.
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
    /// Whether the slot holds a complete blob that was committed.
    #[must_use]
    pub const fn is_valid(self) -> bool {
        matches!(self, Self::Valid { .. })
    }
}

/// Why a slot is not valid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Damage {
    /// It is not empty and its record does not hold.
    Record,
    /// Its record is of a version that this firmware does not know.
    UnknownLayout {
        /// Version of the layout.
        found: u16,
    },
    /// The last word was not written completely, or has changed.
    Commit,
    /// The blob has changed.
    Blob(LoadError),
    /// The blob is not the one that the record announces.
    OtherBlob,
}
