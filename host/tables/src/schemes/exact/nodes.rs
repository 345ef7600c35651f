//! From a range and the errors of a machine: the positions at which the correction is sampled along an axis.
//!
//! Chebyshev points separate polynomials and trigonometric functions well. Along a rotary axis, small errors are turned
//! into corrections by sines and cosines, and by quotients of them; where the tool is nearly parallel to another rotary
//! axis, the damped solution has a peak as wide as its damping.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;
use trueaxis_model::errors::{Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::{Kinematics, Linearised, Policy};
use trueaxis_model::machine::{Machine, PerAxis};

/// Chebyshev points of a range, including both ends.
pub fn chebyshev([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let (mid, half) = (0.5 * (low + high), 0.5 * (high - low));
    (0..count)
        .map(|k| {
            let angle = std::f64::consts::PI * k as f64 / (count - 1) as f64;
            mid - half * libm::cos(angle)
        })
        .collect()
}

/// Chebyshev points of a range, without its ends.
pub fn chebyshev_inside([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let (mid, half) = (0.5 * (low + high), 0.5 * (high - low));
    let angle = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / count as f64;
    (0..count)
        .map(|k| mid - half * libm::cos(angle(k)))
        .collect()
}

/// The weights of the values at some positions in their interpolating polynomial at `x`.
pub fn lagrange(positions: &[f64], x: f64) -> Vec<(usize, f64)> {
    let weight = |i: usize| {
        let others = positions.iter().enumerate().filter(|(j, _)| *j != i);
        let factors = others.map(|(_, p)| (x - p) / (positions[i] - p));
        factors.product::<f64>()
    };
    (0..positions.len()).map(|i| (i, weight(i))).collect()
}

/// Number of nodes that resolve the functions of a rotary axis with its motions off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turning {
    /// If nothing bends: constant errors, up to second order.
    pub base: usize,
    /// If motions of other axes are on: first order.
    pub others: usize,
}

/// Number of nodes at which functions are counted: more than any axis has had functions.
const SEEN: usize = 17;
/// The second order of constant errors has nine functions: products of sine and cosine.
const BASE: usize = 13;
/// Number of random positions of the other axes at which functions are counted.
const PLACES: usize = 6;
/// Nodes in excess of the number of functions.
const SPARE: usize = 2;
/// Lever (mm) on which an angle (rad) counts as a displacement (mm).
const LEVER: f64 = 300.0;

/// Positions along a rotary axis with its motions off, where everything repeats after one turn: evenly spaced over
/// one turn, unless the range is smaller.
pub fn over_a_turn([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    if high - low < TAU {
        return chebyshev([low, high], count);
    }
    (0..count)
        .map(|k| low + TAU * (k as f64 + 0.5) / count as f64)
        .collect()
}

impl Turning {
    /// For inputs other than rotary axes.
    pub const NONE: Self = Self { base: 1, others: 1 };
    /// For a rotary axis whose motions are never off: about three times five functions, and the first five.
    pub(crate) const UNEVEN: Self = Self {
        base: 33,
        others: 17,
    };

    /// For a rotary axis; functions smaller than `relative` of the largest are ignored.
    pub fn of(kinematics: &Kinematics<'_>, index: usize, relative: f64) -> Self {
        let machine = kinematics.machine;
        let range = machine.axes[index].travel.map(f64::to_radians);
        let at = over_a_turn(range, SEEN);
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut columns = Vec::new();
        for _ in 0..PLACES {
            let start = within_travel(machine, &mut random);
            let rows: Vec<Vec<f64>> = at
                .iter()
                .map(|x| {
                    let mut q = start;
                    q[index] = *x;
                    responses(kinematics, &q)
                })
                .collect();
            for column in 0..rows[0].len() {
                columns.extend(rows.iter().map(|row| row[column]));
            }
        }
        let samples = DMatrix::from_vec(SEEN, columns.len() / SEEN, columns);
        // Eigenvalues are squares, accurate to 1e-15 of the largest.
        let values = (&samples * samples.transpose()).symmetric_eigenvalues();
        let least = relative.powi(2).max(1e-14) * values.amax();
        let count = values.iter().filter(|v| **v > least).count() + SPARE;
        // Products of sine and cosine up to degree two, unless the solution divides by them.
        let first_order = DMatrix::from_fn(SEEN, 5, |i, k| {
            let (s, c) = libm::sincos(at[i]);
            [1.0, c, s, c * c, s * c][k]
        });
        let q = first_order.qr().q();
        let rest = &samples - &q * (q.transpose() * &samples);
        if rest.norm_squared() > least {
            let all = (count + SPARE).min(BASE);
            return Self {
                base: all,
                others: all,
            };
        }
        Self {
            base: BASE,
            others: count,
        }
    }
}

/// A random position in the travel (mm, rad).
pub fn within_travel(machine: &Machine, random: &mut Pcg64Mcg) -> PerAxis {
    std::array::from_fn(|i| match machine.axes.get(i) {
        Some(axis) => {
            let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
            low + (high - low) * random.random::<f64>()
        }
        None => 0.0,
    })
}

/// The corrections (mm, rad times a lever) for every small location and motion error of every axis, linearised at a
/// position.
pub(crate) fn responses(kinematics: &Kinematics<'_>, q: &PerAxis) -> Vec<f64> {
    let machine = kinematics.machine;
    let linearised = Linearised::new(kinematics, q, &Situation::default());
    let Some(solver) = kinematics.jacobian(q, None).solver(kinematics.policy) else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for axis in machine.axes.iter().map(|a| a.letter.char()) {
        for kind in [ParameterKind::Inter, ParameterKind::Degree(0)] {
            for component in 0..6 {
                let parameter = Parameter {
                    component,
                    axis,
                    kind,
                };
                let Some(twist) = linearised.column(parameter) else {
                    continue;
                };
                let unit = if component < 3 { 1.0 } else { LEVER.recip() };
                let correction = solver.correct(&twist);
                all.extend(machine.axes.iter().zip(correction).map(|(output, c)| {
                    let lever = if output.letter.is_rotary() {
                        LEVER
                    } else {
                        1.0
                    };
                    c * unit * lever
                }));
            }
        }
    }
    all
}

/// Number of random positions of the other axes at which peaks are searched.
const PEAK_PLACES: usize = 2;
/// Samples per damping along the axis, and their largest number.
const LOOKS: f64 = 2.0;
const MOST_LOOKS: usize = 1500;
/// Number of nodes at the peaks: as many as the functions of a peak, its slopes, their squares and products.
const PEAK_NODES: usize = 16;
/// A sine or cosine alone makes no step longer than this many times the mean.
const STEEP: f64 = 2.5;

/// Nodes where the responses to small errors change quickly, evenly spaced along the path of the responses; none if
/// they change at about the same rate everywhere.
pub fn at_peaks(kinematics: &Kinematics<'_>, index: usize) -> Vec<f64> {
    let Policy::Direction { damping } = kinematics.policy else {
        return Vec::new();
    };
    let machine = kinematics.machine;
    let [low, high] = machine.axes[index].travel.map(f64::to_radians);
    // Everything repeats after one turn.
    let high = high.min(low + TAU);
    let steps = ((high - low) * LOOKS / damping).ceil() as usize;
    let steps = steps.clamp(60, MOST_LOOKS);
    let at = |k: usize| low + (high - low) * k as f64 / steps as f64;
    let mut random = Pcg64Mcg::seed_from_u64(5);
    // Change of the responses in each step, relative to their size.
    let mut ways = vec![0.0; steps];
    for _ in 0..PEAK_PLACES {
        let start = within_travel(machine, &mut random);
        let rows: Vec<Vec<f64>> = (0..=steps)
            .map(|k| {
                let mut q = start;
                q[index] = at(k);
                responses(kinematics, &q)
            })
            .collect();
        let size = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>().sqrt();
        let largest = rows.iter().map(|row| size(row)).fold(0.0, f64::max);
        for (way, pair) in ways.iter_mut().zip(rows.windows(2)) {
            let step: Vec<f64> = pair[0].iter().zip(&pair[1]).map(|(a, b)| b - a).collect();
            *way += size(&step) / largest.max(f64::MIN_POSITIVE);
        }
    }
    let whole: f64 = ways.iter().sum();
    let steepest = ways.iter().copied().fold(0.0, f64::max);
    if steepest * steps as f64 <= STEEP * whole {
        return Vec::new();
    }
    let mut nodes = Vec::with_capacity(PEAK_NODES);
    let mut gone = 0.0;
    for (k, way) in ways.iter().enumerate() {
        let next = whole * (nodes.len() as f64 + 0.5) / PEAK_NODES as f64;
        if nodes.len() < PEAK_NODES && gone + way > next {
            nodes.push(at(k) + (at(k + 1) - at(k)) * (next - gone) / way);
        }
        gone += way;
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::*;

    fn of(machine: &Machine, index: usize, relative: f64) -> Turning {
        let errors = errors(machine, "");
        let kinematics = Kinematics::new(machine, &errors).with_policy(Policy::Orientation);
        Turning::of(&kinematics, index, relative)
    }

    #[test]
    fn two_rotary_axes_have_the_five_functions_of_first_order() {
        let machine = with_rotary(&[('A', [-120.0, 120.0]), ('C', [-360.0, 360.0])]);
        for index in [3, 4] {
            let turning = of(&machine, index, 1e-8);
            assert!(turning.others <= 5 + SPARE, "{turning:?}");
            assert_eq!(turning.base, BASE);
        }
    }

    #[test]
    fn a_narrow_axis_needs_fewer() {
        let wide = with_rotary(&[('A', [-120.0, 120.0])]);
        let narrow = with_rotary(&[('A', [-3.0, 3.0])]);
        let nodes = |machine: &Machine| of(machine, 3, 1e-3).others;
        assert!(nodes(&narrow) < nodes(&wide));
    }

    #[test]
    fn the_solution_divides_by_the_middle_one_of_three() {
        let machine = with_rotary(&[
            ('A', [-45.0, 45.0]),
            ('B', [-45.0, 45.0]),
            ('C', [-45.0, 45.0]),
        ]);
        let middle = of(&machine, 4, 1e-8);
        assert!(
            middle.base == middle.others && middle.others > 5 + SPARE,
            "{middle:?}"
        );
    }

    #[test]
    fn positions_over_more_than_a_turn_are_even_over_one() {
        let at = over_a_turn([-TAU, TAU], 4);
        for pair in at.windows(2) {
            assert!((pair[1] - pair[0] - TAU / 4.0).abs() < 1e-15);
        }
    }
}
