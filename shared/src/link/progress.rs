//! Progress of uploads and activations.

use serde::{Deserialize, Serialize};

use super::slot::Slot;

/// Progress of an upload.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Upload {
    /// There is no upload.
    #[default]
    None,
    /// The corrections ramp to zero, because the flash cannot be erased while the servo runs.
    Ramping,
    /// Blocks are being erased.
    Erasing {
        /// Blocks that are erased or need no erase.
        done: u32,
        /// Number of blocks in the slot.
        blocks: u32,
    },
    /// Waiting for bytes.
    Receiving {
        /// Offset of the next byte.
        next: u32,
        /// Total length in bytes.
        length: u32,
    },
    /// The machine has left standstill. To continue, send `Begin` again at standstill.
    Paused {
        /// Offset of the next byte.
        next: u32,
        /// Total length in bytes.
        length: u32,
    },
    /// The upload is complete and checked, and is the newest compensation.
    Committed {
        /// Slot that holds it.
        slot: Slot,
        /// Sequence number: the highest is the newest.
        sequence: u32,
    },
}

/// Progress of an activation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Activation {
    /// None is in progress; holds the active slot, if any.
    Active(Option<Slot>),
    /// The slot is being faded in, or waits until all other transitions have ended. Advances as the servo is updated.
    Fading(Slot),
    /// The slot has other axes or auxiliaries, so the corrections ramp to zero first.
    Ramping(Slot),
}
