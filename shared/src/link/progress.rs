//! How far uploads and changes of compensation have come.

use serde::{Deserialize, Serialize};

use super::slot::Slot;

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
