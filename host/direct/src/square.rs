//! Squareness: two lines, each read in the direction of the other.

use crate::measurement::{AxisRuns, Means, Square, slope, sum_uncertainty};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::{Branch, Machine};

/// Inclination (rad) used to measure its effect.
const SMALL: f64 = 1e-6;

/// The amount (rad) by which the angle between two lines is less than 90°; negative if it is more. It is the sum of
/// both slopes, which does not depend on the alignment of the square.
pub fn squareness(
    machine: &Machine,
    square: &Square,
    means: impl Fn(&AxisRuns) -> Option<Means>,
) -> Option<f64> {
    let of = |line: &AxisRuns| Some(slope(&line.positions(machine), &means(line)?.both()));
    Some(of(&square.lines[0])? + of(&square.lines[1])?)
}

/// Parameters that may be the squareness of two axes, the likeliest first.
///
/// It belongs to the axis that the other one carries, or to the one in the tool branch, or to the other axis if the
/// first has no effect.
pub fn candidates(machine: &Machine, [a, b]: [usize; 2]) -> impl Iterator<Item = Parameter> + '_ {
    let tool = |i: usize| machine.axes[i].branch == Branch::Tool;
    let order = match (tool(a), tool(b)) {
        (true, false) => [a, b],
        (false, true) => [b, a],
        _ => [a.max(b), a.min(b)],
    };
    order.into_iter().flat_map(move |axis| {
        (3..6).map(move |component| Parameter {
            component,
            axis: machine.axes[axis].letter.char(),
            kind: ParameterKind::Inter,
        })
    })
}

/// The parameter for the squareness of two axes, and the reading of a square per unit of it (rad per rad).
pub fn location(machine: &Machine, square: &Square) -> Option<(Parameter, f64)> {
    let axes = square.lines.each_ref().map(|line| line.setup.moved);
    let shown = candidates(machine, axes).filter_map(|parameter| {
        let mut errors = ErrorModel::perfect(machine);
        errors.set(machine, parameter, SMALL);
        let bench = Bench::new(machine, &errors, Default::default());
        let shown = squareness(machine, square, |line| {
            line.shown(&bench, &line.means().directions())
        });
        Some((parameter, shown? / SMALL))
    });
    // For axes in oblique frames, use the first that shows almost fully.
    let shown: Vec<(Parameter, f64)> = shown.collect();
    let whole = shown.iter().find(|(_, gain)| gain.abs() > 0.9);
    let part = || shown.iter().find(|(_, gain)| gain.abs() > 0.5);
    whole.or_else(part).copied()
}

/// Standard uncertainty (rad) of the squareness, from the scatter of the runs.
pub fn uncertainty(machine: &Machine, square: &Square) -> Option<f64> {
    let of = |line: &AxisRuns| {
        let positions = line.positions(machine);
        let mean = positions.iter().sum::<f64>() / positions.len() as f64;
        let across: f64 = positions.iter().map(|q| (q - mean).powi(2)).sum();
        let weights: Vec<f64> = positions.iter().map(|q| (q - mean) / across).collect();
        sum_uncertainty(line, &weights)
    };
    let [a, b] = &square.lines;
    Some(libm::hypot(of(a)?, of(b)?))
}
