//! Interfaces that a board provides.

use trueaxis::Correction;
use trueaxis::link::{CostUnit, Restart};

/// Whether the motion side requests corrections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Enabling {
    /// Not stated; the host decides.
    #[default]
    Host,
    /// Corrections on, unless the host has disabled them.
    On,
    /// Corrections off, whatever the host requests.
    Off,
}

/// The motion side's command for one servo period; `A` is `[f32; AXES]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<A> {
    /// Uncorrected positions in machine coordinates, mm or degrees, in the order of the axes.
    pub axes: A,
    /// Bit 0 is the first axis; set while the axis is referenced and not homing.
    pub referenced: u16,
    /// Whether corrections are requested.
    pub enabling: Enabling,
    /// Tool length, mm; overrides that of the host while it is given.
    pub tool_length: Option<f32>,
}

impl<A> Command<A> {
    /// Positions and referenced axes; everything else is left to the host.
    pub const fn new(axes: A, referenced: u16) -> Self {
        Self {
            axes,
            referenced,
            enabling: Enabling::Host,
            tool_length: None,
        }
    }
}

/// Regularity of commands: counts since start, which wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Regularity {
    /// Periods with a new command.
    pub frames: u32,
    /// Periods without a new command, after the first command of the source.
    pub repeated: u32,
    /// Commands without a period of their own.
    pub skipped: u32,
    /// Invalid frames.
    pub damaged: u32,
    /// How often these irregularities exceeded the tolerance.
    pub faults: u32,
    /// Whether the tolerance is exceeded now.
    pub fault: bool,
}

impl Regularity {
    /// Nothing has been received yet.
    pub const NONE: Self = Self {
        frames: 0,
        repeated: 0,
        skipped: 0,
        damaged: 0,
        faults: 0,
        fault: false,
    };
}

/// Source of commands in the servo interrupt: SPI, shared memory, a fieldbus.
pub trait PositionSource<A> {
    /// The command of this period; `None` if none has arrived.
    fn take(&mut self) -> Option<Command<A>>;

    /// Counts of the regularity of commands.
    fn regularity(&self) -> Regularity {
        Regularity::NONE
    }
}

/// Destination of corrections in the servo interrupt.
pub trait CorrectionSink<A> {
    /// Receives the correction of this period, to be added to its command. `healthy`: there is no fault, see
    /// [`is_healthy`](super::ServoSide::is_healthy).
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

/// A counter that measures the cost of an update. It may wrap.
pub trait Clock {
    /// Unit of the counter.
    const UNIT: CostUnit;

    /// Current count, increasing.
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
    /// Whether all axes stand still with their drives off, and are expected to stay so.
    fn standstill(&self) -> bool;
}

/// Identity of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Identity {
    /// Name and version of the firmware.
    pub firmware: &'static str,
    /// Name of the board.
    pub board: &'static str,
    /// Nominal servo period, s.
    pub period: f32,
    /// Why the controller started.
    pub restart: Restart,
}
