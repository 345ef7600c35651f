//! From a machine and its errors: the variables that the correction is a function of, and the tables of each whose
//! products give most of its functions.

use super::nodes::{self, Turning, lagrange};
use trueaxis_model::errors::{MAX_SENSORS, Motion};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::numbers::ascending;

/// The largest number of variables: axes, directions, tool length, temperatures.
pub(crate) const MAX_VARIABLES: usize = 2 * MAX_AXES + 1 + MAX_SENSORS;

/// A value for each variable (mm, rad, K, ±1), in the order of [`variables`].
pub type VariableValues = [f64; MAX_VARIABLES];

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
    /// Temperature of a sensor relative to its reference.
    Kelvin(usize),
    /// Direction of travel of an axis: +1, −1, 0 if unknown.
    Sign(usize),
}

/// One variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// What it represents.
    pub kind: Kind,
    /// Range (mm, rad, K; −1…1).
    pub range: [f64; 2],
    /// True if its range is one turn, after which everything repeats.
    pub wraps: bool,
    /// Where its functions may have a kink: points of tabulated motions, ends of the calibrated range.
    pub kinks: Vec<f64>,
    /// The calibrated part of the range, where the tolerance applies.
    pub calibrated: [f64; 2],
    /// The ends of the calibrated range that lie inside the travel. The motion holds its end value once the
    /// *corrected* position passes the end, so near them, within the correction itself, the reference correction is not
    /// a sum of products.
    pub ends: Vec<f64>,
    /// True if the axis has error motions that vary along it. They can be switched off; the remaining functions
    /// along a rotary axis are its sines and cosines, along a linear one its coordinate.
    pub moves: bool,
    /// Number of nodes that resolve all of its functions with its motions on.
    pub nodes: usize,
    /// Number of nodes that resolve all functions of a rotary axis with its motions off.
    pub turning: Turning,
    /// Further nodes of a rotary axis, at the peaks of the correction.
    pub peaks: Vec<f64>,
    /// If there are kinks: the ends of the pieces in which its functions are polynomials, in ascending order.
    pieces: Vec<f64>,
}

impl Variable {
    /// True for variables whose functions are found numerically, node by node.
    pub(crate) fn is_rich(&self) -> bool {
        matches!(self.kind, Kind::Bending(_) | Kind::Rotary(_))
    }

    /// Positions over the calibrated range that resolve all of its functions.
    pub fn many(&self) -> Vec<f64> {
        let [low, high] = self.calibrated;
        let count = self.nodes.max(self.turning.base);
        let mut all = self.with_peaks(nodes::chebyshev(self.calibrated, count));
        all.retain(|x| (low..=high).contains(x));
        all
    }

    /// True for variables that can be switched off: the correction is split into the part without them and the
    /// contributions of each and of each pair.
    pub(crate) fn is_switch(&self) -> bool {
        self.moves || matches!(self.kind, Kind::Kelvin(_) | Kind::Sign(_))
    }

    /// True if its functions may be merged into one table.
    pub(crate) fn merges(&self) -> bool {
        !matches!(self.kind, Kind::Sign(_))
    }

    /// Middle and half width of the range.
    fn middle(&self) -> [f64; 2] {
        let [low, high] = self.range;
        [0.5 * (low + high), 0.5 * (high - low)]
    }

    /// The position at which the coordinate ξ is 0, and the largest distance from it.
    ///
    /// Powers of ξ must be well separated, so along a bending motion with its range on one side of 0, ξ is measured
    /// from the middle of the range. Elsewhere no degree exceeds two, and a coordinate measured from 0 gives fewer
    /// terms.
    fn origin(&self) -> [f64; 2] {
        let [middle, half] = self.middle();
        if matches!(self.kind, Kind::Bending(_)) && middle.abs() > 0.5 * half {
            return [middle, half];
        }
        [0.0, self.range[0].abs().max(self.range[1].abs())]
    }

    /// The coordinate ξ of a position: −1…1.
    pub fn coordinate(&self, x: f64) -> f64 {
        let [zero, scale] = self.origin();
        (x - zero) / scale
    }

    /// The position of a coordinate ξ.
    pub(crate) fn at_coordinate(&self, xi: f64) -> f64 {
        let [zero, scale] = self.origin();
        zero + xi * scale
    }

    /// True for rotary axes with a range so narrow that 1, sine, cosine and their products are nearly dependent.
    fn is_narrow(&self) -> bool {
        self.middle()[1] < NARROW
    }

    /// The sine of a rotary position, the odd generator. On a narrow range it is measured from the middle, in units
    /// of its largest value.
    pub fn sine(&self, x: f64) -> f64 {
        if !self.is_narrow() {
            return libm::sin(x);
        }
        let [middle, half] = self.middle();
        libm::sin(x - middle) / libm::sin(half)
    }

    /// The cosine of a rotary position, the even generator. On a narrow range it is measured from the middle and
    /// stretched to cover −1…1 like the second Chebyshev polynomial.
    pub fn cosine(&self, x: f64) -> f64 {
        if !self.is_narrow() {
            return libm::cos(x);
        }
        let [middle, half] = self.middle();
        2.0 * (libm::sin(0.5 * (x - middle)) / libm::sin(0.5 * half)).powi(2) - 1.0
    }

    /// The positions from which the value at `x` is computed, with their weights: `x` itself, if there are no kinks,
    /// otherwise nodes of its piece. On a kink both of its sides count, because the effect of motions on the arguments of
    /// others steps there; at an end of the calibrated range only the inner one.
    pub fn sampled_for(&self, x: f64) -> Vec<(f64, f64)> {
        if self.pieces.is_empty() {
            return vec![(x, 1.0)];
        }
        let sides = self.sides(x);
        let share = 1.0 / sides.len() as f64;
        let of_side = |side: &f64| {
            let last = self.pieces.len() - 1;
            let next = self.pieces.partition_point(|end| end < side).clamp(1, last);
            let piece = [self.pieces[next - 1], self.pieces[next]];
            let nodes = nodes::chebyshev_inside(piece, PIECE_NODES);
            let weights = lagrange(&nodes, *side);
            let weighed = weights.into_iter().map(|(k, w)| (nodes[k], share * w));
            weighed.collect::<Vec<_>>()
        };
        sides.iter().flat_map(of_side).collect()
    }

    /// Both sides of the kink at `x`, or `x` itself. At an end of the calibrated range, a little inside of it.
    fn sides(&self, x: f64) -> Vec<f64> {
        let [low, high] = self.range;
        let near = KINK * (high - low);
        let next = self.kinks.partition_point(|k| *k < x - near);
        let Some(kink) = self.kinks.get(next).filter(|kink| **kink <= x + near) else {
            return vec![x];
        };
        let [before, after] = [kink - 2.0 * near, kink + 2.0 * near];
        match self.ends.contains(kink) {
            true if *kink == self.calibrated[0] => vec![after],
            true => vec![before],
            false => vec![before, after],
        }
    }

    /// True for a rotary axis whose motions are never off.
    pub(crate) fn is_uneven(&self) -> bool {
        self.turning == Turning::UNEVEN
    }

    /// The node positions with its motions on: Chebyshev points with both ends, which separate polynomials and
    /// trigonometric functions well, and those at peaks.
    pub fn positions(&self, count: usize) -> Vec<f64> {
        self.with_peaks(nodes::chebyshev(self.range, count))
    }

    /// Adds the nodes at peaks, in ascending order.
    fn with_peaks(&self, mut nodes: Vec<f64>) -> Vec<f64> {
        nodes.extend(&self.peaks);
        ascending(&mut nodes);
        nodes
    }

    /// The node positions of a rotary axis with its motions off, where everything repeats after one turn: evenly
    /// spaced over one turn, unless the range is smaller.
    pub(crate) fn turning_positions(&self, count: usize) -> Vec<f64> {
        self.with_peaks(nodes::over_a_turn(self.range, count))
    }
}

/// Rotary axes with less than this on either side of their middle (80°) count as narrow. Beyond, the nine products
/// of sine and cosine up to degree four have a condition number below 1e4.
const NARROW: f64 = 1.4;

/// A position is on a kink if it is closer than this fraction of the range: ten times the rounding of positions to
/// f32.
const KINK: f64 = 1e-6;

/// Nodes of a piece, and the largest width (rad) of one along a rotary axis: the polynomial through the nodes leaves 1e-9
/// of a cosine, 3e-6 of an eighth harmonic, and 3e-8 of a peak as wide as its damping.
const PIECE_NODES: usize = 12;
const PIECE: f64 = 0.5;

/// The ends of pieces without kinks and no wider than `widest`.
fn pieces([low, high]: [f64; 2], kinks: &[f64], widest: f64) -> Vec<f64> {
    let mut ends = vec![low];
    for next in kinks.iter().copied().chain([high]) {
        let last = ends[ends.len() - 1];
        let parts = ((next - last) / widest).ceil().max(1.0);
        let inner = (1..parts as usize).map(|k| last + (next - last) * k as f64 / parts);
        ends.extend(inner.chain([next]).filter(|end| *end > last));
    }
    ends
}

/// True if a grid of all rotary axes together is too large, so that their motions should be switched separately.
fn separates(kinematics: &Kinematics<'_>) -> bool {
    let rotary = kinematics.machine.axes.iter().enumerate();
    let uneven: Vec<usize> = rotary
        .filter(|(_, axis)| axis.letter.is_rotary())
        .map(|(index, _)| index)
        .collect();
    uneven.len() > 2
        || uneven.iter().any(|i| {
            let mut motions = kinematics.errors.motions[*i].iter();
            motions.any(|m| m.table.is_some() || !m.harmonics.is_empty())
        })
}

/// The variables of a machine with its errors; `relative` is the negligible fraction of a correction.
pub fn variables(kinematics: &Kinematics<'_>, relative: f64) -> Vec<Variable> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let separates = separates(kinematics);
    let axes = 0..machine.axes.len();
    let mut variables: Vec<Variable> = (axes.clone())
        .map(|index| of_axis(kinematics, index, separates, relative))
        .collect();
    let plain = |kind, range| Variable {
        kind,
        range,
        wraps: false,
        calibrated: range,
        kinks: Vec::new(),
        ends: Vec::new(),
        moves: false,
        nodes: 2,
        turning: Turning::NONE,
        peaks: Vec::new(),
        pieces: Vec::new(),
    };
    let lengths = machine.length_range.into_iter();
    variables.extend(lengths.map(|range| plain(Kind::Length, range)));
    let sensors = errors.sensors.iter().enumerate();
    variables.extend(sensors.map(|(i, sensor)| plain(Kind::Kelvin(i), sensor.range_kelvin)));
    let reversed = axes.filter(|index| errors.reverses(*index));
    variables.extend(reversed.map(|index| plain(Kind::Sign(index), [-1.0, 1.0])));
    variables
}

/// The position of an axis. `separates`: whether motions of rotary axes are sampled separately.
fn of_axis(kinematics: &Kinematics<'_>, index: usize, separates: bool, relative: f64) -> Variable {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let (axis, motions) = (&machine.axes[index], &errors.motions[index]);
    let is_rotary = axis.letter.is_rotary();
    let range = axis.travel.map(|t| axis.to_kinematic(t));
    let [low, high] = range;
    let inside = |k: &f64| *k > low + 1e-9 && *k < high - 1e-9;
    let mut ends = Vec::new();
    let mut calibrated = range;
    if motions.iter().any(Motion::holds) {
        let [from, to] = errors.calibrated[index];
        ends.extend([from, to].into_iter().filter(inside));
        if from < high && to > low {
            calibrated = [from.max(low), to.min(high)];
        }
    }
    let tables = motions.iter().filter_map(|m| m.table.as_ref());
    let measured = tables.flat_map(|table| table.at.iter().copied().filter(inside));
    let mut kinks: Vec<f64> = ends.iter().copied().chain(measured).collect();
    ascending(&mut kinks);
    kinks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let bends = errors.bends(machine, index);
    let uneven = is_rotary && motions.iter().any(Motion::varies);
    let widest = match (is_rotary, kinematics.policy) {
        (false, _) => f64::INFINITY,
        (true, Policy::Direction { damping }) => damping.min(PIECE),
        (true, _) => PIECE,
    };
    Variable {
        kind: match (is_rotary, bends) {
            (true, _) => Kind::Rotary(index),
            (false, true) => Kind::Bending(index),
            (false, false) => Kind::Affine(index),
        },
        range,
        wraps: axis.modulo,
        calibrated,
        pieces: match kinks.is_empty() {
            true => Vec::new(),
            false => pieces(range, &kinks, widest),
        },
        kinks,
        ends,
        moves: bends || (uneven && separates),
        nodes: nodes_for(motions, is_rotary),
        turning: match is_rotary {
            true if uneven && !separates => Turning::UNEVEN,
            true => Turning::of(kinematics, index, relative),
            false => Turning::NONE,
        },
        peaks: match is_rotary {
            true => nodes::at_peaks(kinematics, index),
            false => Vec::new(),
        },
    }
}

/// The number of nodes that resolve the motions of an axis.
fn nodes_for(motions: &[Motion; 6], is_rotary: bool) -> usize {
    let mut tables = motions.iter().filter_map(|m| m.table.as_ref()).peekable();
    let is_tabulated = tables.peek().is_some();
    let is_directed = tables.any(|table| table.negative.is_some());
    match (is_rotary, is_tabulated, is_directed) {
        // Six motions, each times five products of sine and cosine, and their second order; the same number
        // again in the other direction.
        (true, true, true) => 65,
        (true, true, false) => 45,
        (true, false, _) => 33,
        (false, true, true) => 35,
        (false, true, false) => 21,
        // Polynomials: their products with the coordinate, and their second order.
        (false, false, _) => {
            let degrees = motions
                .iter()
                .map(|m| m.coefficients.len().saturating_sub(1));
            (2 * degrees.max().unwrap_or(0) + 5).clamp(15, 21)
        }
    }
}

/// A table from which functions are made as products.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Generator {
    /// [`Variable::coordinate`].
    Coordinate,
    /// [`Variable::sine`].
    Sine,
    /// [`Variable::cosine`].
    Cosine,
}

impl Generator {
    /// The value at a position of a variable.
    pub fn value(self, variable: &Variable, x: f64) -> f64 {
        match self {
            Self::Coordinate => variable.coordinate(x),
            Self::Sine => variable.sine(x),
            Self::Cosine => variable.cosine(x),
        }
    }
}

/// The products of generators up to a degree, with sine at most once because sin² = 1 − cos².
pub fn products(kind: &Kind, degree: usize) -> Vec<Vec<Generator>> {
    match kind {
        Kind::Rotary(_) => {
            let mut all = vec![vec![]];
            for d in 1..=degree {
                all.push(vec![Generator::Cosine; d]);
                let mut with_sine = vec![Generator::Sine];
                with_sine.extend(vec![Generator::Cosine; d - 1]);
                all.push(with_sine);
            }
            all
        }
        _ => (0..=degree)
            .map(|d| vec![Generator::Coordinate; d])
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, machine, with_rotary};
    use super::*;
    use nalgebra::DMatrix;

    fn of(machine: &trueaxis_model::machine::Machine, lines: &str) -> Vec<Variable> {
        let errors = errors(machine, lines);
        variables(&Kinematics::new(machine, &errors), 1e-6)
    }

    #[test]
    fn products_stay_apart_on_ranges_of_any_width() {
        for half in [3.0, 10.0, 30.0, 45.0, 79.0, 81.0, 120.0, 180.0, 360.0] {
            for middle in [0.0, 0.7 * half] {
                let machine = with_rotary(&[('C', [middle - half, middle + half])]);
                let variables = of(&machine, "");
                let c = &variables[3];
                let all = products(&c.kind, 4);
                let at = c.positions(33);
                let values = DMatrix::from_fn(at.len(), all.len(), |i, k| {
                    all[k].iter().map(|g| g.value(c, at[i])).product::<f64>()
                });
                let values = values.singular_values();
                // The plain products have 1e13 on ±3°; with 1e4, f64 rounding leaves 1e-12.
                let condition = values.max() / values.min();
                assert!(condition < 1e4, "±{half}° around {middle}°: {condition:.0}");
            }
        }
    }

    #[test]
    fn a_motion_that_bends_is_counted_from_the_middle_of_a_range_on_one_side() {
        let machine = machine(&[
            ('X', [300.0, 400.0]),
            ('Y', [300.0, 400.0]),
            ('Z', [-200.0, 200.0]),
        ]);
        let variables = of(&machine, "[parameters]\nEYX2 = 1e-9\n");
        assert_eq!(variables[0].kind, Kind::Bending(0));
        assert_eq!(
            [300.0, 350.0, 400.0].map(|x| variables[0].coordinate(x)),
            [-1.0, 0.0, 1.0]
        );
        assert_eq!(variables[1].kind, Kind::Affine(1));
        assert_eq!(variables[1].coordinate(400.0), 1.0);
        assert_eq!(variables[1].at_coordinate(0.5), 200.0);
    }

    #[test]
    fn a_measured_point_is_sampled_on_both_sides_and_an_end_of_the_calibrated_range_is_not() {
        let machine = with_rotary(&[]);
        let table = "[tabulated.EXX]\nat = [-100.0, 0.0, 100.0]\nvalue = [0.0, 1e-3, 0.0]\n";
        let variables = of(&machine, table);
        assert_eq!(variables[0].kinks, [-100.0, 0.0, 100.0]);
        assert_eq!(variables[0].ends, [-100.0, 100.0]);
        assert_eq!(variables[0].calibrated, [-100.0, 100.0]);
        assert_eq!(variables[0].sides(50.0), [50.0]);
        let end = variables[0].sides(100.0);
        assert!(end.len() == 1 && end[0] < 100.0);
        let sides = variables[0].sides(1e-5);
        assert!(sides.len() == 2 && sides[0] < 0.0 && sides[1] > 0.0);
        // Each side of the point has a polynomial of its own, evaluated 0.8 µm away from the point.
        let bent = |x: f64| if x < 0.0 { x.powi(3) } else { 7.0 * x };
        for (x, wanted) in [(-40.0, -64e3), (30.0, 210.0), (0.0, 0.0)] {
            let sampled = variables[0].sampled_for(x);
            let found: f64 = sampled.iter().map(|(x, weight)| weight * bent(*x)).sum();
            assert!((found - wanted).abs() < 3e-3, "{x}: {found}");
        }
    }

    #[test]
    fn motions_of_two_rotary_axes_are_sampled_together_unless_they_were_measured() {
        let machine = with_rotary(&[('A', [-90.0, 90.0]), ('C', [-180.0, 180.0])]);
        let together = of(&machine, "[parameters]\nEXC2 = 1e-3\n");
        assert!(together[4].is_uneven() && !together[4].is_switch());
        let apart = of(&machine, "[parameters]\nEXCc2 = 1e-3\n");
        assert!(!apart[4].is_uneven() && apart[4].is_switch());
    }
}
