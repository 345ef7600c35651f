//! Why a request was refused.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::slot::Slot;
use crate::load_error::LoadError;
use crate::servo::Refused;
use crate::weights::WeightError;

/// Why a request was refused; nothing has changed. Variants may only be appended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The request cannot be read: it comes from another program, or contains something unknown to this firmware.
    Unknown,
    /// The session is not open, or no longer open: send hello.
    NoSession,
    /// A motion, an activation or an upload is in progress.
    Busy,
    /// The flash can only be written at standstill with drives off.
    NotStandstill,
    /// The blob is longer than a slot, or shorter than a header.
    TooLong {
        /// Capacity of a slot in bytes.
        held: u32,
    },
    /// No upload is in progress: send `Begin`.
    NoUpload,
    /// The slot is still being erased.
    Erasing,
    /// Bytes are missing: continue at `expected`.
    Missing {
        /// Offset of the first byte that has not arrived.
        expected: u32,
    },
    /// The bytes extend beyond the announced length.
    Beyond {
        /// Announced length of the blob in bytes.
        length: u32,
    },
    /// A byte differs from the one received earlier at the same offset.
    Conflict {
        /// Offset of that byte.
        offset: u32,
    },
    /// The flash does not contain what was written: begin again, which erases the slot.
    Spoiled,
    /// The received bytes are not the announced blob: begin again.
    OtherBlob,
    /// This firmware refuses the compensation.
    Load(LoadError),
    /// Machine has another name or other axes than that of the active compensation.
    OtherMachine,
    /// The servo refuses the compensation.
    Swap(Refused),
    /// The slot holds no valid compensation.
    NotValid,
    /// The weight is refused.
    Weight(WeightError),
    /// There is no active compensation.
    NoCompensation,
    /// The length of the rows does not match the axes of the active compensation.
    BadRows,
    /// More rows than fit into one answer.
    TooManyRows {
        /// Maximum number of rows.
        most: u16,
    },
    /// The positions are being commanded by another source.
    Occupied,
    /// The servo is not updated because the flash may become busy.
    Suspended,
    /// Not a finite number.
    NotFinite,
    /// The flash failed.
    Flash,
    /// Internal error of the firmware.
    LogicBug,
    /// An upload of another blob is in progress.
    Uploading {
        /// The upload is dropped after this many seconds without a request for it.
        wait: u32,
    },
    /// The slots were erased too often within one hour.
    Wear {
        /// Seconds until erasing is possible again.
        wait: u32,
    },
    /// The slot in use has no room for further records; an upload makes room.
    Full,
    /// A block of flash still fails after the whole slot was erased. Uploads are refused until the next
    /// start.
    Unusable {
        /// The slot.
        slot: Slot,
        /// Number of the block within the slot, from 0.
        block: u32,
    },
    /// The board has no boot nonce, so sessions before and after a restart could not be told apart. No session is
    /// opened.
    NoNonce,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => f.write_str("the controller does not know this request"),
            Self::NoSession => f.write_str("the controller does not know this session"),
            Self::Busy => f.write_str("the controller is busy with the request before it"),
            Self::NotStandstill => {
                f.write_str("the flash is written only at standstill with drives off")
            }
            Self::TooLong { held } => write!(f, "a slot holds 16 to {held} bytes"),
            Self::NoUpload => f.write_str("no upload is under way"),
            Self::Erasing => f.write_str("the slot is still being erased"),
            Self::Missing { expected } => write!(f, "bytes are missing from {expected} on"),
            Self::Beyond { length } => write!(f, "beyond the end of the blob at {length}"),
            Self::Conflict { offset } => write!(f, "byte {offset} was another one before"),
            Self::Spoiled => f.write_str("the flash does not hold what was written"),
            Self::OtherBlob => f.write_str("what has arrived is not what was announced"),
            Self::Load(error) => write!(f, "the controller cannot use it: {error}"),
            Self::OtherMachine => f.write_str("it is for another machine than the active one"),
            Self::Swap(refused) => write!(f, "the servo refuses it: {refused}"),
            Self::NotValid => f.write_str("the slot holds no valid compensation"),
            Self::Weight(error) => error.fmt(f),
            Self::NoCompensation => f.write_str("there is no active compensation"),
            Self::BadRows => f.write_str("the rows do not fit the axes"),
            Self::TooManyRows { most } => write!(f, "at most {most} rows at once"),
            Self::Occupied => f.write_str("the positions are commanded by something else"),
            Self::Suspended => f.write_str("the servo is paused for an upload"),
            Self::NotFinite => f.write_str("not a finite number"),
            Self::Flash => f.write_str("the flash does not work"),
            Self::LogicBug => f.write_str("a mistake in the firmware"),
            Self::Uploading { wait } => write!(
                f,
                "another upload is under way; if it has died, it is given up in {wait} s"
            ),
            Self::Wear { wait } => write!(
                f,
                "the flash has been erased too often within an hour; the next time in {wait} s"
            ),
            Self::Full => f.write_str("the slot in use has no room to store anything more"),
            Self::Unusable { slot, block } => write!(
                f,
                "Slot unusable: block {block} of slot {slot} does not keep what is written to it"
            ),
            Self::NoNonce => {
                f.write_str("the controller has no boot nonce, so it opens no session")
            }
        }
    }
}

impl core::error::Error for Refusal {}

impl From<LoadError> for Refusal {
    fn from(error: LoadError) -> Self {
        Self::Load(error)
    }
}

impl From<WeightError> for Refusal {
    fn from(error: WeightError) -> Self {
        Self::Weight(error)
    }
}

impl From<Refused> for Refusal {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Busy => Self::Busy,
            other => Self::Swap(other),
        }
    }
}
