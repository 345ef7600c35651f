//! Solves for error motions and locations that reproduce the measurements.

use crate::block::{RunBlock, blocks};
use crate::direct_error::DirectError;
use crate::measurement::{
    AxisRuns, Means, MeasuredRuns, Measurement, Square, mean_uncertainty, slope, sum_uncertainty,
};
use crate::motion::{FoundMotion, without};
use crate::square::{location, squareness, uncertainty};
use crate::warnings::{Doubt, doubts};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;

/// Options of the solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolveOptions {
    /// Describe the backlash of each motion by one number instead of values for both directions.
    pub one_number: bool,
}

/// A location found with a square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundLocation {
    /// The parameter.
    pub parameter: Parameter,
    /// Value (rad).
    pub value: f64,
    /// Standard uncertainty (rad), from the scatter of the runs.
    pub uncertainty: Option<f64>,
    /// The measurement (by index) that it comes from.
    pub from: usize,
}

/// The result.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectResult {
    /// All errors: those known before and those measured.
    pub errors: ErrorModel,
    /// The motions that were measured.
    pub motions: Vec<FoundMotion>,
    /// The locations that were measured.
    pub locations: Vec<FoundLocation>,
    /// Slopes (rad) removed as misalignment of straightedges, with the measurement (by index).
    pub slopes: Vec<(usize, f64)>,
    /// Warnings.
    pub doubts: Vec<Doubt>,
}

/// Largest number of rounds. Each reduces the error by a factor of the size of the errors, or of the square of the
/// largest side effect.
const ROUNDS: usize = 60;
/// A change below this (mm, or rad on a lever of a metre) is little more than rounding.
const DONE: f64 = 2e-11;
const OVER: f64 = 1000.0;

/// Finds the measured errors, given those that are already known.
///
/// # Errors
/// [`DirectError`]: readings that mix motions, or the same measured twice.
pub fn solve(
    machine: &Machine,
    measurements: &[Measurement],
    known: &ErrorModel,
    options: SolveOptions,
) -> Result<DirectResult, DirectError> {
    let mut lines: Vec<(usize, &AxisRuns)> = Vec::new();
    let mut squares: Vec<(usize, &Square)> = Vec::new();
    for (k, measurement) in measurements.iter().enumerate() {
        match &measurement.measured {
            MeasuredRuns::Line(line) => lines.push((k, line)),
            MeasuredRuns::Square(square) => squares.push((k, square)),
        }
    }
    let blocks = blocks(machine, &lines)?;
    let mut motions: Vec<Vec<FoundMotion>> = (blocks.iter())
        .map(|block| start(machine, block, &lines))
        .collect();
    let mut locations = located(machine, &squares)?;
    let anew = motions.iter().flatten();
    let anew: Vec<(usize, usize, bool)> = anew
        .map(|m| (m.axis, m.component, m.negative.is_some()))
        .collect();
    let parameters: Vec<Parameter> = locations.iter().map(|(l, _)| l.parameter).collect();
    let mut model = without(known, machine, &anew, &parameters);
    let mut slopes = Vec::new();
    let mut change = f64::INFINITY;
    for _ in 0..ROUNDS {
        change = 0.0;
        slopes.clear();
        for (block, motions) in blocks.iter().zip(&mut motions) {
            let round = block.round(machine, &model, &lines, motions, &mut slopes);
            change = change.max(round.ok_or_else(DirectError::not_converged)?);
            put(machine, &mut model, motions);
        }
        for ((_, square), (location, gain)) in squares.iter().zip(&mut locations) {
            let left = missing(machine, &model, square).ok_or_else(DirectError::not_converged)?;
            let step = left / *gain;
            location.value += step;
            model.set(machine, location.parameter, location.value);
            change = change.max(step.abs() * OVER);
        }
        if !change.is_finite() || change < DONE {
            break;
        }
    }
    if !change.is_finite() || change >= DONE {
        return Err(DirectError::not_converged());
    }
    let mut motions: Vec<FoundMotion> = motions.into_iter().flatten().collect();
    motions.sort_by_key(|m| (m.axis, m.component));
    if options.one_number {
        with_one_number(machine, &mut model, &mut motions);
    }
    let locations: Vec<FoundLocation> = locations.into_iter().map(|(l, _)| l).collect();
    add_uncertainties(&mut model, &motions, &locations);
    let doubts = doubts(machine, &lines, &motions, &model);
    Ok(DirectResult {
        errors: model,
        motions,
        locations,
        slopes,
        doubts,
    })
}

/// The location that each square shows, still zero, and how much the square reads per unit of it.
fn located(
    machine: &Machine,
    squares: &[(usize, &Square)],
) -> Result<Vec<(FoundLocation, f64)>, DirectError> {
    let mut locations: Vec<(FoundLocation, f64)> = Vec::new();
    for (file, square) in squares {
        let (parameter, gain) = location(machine, square).ok_or_else(|| {
            DirectError::new(
                vec![*file],
                "no location of these axes is their squareness",
                "a square has lines along two linear axes that are across each other",
            )
        })?;
        if let Some((other, _)) = locations.iter().find(|(l, _)| l.parameter == parameter) {
            let files = vec![other.from, *file];
            return Err(DirectError::twice(files, &parameter.to_string()));
        }
        let found = FoundLocation {
            parameter,
            value: 0.0,
            uncertainty: uncertainty(machine, square),
            from: *file,
        };
        locations.push((found, gain));
    }
    Ok(locations)
}

/// What a square read (rad) and a model does not show.
fn missing(machine: &Machine, model: &ErrorModel, square: &Square) -> Option<f64> {
    let bench = Bench::new(machine, model, Default::default());
    let measured = squareness(machine, square, |line| Some(line.means()));
    let shown = squareness(machine, square, |line| {
        line.shown(&bench, &line.means().directions())
    });
    Some(measured? - square.over - shown?)
}

/// Replaces the difference of both directions by one number for each motion.
fn with_one_number(machine: &Machine, model: &mut ErrorModel, motions: &mut [FoundMotion]) {
    for motion in &mut *motions {
        if let Some(backlash) = motion.backlash() {
            let parameter = Parameter {
                component: motion.component,
                axis: machine.axes[motion.axis].letter.char(),
                kind: ParameterKind::Backlash,
            };
            model.set(machine, parameter, backlash);
            let uncertainty = motion.backlash_uncertainty.map(|u| (parameter, u));
            model.standard_uncertainty.extend(uncertainty);
            *motion = motion.with_one_number();
        }
    }
    put(machine, model, motions);
}

fn add_uncertainties(model: &mut ErrorModel, motions: &[FoundMotion], locations: &[FoundLocation]) {
    for motion in motions {
        let of = (motion.axis, motion.component);
        let values = model.motions[motion.axis][motion.component].table.as_ref();
        let count = values.map_or(0, |table| table.at.len());
        let uncertainty = motion.uncertainty.map(|u| (of, vec![u; count]));
        model.table_uncertainty.extend(uncertainty);
    }
    for location in locations {
        let uncertainty = location.uncertainty.map(|u| (location.parameter, u));
        model.standard_uncertainty.extend(uncertainty);
    }
}

/// Motions initialized to zero.
fn start(machine: &Machine, block: &RunBlock, lines: &[(usize, &AxisRuns)]) -> Vec<FoundMotion> {
    let first = lines[block.lines[0]].1;
    let at = first.positions(machine);
    let reverses = first.means().directions().len() == 2;
    let of = |uncertainty: &dyn Fn(&AxisRuns) -> Option<f64>| -> Option<Vec<f64>> {
        block
            .lines
            .iter()
            .map(|k| uncertainty(lines[*k].1))
            .collect()
    };
    let of_values = of(&mean_uncertainty);
    let same = vec![1.0 / at.len() as f64; at.len()];
    let of_backlash = of(&|line| sum_uncertainty(line, &same));
    let components = block.components.iter().enumerate();
    components
        .map(|(row, component)| {
            // The largest effect of any reading's uncertainty on it.
            let uncertainty = |of: &Vec<f64>| {
                let at = block.inverse.iter().map(|inverse| {
                    let parts = (of.iter())
                        .enumerate()
                        .map(|(k, u)| (inverse[(row, k)] * u).powi(2));
                    parts.sum::<f64>().sqrt()
                });
                at.fold(0.0, f64::max)
            };
            let weight = |k: &usize| block.inverse[0][(row, *k)].abs();
            let most = (0..block.lines.len()).max_by(|a, b| weight(a).total_cmp(&weight(b)));
            FoundMotion {
                axis: block.axis,
                component: *component,
                positive: vec![0.0; at.len()],
                negative: reverses.then(|| vec![0.0; at.len()]),
                at: at.clone(),
                uncertainty: of_values.as_ref().map(uncertainty),
                backlash_uncertainty: of_backlash.as_ref().filter(|_| reverses).map(uncertainty),
                from: lines[block.lines[most.unwrap_or(0)]].0,
            }
        })
        .collect()
}

impl RunBlock {
    /// Improves the motions to match the measurements. Returns the largest change (mm, or rad over [`OVER`]).
    fn round(
        &self,
        machine: &Machine,
        model: &ErrorModel,
        lines: &[(usize, &AxisRuns)],
        motions: &mut [FoundMotion],
        slopes: &mut Vec<(usize, f64)>,
    ) -> Option<f64> {
        let bench = Bench::new(machine, model, Default::default());
        let mut left: Vec<Means> = Vec::new();
        for k in &self.lines {
            let (file, line) = lines[*k];
            let (rest, slope) = rest(&bench, line)?;
            slopes.extend(slope.map(|slope| (file, slope)));
            left.push(rest);
        }
        let before: Vec<FoundMotion> = motions.to_vec();
        for direction in left[0].directions() {
            for (k, inverse) in self.inverse.iter().enumerate() {
                for (row, motion) in motions.iter_mut().enumerate() {
                    let parts = left.iter().enumerate();
                    let step: Option<f64> = parts
                        .map(|(column, left)| Some(inverse[(row, column)] * left.of(direction)?[k]))
                        .sum();
                    motion.values(direction)[k] += step?;
                }
            }
        }
        close_turns(machine, motions, &before)
    }
}

/// Makes both ends of turns equal. Returns the largest change since `before`, as of a round; `None` for no number.
fn close_turns(
    machine: &Machine,
    motions: &mut [FoundMotion],
    before: &[FoundMotion],
) -> Option<f64> {
    let mut change: f64 = 0.0;
    for (motion, before) in motions.iter_mut().zip(before) {
        let axis = &machine.axes[motion.axis];
        let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
        let last = motion.at.len() - 1;
        let whole = motion.at[last] - motion.at[0];
        if axis.modulo && (whole - (high - low)).abs() <= 1e-9 {
            for values in std::iter::once(&mut motion.positive).chain(&mut motion.negative) {
                let mean = 0.5 * (values[0] + values[last]);
                values[0] = mean;
                values[last] = mean;
            }
        }
        let size = if motion.component >= 3 { OVER } else { 1.0 };
        for (now, then) in motion.all_values().zip(before.all_values()) {
            change = change.max((now - then).abs() * size);
            if now.is_nan() {
                return None;
            }
        }
    }
    Some(change)
}

/// The measurement minus the readings of the machine as modelled, and the slope of a straightedge that was removed
/// from it.
fn rest(bench: &Bench<'_>, line: &AxisRuns) -> Option<(Means, Option<f64>)> {
    let measured = line.zeroed(line.means());
    let shown = line.shown(bench, &measured.directions())?;
    let less = |k: usize| {
        let (a, b) = (measured.0[k].as_ref()?, shown.0[k].as_ref()?);
        Some(a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
    };
    let mut rest = Means([0, 1].map(less));
    if line.setup.keeps_slope || !line.setup.is_straightness(bench.machine) {
        return Some((rest, None));
    }
    let positions = line.positions(bench.machine);
    let slope = slope(&positions, &rest.both());
    rest.level(&positions, positions[line.zero()], slope);
    Some((rest, Some(slope)))
}

/// Puts motions into a model.
fn put(machine: &Machine, model: &mut ErrorModel, motions: &[FoundMotion]) {
    for motion in motions {
        let table = motion.table(&machine.axes[motion.axis]);
        model.tabulate(motion.axis, motion.component, table);
    }
}
