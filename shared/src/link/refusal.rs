//! Why a request was not carried out.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::load_error::LoadError;
use crate::servo::Refused;
use crate::weights::WeightError;

/// Why a request was not carried out; nothing has changed. The variants may only be appended to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The request cannot be read: of another program, or with something this firmware does not
    /// know.
    Unknown,
    /// The session is not (or no longer) open: say hello.
    NoSession,
    /// A motion, a change of compensation, or an upload is under way.
    Busy,
    /// The flash can only be written at standstill with drives off.
    NotStandstill,
    /// The blob is longer than a slot.
    TooLong {
        /// Bytes that a slot holds.
        held: u32,
    },
    /// There is no upload: begin one.
    NoUpload,
    /// Bytes are missing, or others have been written there.
    WrongOffset {
        /// Place of the next byte that is wanted.
        expected: u32,
    },
    /// What was written is not what was announced: begin anew.
    BadChecksum,
    /// This firmware does not take the compensation.
    Load(LoadError),
    /// Its machine has another name or other axes than the active one.
    OtherMachine,
    /// The servo does not take it.
    Swap(Refused),
    /// The slot holds no valid compensation.
    NotValid,
    /// The weight is not taken.
    Weight(WeightError),
    /// There is no active compensation.
    NoCompensation,
    /// The length of the rows does not fit the axes of the active compensation.
    BadRows,
    /// More rows than one answer holds.
    TooManyRows {
        /// So many are possible.
        most: u16,
    },
    /// Something else commands the positions.
    Occupied,
    /// The servo is not updated while the flash may become busy.
    Suspended,
    /// Not a finite number.
    NotFinite,
    /// The flash does not work.
    Flash,
    /// A mistake in the firmware.
    LogicBug,
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
            Self::TooLong { held } => write!(f, "a slot holds {held} bytes"),
            Self::NoUpload => f.write_str("no upload is under way"),
            Self::WrongOffset { expected } => write!(f, "byte {expected} is to come next"),
            Self::BadChecksum => f.write_str("what was written has a wrong checksum"),
            Self::Load(error) => write!(f, "the controller cannot use it: {error}"),
            Self::OtherMachine => f.write_str("it is for another machine than the active one"),
            Self::Swap(refused) => write!(f, "the servo refuses it: {refused}"),
            Self::NotValid => f.write_str("the slot holds no valid compensation"),
            Self::Weight(error) => error.fmt(f),
            Self::NoCompensation => f.write_str("there is no active compensation"),
            Self::BadRows => f.write_str("the rows do not fit the axes"),
            Self::TooManyRows { most } => write!(f, "at most {most} rows at once"),
            Self::Occupied => f.write_str("the positions are commanded by something else"),
            Self::Suspended => f.write_str("the servo stands still for an upload"),
            Self::NotFinite => f.write_str("not a finite number"),
            Self::Flash => f.write_str("the flash does not work"),
            Self::LogicBug => f.write_str("a mistake in the firmware"),
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
