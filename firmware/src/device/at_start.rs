//! Settings for the next start, stored as soon as the flash can be written.

use trueaxis::Room;
use trueaxis::link::{AtStart, Refusal, Slot, Storing};

use super::under_way::{Change, Stage, Wish};
use super::{Device, Machine, ServoAccess};
use crate::slots::{Choice, TableFlash};

/// How long the machine must stand still before corrections are ramped to zero for the flash, s.
const QUIET: u32 = 2;

impl Choice {
    /// This choice if the machine is unchanged; on another machine corrections are not enabled automatically.
    pub(super) fn on(self, same_machine: bool) -> Self {
        Self {
            enable: self.enable && same_machine,
            ..self
        }
    }
}

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Settings for the next start.
    #[must_use]
    pub fn at_start(&self) -> AtStart {
        AtStart {
            in_use: self.slots.in_use(),
            before: self.slots.before(),
            waiting: self.slots.waiting(),
            enable: self.slots.choice().enable,
            storing: match self.wish {
                Wish::None => Storing::Stored,
                Wish::Pending(_) | Wish::Ramping(_) => Storing::Pending,
                Wish::Failed(refusal) => Storing::Failed(refusal),
            },
        }
    }

    /// Enables or disables corrections at start.
    pub(super) fn enable_at_start(&mut self, enable: bool) -> Result<AtStart, Refusal> {
        if self.change != Change::None || matches!(self.stage, Stage::Ramping { .. } | Stage::Open)
        {
            return Err(Refusal::Busy);
        }
        let base = match (self.wish, self.slots.in_use(), self.slots.active()) {
            (Wish::Pending(choice) | Wish::Ramping(choice), ..) => choice,
            (_, Some(_), _) => self.slots.choice(),
            // The slot in actual use replaces the chosen one.
            (_, None, Some(active)) => self.slots.choosing(active),
            (_, None, None) => return Err(Refusal::NoCompensation),
        };
        let choice = Choice { enable, ..base };
        let slot = self.slots.slot_of(choice.in_use).ok_or(Refusal::NotValid)?;
        if choice != self.slots.choice() {
            if self.slots.places_left(slot) < 2 {
                return Err(Refusal::Full);
            }
            if self.slots.choosing_stalls(slot) && !self.machine.standstill() {
                return Err(Refusal::NotStandstill);
            }
        }
        self.wish(choice);
        // A host is waiting for it.
        self.moved = self.moved.wrapping_sub(QUIET + 1);
        self.poll_wish();
        Ok(self.at_start())
    }

    /// Sets what is to be stored, replacing any earlier request.
    pub(super) fn wish(&mut self, choice: Choice) {
        self.end_ramp();
        self.moved = self.now();
        self.wish = if choice == self.slots.choice() {
            Wish::None
        } else {
            Wish::Pending(choice)
        };
        self.poll_wish();
    }

    /// Ramps the corrections in again after a ramp to zero for the flash, complete or not.
    pub(super) fn end_ramp(&mut self) {
        if let Wish::Ramping(choice) = self.wish {
            self.wish = Wish::Pending(choice);
            self.moved = self.now();
            self.servo.with(|side| side.keep_at_zero(false));
        }
    }

    /// Stores the pending settings if the flash can be written now, and otherwise prepares for it.
    pub(super) fn poll_wish(&mut self) {
        let (Wish::Pending(choice) | Wish::Ramping(choice)) = self.wish else {
            return;
        };
        if self.change != Change::None || matches!(self.stage, Stage::Ramping { .. } | Stage::Open)
        {
            return;
        }
        let slot = self.slots.slot_of(choice.in_use);
        if !slot.is_some_and(|slot| self.slots.choosing_stalls(slot)) {
            self.store(choice);
            return;
        }
        if !self.machine.standstill() {
            self.end_ramp();
            self.moved = self.now();
            return;
        }
        if self.wish == Wish::Pending(choice) {
            let (now, at_zero) = self.servo.with(|side| (side.seconds(), side.is_at_zero()));
            if !at_zero && now.wrapping_sub(self.moved) <= QUIET {
                return;
            }
            self.wish = Wish::Ramping(choice);
            self.servo.with(|side| side.keep_at_zero(true));
        }
        let at_zero = self.servo.with(|side| {
            let at_zero = side.is_at_zero();
            side.suspend(at_zero);
            at_zero
        });
        if at_zero {
            self.slots.set_standstill(true);
            self.store(choice);
            self.release();
        }
    }

    /// Stores a choice now.
    pub(super) fn store(&mut self, choice: Choice) {
        self.wish = self.slots.choose(choice).into();
    }

    /// The choice that puts a slot into use.
    pub(super) fn choosing(&self, slot: Slot) -> Choice {
        let choice = self.slots.choosing(slot);
        // Includes a requested change that could not be stored yet.
        let enable = match self.wish {
            Wish::Pending(wanted) | Wish::Ramping(wanted) => wanted.enable,
            Wish::None | Wish::Failed(_) => choice.enable,
        };
        Choice { enable, ..choice }
    }
}
