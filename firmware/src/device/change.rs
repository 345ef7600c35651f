//! Activation of another compensation: loaded beside the one in use, then swapped in.

use trueaxis::link::{Activation, Refusal, Slot};
use trueaxis::{Refused, Room};

use super::under_way::{Change, Stage};
use super::upload::same_machine;
use super::{Device, Machine, ServoAccess};
use crate::double_buffer::NotLoaded;
use crate::slots::TableFlash;

impl From<NotLoaded> for Refusal {
    fn from(error: NotLoaded) -> Self {
        match error {
            NotLoaded::Busy => Self::Busy,
            NotLoaded::Refused(error) => Self::Load(error),
        }
    }
}

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Switches to a slot, or reports the progress of that.
    pub(super) fn activate(&mut self, slot: Slot, force: bool) -> Result<Activation, Refusal> {
        match self.change {
            Change::Fading(to) | Change::Ramping(to) if to == slot => {
                return Ok(self.activation());
            }
            Change::Fading(_) | Change::Ramping(_) => return Err(Refusal::Busy),
            Change::None => {}
        }
        if self.slots.active() == Some(slot) {
            return Ok(self.activation());
        }
        if self.servo.with(|side| side.is_suspended()) {
            return Err(Refusal::Suspended);
        }
        if matches!(self.stage, Stage::Ramping { .. }) {
            // An upload is waiting for zero corrections in order to erase the inactive slot, which is this one.
            return Err(Refusal::Busy);
        }
        self.end_ramp();
        let choice = self.choosing(slot);
        // Also not valid while an upload into it is in progress.
        self.vacate()?;
        let lease = self.slots.lease(slot).ok_or(Refusal::NotValid)?;
        let loaded = self.loader.load(lease)?;
        let same = same_machine(loaded.active(), loaded.compensation());
        if !force && !same {
            return Err(Refusal::OtherMachine);
        }
        let choice = choice.on(same);
        if !self.slots.choosing_stalls(slot) {
            // Before the servo reads this slot, which may be in a bank of its own.
            self.wish = self.slots.choose(choice).into();
        }
        let swapped = self.servo.with(|side| {
            if side.counters().updates == 0 {
                // There is no state yet that a new servo would lose.
                side.replace(loaded)
            } else {
                side.swap(loaded)
            }
        });
        match swapped {
            Ok(()) => self.change = Change::Fading(slot),
            Err(Refused::Busy) => {
                self.still_in_use();
                return Err(Refusal::Busy);
            }
            Err(Refused::Axes | Refused::Auxiliaries) => {
                self.servo.with(|side| side.keep_at_zero(true));
                self.change = Change::Ramping(slot);
            }
        }
        self.chosen = choice;
        self.poll_change();
        Ok(self.activation())
    }

    /// The compensation in use stays in use.
    fn still_in_use(&mut self) {
        if let Some(active) = self.slots.active() {
            self.wish(self.choosing(active));
        }
    }

    pub(super) fn poll_change(&mut self) {
        match self.change {
            Change::None => {}
            Change::Fading(slot) => {
                if !self.servo.with(|side| side.servo().is_swapping()) {
                    self.arrived(slot);
                }
            }
            Change::Ramping(slot) => {
                if self.servo.with(|side| side.is_at_zero()) {
                    let replaced = self.replace(slot).is_ok();
                    self.servo.with(|side| side.keep_at_zero(false));
                    if replaced {
                        self.arrived(slot);
                    } else {
                        self.change = Change::None;
                        self.still_in_use();
                    }
                }
            }
        }
    }

    fn arrived(&mut self, slot: Slot) {
        self.change = Change::None;
        self.fault = None;
        self.slots.set_active(Some(slot));
        // The slot previously in use may be overwritten from now on.
        let _ = self.vacate();
        self.wish(self.chosen);
    }
}
