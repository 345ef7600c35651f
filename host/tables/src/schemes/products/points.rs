//! The points of the tables of each input, for schemes that use the same number for all.

use trueaxis_model::kinematics::Kinematics;

/// Points of an input, as the runtime computes them.
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

    /// The indices of the first and the last point.
    pub fn ends(&self) -> [usize; 2] {
        [0, self.at.len() - 1]
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
