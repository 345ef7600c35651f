//! The controller around the servo: slots, buffers, settings, and the execution of host requests.
//!
//! There are two sides. [`ServoSide`] belongs to the servo interrupt, with one [`tick`](ServoSide::tick) per period.
//! [`Device`] belongs to the main loop, which calls [`Link::poll`](crate::link::Link::poll) with it. It reaches the
//! servo side through a [`ServoAccess`], which masks the interrupt only while a few settings or one pointer are
//! exchanged; loading, checking, erasing and evaluating run outside of it.

mod answer;
mod at_start;
mod board;
mod budget;
mod change;
mod report;
mod servo_side;
mod snapshot;
#[cfg(test)]
pub(crate) mod tests;
mod under_way;
mod upload;

use trueaxis::Room;
use trueaxis::link::{Activation, Fault, Refusal, Slot, Upload};

use crate::double_buffer::{Loader, NotLoaded};
use crate::slots::{Choice, Slots, TableFlash, WhileBusy};
use budget::Budget;
use under_way::{Change, Stage, Wish};

pub use board::{
    Clock, Command, CorrectionSink, Enabling, Identity, LinkOnly, Machine, NoClock, PositionSource,
    Regularity,
};
pub use budget::ERASES_PER_HOUR;
pub use servo_side::{FAULTS, ServoAccess, ServoSide};
pub use snapshot::{Counters, Snapshot};
pub use upload::GIVEN_UP;

/// The main loop's side.
pub struct Device<F, S, M, C: Room> {
    slots: Slots<F>,
    loader: Loader<C>,
    servo: S,
    machine: M,
    identity: Identity,
    fault: Option<Fault>,
    stage: Stage,
    change: Change,
    /// What to store when the change is complete.
    chosen: Choice,
    /// What to store for the next start.
    wish: Wish,
    budget: Budget,
    /// Last time the machine was not at standstill while there was something to store, s since start.
    moved: u32,
    /// Last request for the upload, s since start.
    heard: u32,
    /// Number of rows in the motion that still awaits its answer.
    motion: Option<usize>,
}

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Starts. The slot selected for use becomes active, or the previous one if this firmware cannot use it. If there
    /// is neither, the corrections are zero, and [`fault`](Self::fault) returns the reason. Corrections are enabled if
    /// that is stored and there is no fault.
    ///
    /// `loader` and the [`BufferedServo`](crate::double_buffer::BufferedServo) behind `servo` must come from the same
    /// [`DoubleBuffer`](crate::double_buffer::DoubleBuffer), and the corrections must still be zero.
    #[must_use]
    pub fn start(
        slots: Slots<F>,
        loader: Loader<C>,
        servo: S,
        machine: M,
        identity: Identity,
    ) -> Self {
        let mut device = Self {
            slots,
            loader,
            servo,
            machine,
            identity,
            fault: None,
            stage: Stage::None,
            change: Change::None,
            chosen: Choice::default(),
            wish: Wish::None,
            budget: Budget::NEW,
            moved: 0,
            heard: 0,
            motion: None,
        };
        let choice = device.slots.choice();
        let candidates = [device.slots.in_use(), device.slots.before()];
        for slot in candidates.into_iter().flatten() {
            match device.take(slot) {
                Ok(()) => break,
                // Report the first fault, since that slot should be active.
                Err(fault) => device.fault = device.fault.or(Some(fault)),
            }
        }
        if choice.in_use.is_some() && device.slots.in_use().is_none() {
            device.fault = Some(Fault::Lost);
        } else if device.slots.active().is_none() && device.fault.is_none() {
            let waiting = device.slots.waiting().map(Fault::Waiting);
            device.fault = waiting.or(Some(Fault::NoCompensation));
        }
        if choice.enable && device.fault.is_none() {
            device.servo.with(|side| side.enable(true));
        }
        if device.slots.is_choice_halved() {
            // Power was lost while it was being stored.
            device.wish = Wish::Pending(choice);
        }
        device
    }

    /// Loads a slot and gives it to the servo immediately; at start only.
    fn take(&mut self, slot: Slot) -> Result<(), Fault> {
        self.replace(slot).map_err(|error| match error {
            Refusal::Load(error) => Fault::Load(slot, error),
            _ => Fault::NoCompensation,
        })?;
        self.slots.set_active(Some(slot));
        Ok(())
    }

    /// Loads a slot and gives it to the servo immediately, while all corrections are zero.
    fn replace(&mut self, slot: Slot) -> Result<(), Refusal> {
        self.vacate()?;
        let lease = self.slots.lease(slot).ok_or(Refusal::NotValid)?;
        let loaded = self.loader.load(lease)?;
        Ok(self.servo.with(|side| side.replace(loaded))?)
    }

    /// Empties the buffer not read by the servo, so that its slot can be written.
    fn vacate(&mut self) -> Result<(), NotLoaded> {
        if let Some(lease) = self.loader.vacate()? {
            self.slots.take_back(lease);
        }
        Ok(())
    }

    /// One step of a lengthy operation: an erase of at most one block, the end of a ramp or fade. Called by
    /// [`Link::poll`](crate::link::Link::poll) from the main loop.
    pub fn step(&mut self) {
        self.poll_upload();
        self.poll_change();
        self.poll_wish();
    }

    /// Why the corrections are zero, or do not come from the slot selected for use.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Active slot, or progress of an activation.
    #[must_use]
    pub fn activation(&self) -> Activation {
        match self.change {
            Change::None => Activation::Active(self.slots.active()),
            Change::Fading(slot) => Activation::Fading(slot),
            Change::Ramping(slot) => Activation::Ramping(slot),
        }
    }

    /// Progress of the upload.
    #[must_use]
    pub fn upload(&self) -> Upload {
        self.upload_state()
    }

    /// The slots.
    #[must_use]
    pub fn slots(&self) -> &Slots<F> {
        &self.slots
    }

    /// The compensation used by the servo; during a change, the old or the new one.
    #[must_use]
    pub fn compensation(&self) -> &trueaxis::Compensation<'_, C> {
        self.loader.current()
    }

    /// The servo side.
    pub fn servo(&mut self) -> &mut S {
        &mut self.servo
    }

    /// The state of the machine.
    pub fn machine(&mut self) -> &mut M {
        &mut self.machine
    }

    /// Stops and returns the parts it was started with, as they are.
    pub fn close(self) -> (Slots<F>, Loader<C>, S) {
        (self.slots, self.loader, self.servo)
    }

    /// Seconds since start.
    fn now(&mut self) -> u32 {
        self.servo.with(|side| side.seconds())
    }

    /// Whether the servo must not run while the flash is erased or written.
    fn stalls(&self) -> bool {
        self.slots.flash().while_busy() == WhileBusy::Standstill
    }
}
