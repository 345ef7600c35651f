//! What the controller answers.

use serde::{Deserialize, Serialize};

use super::refusal::Refusal;
use super::report::{Hello, Report, Slot};

/// An answer. The variants may only be appended to; anything else is a new
/// [`PROTOCOL`](super::PROTOCOL).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// A reply lives on the stack while it is encoded, and the controller has no heap to box it.
#[allow(clippy::large_enum_variant)]
pub enum Reply<'a> {
    /// Who is there.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// How things are.
    Status(Report),
    /// How far the upload has come.
    Upload(Upload),
    /// How far the change of compensation has come.
    Activation(Activation),
    /// It is done.
    Done,
    /// Corrections, one row of f32 for each row asked for.
    Corrections(&'a [u8]),
    /// Rows as [`MotionResult`](super::MotionResult) writes them, one for each row commanded.
    Motion(&'a [u8]),
    /// It is not done, and nothing has changed.
    Refused(Refusal),
}

/// How far an upload has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Upload {
    /// There is none.
    #[default]
    None,
    /// The corrections go to zero, since the flash cannot be erased while the servo runs.
    Ramping,
    /// Blocks are being erased.
    Erasing {
        /// Blocks that are done or need no erase.
        done: u32,
        /// Blocks of the slot.
        blocks: u32,
    },
    /// Waits for bytes.
    Receiving {
        /// Place of the next byte that is wanted.
        next: u32,
        /// Of so many.
        length: u32,
    },
    /// The machine has left standstill; begin again at standstill and it goes on.
    Paused {
        /// Place of the next byte that is wanted.
        next: u32,
        /// Of so many.
        length: u32,
    },
    /// It is complete, checked, and the newest compensation.
    Committed {
        /// Where it lies.
        slot: Slot,
        /// Its number: the highest is the newest.
        sequence: u32,
    },
}

/// How far a change of compensation has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Activation {
    /// None is under way; the active slot, if any.
    Active(Option<Slot>),
    /// It is faded in, or waits until nothing else moves: as the servo is updated.
    Fading(Slot),
    /// It has other axes or auxiliaries: the corrections go to zero first.
    Ramping(Slot),
}
