//! The parts of a compensation as plain data.
//!
//! Positions are in mm (linear axes) or degrees (rotary axes), corrections likewise, times in seconds. All positions
//! are *uncorrected commands in machine coordinates*. Fields are declared in wire order (`docs/src/format.md`); enum
//! variants may only be appended.

use core::fmt;
use serde::{Deserialize, Serialize, Serializer};

/// Maximum number of auxiliary inputs of a compensation.
pub const AUXILIARIES: usize = 8;
/// Maximum number of adjustable terms of a compensation.
pub const ADJUSTABLE: usize = 16;
/// Maximum number of tables in the product of one term.
pub const FACTORS: usize = 6;
/// Maximum number of inputs of a grid.
pub const GRID_INPUTS: usize = 3;
/// Maximum number of output axes of a grid.
pub const GRID_OUTPUTS: usize = 6;

/// Name of an auxiliary input, at most 16 bytes of UTF-8.
pub type Name = heapless::String<16>;

/// What the rotary axes correct. Stored for information only; evaluation does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Policy {
    /// The tool's orientation: least squares over all six rows of the control Jacobian.
    #[default]
    Orientation,
    /// The tool's direction: rotation about the tool axis is ignored.
    Direction {
        /// The damping, [`Policy::LEAST_DAMPING`] to 1: cost of a radian of rotary correction relative to a radian of
        /// direction error.
        damping: f32,
    },
    /// Nothing: rotary axes are not corrected.
    Position,
}

impl Policy {
    /// The smallest permitted damping.
    pub const LEAST_DAMPING: f32 = 0.01;
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Orientation => f.write_str("orientation"),
            Self::Direction { damping } => write!(f, "direction, damping {damping}"),
            Self::Position => f.write_str("position"),
        }
    }
}

/// One axis of the machine: an input of tables and an output of terms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    /// Letter of the axis, an ASCII code.
    pub name: u8,
    /// Lowest and highest permitted position, mm or degrees; `-f32::MAX..f32::MAX` for an endless axis.
    pub travel: [f32; 2],
    /// Length of one turn of an endless axis, degrees: positions that differ by it are the same place, and the command
    /// may be reduced by whole turns at any time. 0 for other axes.
    pub period: f32,
    /// Largest magnitude of the correction, mm or degrees.
    pub value_bound: f32,
    /// Largest rate of change of the correction, mm/s or degrees/s.
    pub rate_bound: f32,
    /// Retreat from the extreme after which the axis counts as reversed, mm or degrees.
    pub reversal_threshold: f32,
    /// Rate of change of the correction in transitions (enable, cross-fade …), mm/s or degrees/s.
    pub ramp_rate: f32,
    /// Rate at which the step of a reversal (backlash) is made up, mm/s or degrees/s. Where it is larger than the rate
    /// bound, it holds instead of it until the step is made up.
    pub reversal_rate: f32,
    /// Acceleration with which the step of a reversal is made up, mm/s² or degrees/s².
    pub reversal_acceleration: f32,
}

/// Quantity that an auxiliary input measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AuxiliaryKind {
    /// Length of the tool in mm, along the tool axis from the spindle frame.
    ToolLength,
    /// Temperature of a sensor minus its reference, K.
    Temperature,
}

/// An input that is not an axis: it feeds tables and has no output.
///
/// Several may have the same name: one sensor with different lags.
#[derive(Clone, Debug, PartialEq)]
pub struct Auxiliary {
    /// The measured quantity.
    pub kind: AuxiliaryKind,
    /// Name of the sensor or of the quantity.
    pub name: Name,
    /// Tool length: the length for which the tables were made, mm. Temperature: the reference, °C. The caller subtracts
    /// the reference from temperatures; nothing subtracts it from lengths.
    pub reference: f32,
    /// How a servo follows a temperature; of other kinds it has no meaning and is not stored.
    pub sensor: Sensor,
}

impl Auxiliary {
    /// Whether both mean the same quantity: kind, name, reference and lag are equal.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.kind == other.kind
            && self.name == other.name
            && self.reference == other.reference
            && self.sensor.lag_rate == other.sensor.lag_rate
    }
}

/// How a servo follows the readings of a temperature sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sensor {
    /// 1/τ of the first-order [lag](crate::Lag) between this sensor and its effect, 1/s; 0 if there is none.
    pub lag_rate: f32,
    /// Largest rate at which readings are followed, K/s. A reading that is farther from the followed value than this
    /// rate covers in [`Sensor::JUMP`] seconds is a fault.
    pub rate: f32,
    /// Lowest and highest plausible temperature, °C. A reading outside is a fault.
    pub range: [f32; 2],
}

impl Sensor {
    /// The fastest permitted lag: a time constant of 1 s.
    pub const FASTEST_LAG: f32 = 1.0;
    /// The slowest permitted lag: a time constant of 10⁷ s.
    pub const SLOWEST_LAG: f32 = 1e-7;
    /// The slowest permitted rate, K/s.
    pub const SLOWEST: f32 = 0.01;
    /// The fastest permitted rate, K/s.
    pub const FASTEST: f32 = 10.0;
    /// Magnitudes of plausible temperatures are below this, °C.
    pub const HOTTEST: f32 = 1000.0;
    /// Time (s) over which a reading may be ahead of the followed value.
    pub const JUMP: f32 = 100.0;
    /// The usual sensor in a machine part, which takes minutes to warm up: no lag, 0.1 K/s, 5 to 120 °C. 5 °C is the
    /// lowest temperature of the air around a machine in IEC 60204-1; what is not connected often reads 0 °C. Windings
    /// and spindle bearings stay below 120 °C.
    pub const USUAL: Self = Self {
        lag_rate: 0.0,
        rate: 0.1,
        range: [5.0, 120.0],
    };
}

/// Auxiliaries as written: only temperatures have a sensor.
impl Serialize for Auxiliary {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.kind {
            AuxiliaryKind::ToolLength => {
                (self.kind, &self.name, self.reference).serialize(serializer)
            }
            AuxiliaryKind::Temperature => {
                (self.kind, &self.name, self.reference, self.sensor).serialize(serializer)
            }
        }
    }
}

/// How a table is interpolated between its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Interpolation {
    /// Piecewise linear.
    Linear,
    /// Uniform cubic B-splines: the second derivative is continuous, and the curve stays within the range of the
    /// samples, which are coefficients, not values at points.
    Cubic,
}

impl Interpolation {
    /// Number of samples needed for one interval, and thus the minimum length of a table.
    pub(crate) const fn reads(self) -> u32 {
        match self {
            Self::Linear => 2,
            Self::Cubic => 4,
        }
    }
}

/// Direction of travel for which the tables of a bank apply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Direction {
    /// Either direction.
    Both,
    /// While the input axis last moved positive; otherwise the tables are 0.
    Positive,
    /// While the input axis last moved negative; otherwise the tables are 0.
    Negative,
    /// As stored after positive travel, negated after negative travel, 0 while the direction is unknown: for effects
    /// that change sign with the direction, such as backlash.
    Signed,
}

/// How samples are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SampleFormat {
    /// Stored as f32.
    F32,
    /// Stored as integers, with one scale per table (banks) or per output (grids).
    I16,
}

/// Tables over the same points of the same input. Tables are numbered consecutively through the banks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bank {
    /// Index of the input: the axes in order, then the auxiliaries.
    pub input: u8,
    /// Position of the first point; for cubic tables, the start of the first interval.
    pub start: f32,
    /// Distance between points, positive.
    pub step: f32,
    /// Number of samples in each table: at least 2, or 4 for cubic tables.
    pub points: u32,
    /// The input wraps into the period `points · step`.
    pub modulo: bool,
    /// Direction of travel for which the tables apply.
    pub direction: Direction,
    /// How the tables are read between points.
    pub interpolation: Interpolation,
    /// How the samples are stored.
    pub format: SampleFormat,
    /// Number of tables.
    pub tables: u16,
    /// Index of the first sample within the section of its format; samples are stored point by point.
    pub first: u32,
}

impl Bank {
    /// End of the last interval. Beyond it, tables hold their end values or, with modulo, repeat.
    #[must_use]
    pub fn end(&self) -> f32 {
        let beyond = if self.modulo {
            0
        } else {
            self.interpolation.reads() - 1
        };
        self.start + self.points.saturating_sub(beyond) as f32 * self.step
    }
}

/// A weighted product of tables added to one output axis. Without factors it is a constant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// Index of the output axis.
    pub output: u8,
    /// Weight, in the unit of the output divided by the units of the tables.
    pub weight: f32,
    /// Lowest and highest weight that may be set at run time; `None` if the weight is fixed.
    pub limits: Option<[f32; 2]>,
    /// Indices of the multiplied tables, in the order of multiplication.
    pub factors: heapless::Vec<u8, FACTORS>,
}

/// One input of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GridAxis {
    /// Index of the input: the axes in order, then the auxiliaries.
    pub input: u8,
    /// Position of the first node.
    pub start: f32,
    /// Distance between nodes, positive.
    pub step: f32,
    /// Number of nodes, at least 2.
    pub points: u32,
    /// The input wraps into the period `points · step`.
    pub modulo: bool,
}

/// Corrections of several axes at the nodes of a rectangular grid, interpolated multilinearly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// One to three inputs; the first varies slowest in the node order.
    pub axes: heapless::Vec<GridAxis, GRID_INPUTS>,
    /// Indices of the output axes, interleaved at each node.
    pub outputs: heapless::Vec<u8, GRID_OUTPUTS>,
    /// How the samples are stored.
    pub format: SampleFormat,
    /// One scale per output when the format is [`SampleFormat::I16`], otherwise empty.
    pub scales: heapless::Vec<f32, GRID_OUTPUTS>,
    /// Index of the first sample within the section of its format.
    pub first: u32,
}

impl Grid {
    /// Number of nodes; saturates instead of overflowing.
    #[must_use]
    pub fn nodes(&self) -> u64 {
        self.axes
            .iter()
            .fold(1, |n: u64, axis| n.saturating_mul(u64::from(axis.points)))
    }
}
