//! Operations in progress between steps: an upload, a change, something to be stored.

use trueaxis::link::{Refusal, Slot, Upload};

use crate::slots::{Choice, SlotError};

/// State of the upload beyond what the slots know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// No upload.
    None,
    /// The corrections ramp to zero first.
    Ramping { length: u32, crc: u32 },
    /// The upload has begun in the slots. The servo is suspended if the flash stalls it.
    Open,
    /// The machine has left standstill.
    Paused,
    /// An erase has failed. The next request gets this error as its answer.
    Failed(Refusal),
    /// Done.
    Committed(Upload),
}

/// A change in progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    None,
    /// The servo has received it and is fading over.
    Fading(Slot),
    /// It has other axes or auxiliaries, so it waits until the corrections are zero.
    Ramping(Slot),
}

/// Something to be stored that is not stored yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wish {
    /// Nothing.
    None,
    /// To be stored as soon as the flash can be written.
    Pending(Choice),
    /// To be stored; the corrections ramp to zero for that.
    Ramping(Choice),
    /// It could not be stored.
    Failed(Refusal),
}

/// Result of storing.
impl From<Result<(), SlotError>> for Wish {
    fn from(stored: Result<(), SlotError>) -> Self {
        stored.map_or_else(|error| Self::Failed(error.into()), |()| Self::None)
    }
}
