//! Blocks that fail. After the first failure the next upload erases the whole slot, which repairs words that only read
//! blank. A block that fails again is reported, and the slot accepts no upload before the next start.

use super::{Slot, SlotError, Slots, TableFlash};

/// Health of the flash of a slot since the start or its last commit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Health {
    /// Nothing has failed.
    #[default]
    Sound,
    /// This block has failed: the next upload erases the whole slot.
    Suspect { block: u32 },
    /// This block has failed again after that.
    Unusable { block: u32 },
}

impl<F: TableFlash> Slots<F> {
    pub(super) fn health(&self, slot: Slot) -> Health {
        self.health[slot.index()]
    }

    /// The block with the byte at `offset` has failed. Nothing is written to a slot between a failure and the erase of
    /// the whole slot, so a second failure of the same block has survived an erase.
    pub(super) fn failed(&mut self, slot: Slot, offset: u32, error: SlotError) -> SlotError {
        let block = offset / F::ERASE_SIZE as u32;
        let health = &mut self.health[slot.index()];
        *health = match *health {
            Health::Suspect { block: before } if before == block => Health::Unusable { block },
            Health::Sound | Health::Suspect { .. } => Health::Suspect { block },
            Health::Unusable { block } => Health::Unusable { block },
        };
        match *health {
            Health::Unusable { block } => SlotError::Unusable { slot, block },
            _ => error,
        }
    }
}
