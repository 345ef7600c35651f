//! What a board provides.

use trueaxis::Correction;
use trueaxis::link::{CostUnit, Restart};

/// Whether the motion side wants corrections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Enabling {
    /// It leaves that to the host.
    #[default]
    Host,
    /// Yes, unless the host has taken them out.
    On,
    /// No, whatever the host wants.
    Off,
}

/// What the motion side commands for one servo period; `A` is `[f32; AXES]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<A> {
    /// Uncorrected positions in machine coordinates, mm or degrees, in the order of the axes.
    pub axes: A,
    /// Bit 0 for the first axis: set while it is referenced and not homing.
    pub referenced: u16,
    /// Whether corrections are wanted.
    pub enabling: Enabling,
    /// Tool length, mm: while it is given, that of the host does not count.
    pub tool_length: Option<f32>,
}

impl<A> Command<A> {
    /// Positions and referenced axes; all else is left to the host.
    pub const fn new(axes: A, referenced: u16) -> Self {
        Self {
            axes,
            referenced,
            enabling: Enabling::Host,
            tool_length: None,
        }
    }
}

/// How regularly commands have come: counts since start, with wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Regularity {
    /// Periods with a new command.
    pub frames: u32,
    /// Periods without one, of a source that has given commands before.
    pub repeated: u32,
    /// Commands that no period was there for.
    pub skipped: u32,
    /// Frames that were none.
    pub damaged: u32,
    /// How often all this was more than is tolerated.
    pub faults: u32,
    /// It is now.
    pub fault: bool,
}

impl Regularity {
    /// Nothing has come yet.
    pub const NONE: Self = Self {
        frames: 0,
        repeated: 0,
        skipped: 0,
        damaged: 0,
        faults: 0,
        fault: false,
    };
}

/// Where commands come from, in the servo interrupt: SPI, shared memory, a fieldbus.
pub trait PositionSource<A> {
    /// The command of this period; `None` if none has come.
    fn take(&mut self) -> Option<Command<A>>;

    /// How regularly they have come.
    fn regularity(&self) -> Regularity {
        Regularity::NONE
    }
}

/// Where corrections go, in the servo interrupt.
pub trait CorrectionSink<A> {
    /// Takes the correction of this period, to be added to its command. `healthy`: there is no
    /// fault, see [`is_healthy`](super::ServoSide::is_healthy).
    fn give(&mut self, correction: &Correction<A>, healthy: bool);
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
    fn give(&mut self, _: &Correction<A>, _: bool) {}
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
    /// Why it has started.
    pub restart: Restart,
}
