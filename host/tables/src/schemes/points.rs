//! The points of tables, as the runtime computes them.

use trueaxis::{Direction, DraftBank, Interpolation, SampleFormat};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Evenly spaced points of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Index of the input: the axes in order, the tool length, the temperatures.
    pub input: usize,
    /// The first point (mm, deg, K).
    pub start: f32,
    /// Spacing of the points (mm, deg, K).
    pub step: f32,
    /// True if they cover one turn, after which everything repeats.
    pub modulo: bool,
    /// The points in kinematic units (mm, rad, K).
    pub at: Vec<f64>,
}

impl Points {
    fn new(input: usize, [low, high]: [f64; 2], count: usize, modulo: bool, unit: f64) -> Self {
        let steps = if modulo { count } else { count - 1 };
        let start = low as f32;
        let step = ((high - low) / steps as f64) as f32;
        let point = |i: usize| (f64::from(start) + i as f64 * f64::from(step)) * unit;
        Self {
            input,
            start,
            step,
            modulo,
            at: (0..count).map(point).collect(),
        }
    }

    /// Over the travel of an axis: with both ends, or over a whole period of an axis that rotates without limits,
    /// where the first point follows the last.
    pub fn over(machine: &Machine, axis: usize, count: usize) -> Self {
        let it = &machine.axes[axis];
        Self::new(axis, it.travel, count, it.modulo, it.to_kinematic(1.0))
    }

    /// The indices of the first and the last point.
    pub fn ends(&self) -> [usize; 2] {
        [0, self.at.len() - 1]
    }

    /// A bank of tables with these points; each column holds the values of one.
    pub fn bank(&self, format: SampleFormat, columns: Vec<Vec<f64>>) -> DraftBank {
        let column = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect();
        DraftBank {
            input: self.input as u8,
            start: self.start,
            step: self.step,
            modulo: self.modulo,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format,
            columns: columns.into_iter().map(column).collect(),
        }
    }
}

/// A turn in degrees.
const TURN: f64 = 360.0;

/// The points of every input, `count` each.
///
/// For a rotary axis that turns all the way round and has no error motions that differ from turn to turn, they cover
/// one turn: everything else depends only on its sine and cosine.
pub fn points(kinematics: &Kinematics<'_>, count: usize) -> Vec<Points> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let axes = machine.axes.iter().enumerate().map(|(i, axis)| {
        let [low, high] = axis.travel;
        let varies = errors.motions[i].iter().any(|motion| motion.varies());
        let unit = axis.to_kinematic(1.0);
        if axis.modulo || (axis.letter.is_rotary() && high - low >= TURN && !varies) {
            return Points::new(i, [low, low + TURN], count, true, unit);
        }
        Points::new(i, axis.travel, count, false, unit)
    });
    let lengths = machine.length_range.into_iter();
    let kelvin = errors.sensors.iter().map(|sensor| sensor.range_kelvin);
    let others = lengths.chain(kelvin).enumerate();
    let others =
        others.map(|(k, range)| Points::new(machine.axes.len() + k, range, count, false, 1.0));
    axes.chain(others).collect()
}
