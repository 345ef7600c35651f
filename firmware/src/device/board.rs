//! What a board provides.

use trueaxis::link::CostUnit;
use trueaxis::{Correction, Room};

use super::servo_side::ServoSide;

/// Uncorrected commands of one servo period; `A` is `[f32; AXES]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<A> {
    /// Commanded positions in machine coordinates, mm or degrees, in the order of the axes.
    pub axes: A,
    /// Bit 0 for the first axis: set while it is referenced and not homing.
    pub referenced: u16,
}

/// Where commands come from, in the servo interrupt: SPI, shared memory, a fieldbus.
pub trait PositionSource<A> {
    /// The command of this period; `None` if none has come.
    fn take(&mut self) -> Option<Command<A>>;
}

/// Where corrections go, in the servo interrupt.
pub trait CorrectionSink<A> {
    /// Takes the correction of this period, to be added to its command.
    fn give(&mut self, correction: &Correction<A>);
}

/// For a board on which only the link commands positions.
#[derive(Clone, Copy, Debug, Default)]
pub struct LinkOnly;

impl<A> PositionSource<A> for LinkOnly {
    fn take(&mut self) -> Option<Command<A>> {
        None
    }
}

impl<A> CorrectionSink<A> for LinkOnly {
    fn give(&mut self, _: &Correction<A>) {}
}

/// A counter to see what an update costs. It may wrap.
pub trait Clock {
    /// What it counts.
    const UNIT: CostUnit;

    /// The count now, going up.
    fn now(&self) -> u32;
}

/// For a board without a counter.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    const UNIT: CostUnit = CostUnit::None;

    fn now(&self) -> u32 {
        0
    }
}

/// Access to the servo side from the main loop, with the servo interrupt masked.
pub trait ServoAccess<C: Room> {
    /// Calls `f` while no tick can run. What `f` does here is short: nothing in it depends on the
    /// size of a table.
    fn with<R>(&mut self, f: impl FnOnce(&mut ServoSide<C>) -> R) -> R;
}

/// The state of the machine around the controller.
pub trait Machine {
    /// Whether all axes stand still with their drives off, and stay so as far as is known.
    fn standstill(&self) -> bool;
}

/// What the controller says about itself.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Name and version of the firmware.
    pub firmware: &'static str,
    /// Name of the board.
    pub board: &'static str,
    /// Nominal servo period, s.
    pub period: f32,
}
