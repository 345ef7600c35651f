//! The controller around the servo: slots, buffers, settings, and what a host asks of them.
//!
//! Two sides. [`ServoSide`] belongs to the servo interrupt, one [`tick`](ServoSide::tick) per
//! period. [`Device`] belongs to the main loop, which calls
//! [`Link::poll`](crate::link::Link::poll) with it. It reaches the servo side through a
//! [`ServoAccess`], which masks the interrupt for as long as a few settings or one pointer take to
//! be exchanged; loading, checking, erasing and evaluating run outside of it.

mod answer;
mod at_start;
mod board;
mod budget;
mod change;
mod report;
mod servo_side;
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
pub use servo_side::{Counters, FAULTS, ServoAccess, ServoSide, Snapshot};
pub use upload::GIVEN_UP;

/// The side of the main loop.
pub struct Device<F, S, M, C: Room> {
    slots: Slots<F>,
    loader: Loader<C>,
    servo: S,
    machine: M,
    identity: Identity,
    fault: Option<Fault>,
    stage: Stage,
    change: Change,
    /// What is to be stored when the change has come to its end.
    chosen: Choice,
    /// What is to be stored for the next start.
    wish: Wish,
    budget: Budget,
    /// When the machine was last not at standstill while something was to be stored, s since start.
    moved: u32,
    /// When somebody last asked for the upload, s since start.
    heard: u32,
    /// Rows of the motion whose answer is due.
    motion: Option<usize>,
}

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Starts: the slot that is to be in use becomes active, or the one before it if this firmware
    /// cannot use that; with none the corrections are zero, and [`fault`](Self::fault) says why. The
    /// corrections are let in if that is stored and there is no fault.
    ///
    /// `loader` and the [`BufferedServo`](crate::double_buffer::BufferedServo) behind `servo` come from the same
    /// [`DoubleBuffer`](crate::double_buffer::DoubleBuffer), and the corrections are still zero.
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
                // That of the first counts: it is the one that should be active.
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
            // The power went while it was stored.
            device.wish = Wish::Pending(choice);
        }
        device
    }

    /// Loads a slot and gives it to the servo at once; at start only.
    fn take(&mut self, slot: Slot) -> Result<(), Fault> {
        self.replace(slot).map_err(|error| match error {
            Refusal::Load(error) => Fault::Load(slot, error),
            _ => Fault::NoCompensation,
        })?;
        self.slots.set_active(Some(slot));
        Ok(())
    }

    /// Loads a slot and gives it to the servo at once, while all corrections are zero.
    fn replace(&mut self, slot: Slot) -> Result<(), Refusal> {
        self.vacate()?;
        let lease = self.slots.lease(slot).ok_or(Refusal::NotValid)?;
        let loaded = self.loader.load(lease)?;
        Ok(self.servo.with(|side| side.replace(loaded))?)
    }

    /// Empties the buffer that the servo does not read, so that its slot can be written.
    fn vacate(&mut self) -> Result<(), NotLoaded> {
        if let Some(lease) = self.loader.vacate()? {
            self.slots.take_back(lease);
        }
        Ok(())
    }

    /// One step of what takes time: an erase of at most one block, the end of a ramp or fade.
    /// [`Link::poll`](crate::link::Link::poll) does it, from the main loop.
    pub fn step(&mut self) {
        self.poll_upload();
        self.poll_change();
        self.poll_wish();
    }

    /// Why the corrections are zero, or not those of the slot that is to be in use.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Active slot, or how far a change has come.
    #[must_use]
    pub fn activation(&self) -> Activation {
        match self.change {
            Change::None => Activation::Active(self.slots.active()),
            Change::Fading(slot) => Activation::Fading(slot),
            Change::Ramping(slot) => Activation::Ramping(slot),
        }
    }

    /// How far the upload has come.
    #[must_use]
    pub fn upload(&self) -> Upload {
        self.upload_state()
    }

    /// The slots.
    #[must_use]
    pub fn slots(&self) -> &Slots<F> {
        &self.slots
    }

    /// The compensation that the servo uses; during a change the old one or the new one.
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

    /// Stops: gives back what it was started with, as it is.
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
