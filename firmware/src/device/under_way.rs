//! What is under way from one step to the next: an upload, a change, something to be stored.

use trueaxis::link::{Refusal, Slot, Upload};

use crate::slots::{Choice, SlotError};

/// What is being uploaded, beyond what the slots know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stage {
    /// No upload.
    None,
    /// The corrections go to zero first.
    Ramping { length: u32, crc: u32 },
    /// The slots have begun. The servo is suspended where the flash stalls it.
    Open,
    /// The machine has left standstill.
    Paused,
    /// An erase has failed. The next request gets this answer.
    Failed(Refusal),
    /// Done.
    Committed(Upload),
}

/// A change that is under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    None,
    /// The servo has it and fades over.
    Fading(Slot),
    /// It has other axes or auxiliaries: it waits until the corrections are zero.
    Ramping(Slot),
}

/// What is to be stored and is not yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wish {
    /// Nothing.
    None,
    /// This, as soon as the flash can be written.
    Pending(Choice),
    /// This, and the corrections go to zero for it.
    Ramping(Choice),
    /// It could not be stored.
    Failed(Refusal),
}

/// How storing has ended.
impl From<Result<(), SlotError>> for Wish {
    fn from(stored: Result<(), SlotError>) -> Self {
        stored.map_or_else(|error| Self::Failed(error.into()), |()| Self::None)
    }
}
