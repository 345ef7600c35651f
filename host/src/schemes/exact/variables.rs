//! What a correction depends on: axis positions, directions, tool length, temperatures.

use crate::errors::{ErrorModel, MAX_SENSORS, Motion};
use crate::machine::{MAX_AXES, Machine};

/// The most variables: axes, directions, tool length, temperatures.
pub const MAX_VARIABLES: usize = 2 * MAX_AXES + 1 + MAX_SENSORS;

/// A value for each variable (mm, rad, K, ±1), in the order of [`variables`].
pub type Place = [f64; MAX_VARIABLES];

/// What a variable stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Position of a linear axis whose motions are affine: the correction is affine in it.
    Affine(usize),
    /// Position of a linear axis with error motions that bend.
    Bending(usize),
    /// Position of a rotary axis.
    Rotary(usize),
    /// Tool length: the correction is affine in it.
    Length,
    /// Temperature of a sensor from its reference.
    Kelvin(usize),
    /// Direction of travel of an axis: +1, −1, 0 if unknown.
    Sign(usize),
}

/// One variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// What it stands for.
    pub kind: Kind,
    /// Its range (mm, rad, K; −1…1).
    pub range: [f64; 2],
    /// Where its functions may have a kink: points of tabulated motions, ends of the calibrated range.
    pub kinks: Vec<f64>,
    /// Where the tolerance is to hold: the calibrated part of the range.
    pub calibrated: [f64; 2],
    /// The ends of the calibrated range that lie inside the travel. The motion holds from where
    /// the *corrected* position passes an end, so near them, within the correction itself, the
    /// exact correction is no sum of products.
    pub ends: Vec<f64>,
    /// How many nodes see all of its functions.
    pub nodes: usize,
}

impl Variable {
    /// True for variables whose functions are found numerically, node by node.
    pub fn is_rich(&self) -> bool {
        matches!(self.kind, Kind::Bending(_) | Kind::Rotary(_))
    }

    /// True for variables that can be switched off: the correction is split into what is there
    /// without them and what each, and each pair, adds.
    pub fn is_switch(&self) -> bool {
        matches!(
            self.kind,
            Kind::Bending(_) | Kind::Kelvin(_) | Kind::Sign(_)
        )
    }

    /// The larger end of the range: the scale of the coordinate ξ = x / scale.
    pub fn scale(&self) -> f64 {
        self.range[0].abs().max(self.range[1].abs())
    }

    /// The node positions: Chebyshev points with both ends, which keep polynomials and
    /// trigonometric functions well apart.
    pub fn positions(&self, count: usize) -> Vec<f64> {
        positions(self.range, count)
    }
}

/// Chebyshev points of a range, with both ends.
pub fn positions([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let (mid, half) = (0.5 * (low + high), 0.5 * (high - low));
    (0..count)
        .map(|k| {
            let angle = std::f64::consts::PI * k as f64 / (count - 1) as f64;
            mid - half * angle.cos()
        })
        .collect()
}

/// The variables of a machine with its errors.
pub fn variables(machine: &Machine, errors: &ErrorModel) -> Vec<Variable> {
    let mut variables = Vec::new();
    let rotary = machine.axes.iter().filter(|a| a.letter.is_rotary()).count();
    for (index, axis) in machine.axes.iter().enumerate() {
        let range = axis.travel.map(|t| axis.to_kinematic(t));
        let moving = errors.motions[index].iter().any(|m| !m.is_zero());
        let bends = errors.bends(machine, index);
        let kind = match (axis.letter.is_rotary(), bends) {
            (true, _) => Kind::Rotary(index),
            (false, true) => Kind::Bending(index),
            (false, false) => Kind::Affine(index),
        };
        let [low, high] = range;
        let inside = |k: &f64| *k > low + 1e-9 && *k < high - 1e-9;
        let mut ends = Vec::new();
        let mut calibrated = range;
        if errors.motions[index].iter().any(Motion::holds) {
            let [from, to] = errors.calibrated[index];
            ends.extend([from, to].into_iter().filter(inside));
            if from < high && to > low {
                calibrated = [from.max(low), to.min(high)];
            }
        }
        let mut kinks = ends.clone();
        for motion in &errors.motions[index] {
            if let Some(table) = &motion.table {
                kinks.extend(table.at.iter().copied().filter(inside));
            }
        }
        kinks.sort_by(f64::total_cmp);
        kinks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        let nodes = match (&kind, moving) {
            // Trigonometric polynomials of degree 4 (second order of the errors) have 9 functions.
            (Kind::Rotary(_), false) => 13,
            // Motions multiply them: up to three or so motions times five functions.
            (Kind::Rotary(_), true) if rotary < 3 => 33,
            (Kind::Rotary(_), true) => 17,
            // Six motions and their levers.
            _ => 15,
        };
        variables.push(Variable {
            kind,
            range,
            calibrated,
            kinks,
            ends,
            nodes,
        });
    }
    let plain = |kind, range| Variable {
        kind,
        range,
        calibrated: range,
        kinks: Vec::new(),
        ends: Vec::new(),
        nodes: 2,
    };
    if let Some(range) = machine.length_range {
        variables.push(plain(Kind::Length, range));
    }
    for (sensor, thermal) in errors.sensors.iter().enumerate() {
        variables.push(plain(Kind::Kelvin(sensor), thermal.range_kelvin));
    }
    for index in 0..machine.axes.len() {
        if errors.reverses(index) {
            variables.push(plain(Kind::Sign(index), [-1.0, 1.0]));
        }
    }
    variables
}
