//! Cross-validation with balls that were left out of the fit.

use crate::formats::artefact::Artefact;
use crate::formats::observations::Observations;
use crate::formats::probings::{Probing, Probings, ball_index};
use crate::observed::moved;
use crate::rows::by_name;
use crate::rows::order;
use crate::{Identified, IdentifyError, IdentifyOptions, Measured, Problem, identify};
use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::{ascending, student};

/// The prediction of rows by machines identified without them.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Root mean square distance (mm) from the predicted to the actual tip, over all rows.
    pub rms: f64,
    /// Like `rms`, for the rows of each ball, by its name; empty if there were too few balls to leave one out.
    pub balls: Vec<(String, f64)>,
    /// The prediction of rows that were measured together, if there are enough runs or thermal cycles.
    pub together: Option<Together>,
}

/// The prediction of each run or thermal cycle by the others. What a machine does in one of them differs from row to row
/// less than from one to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Together {
    /// Number of runs or cycles; of many, neighbours count as one.
    pub count: usize,
    /// Root mean square distance (mm) from the predicted to the actual tip over all rows, with the zero of the workpiece set
    /// in each.
    pub rms: f64,
}

impl Together {
    /// `rms` as a standard deviation: 1.96 times that is what 95 % of other runs do not exceed.
    pub(crate) fn deviation(&self) -> f64 {
        student(self.count - 1) / 1.96 * self.rms
    }
}

/// Number of parts that the rows are split into if there are too few balls.
const PARTS: usize = 4;
const FEW_BALLS: usize = 3;
/// Runs and cycles are left out if there are as many.
const FEW_RUNS: usize = 3;
/// Most that are left out one by one: each costs an identification.
const MANY_RUNS: usize = 12;

/// Identifies without the rows of each ball but with all other observations, and measures how well the result predicts them, with the ball placed at
/// the best position. With fewer than three balls every fourth row is left out instead.
///
/// # Errors
/// [`IdentifyError`] if the model cannot be identified without some of the rows.
pub fn held_out(
    measured: &Measured<'_>,
    parameters: &[Parameter],
    options: IdentifyOptions,
) -> Result<HeldOut, IdentifyError> {
    let Measured { probings, .. } = *measured;
    if probings.rows.is_empty() {
        return Err(IdentifyError::NoProbings);
    }
    let mut squares = 0.0;
    let mut balls = Vec::new();
    for (name, part) in parts(probings) {
        let without = without(measured, &part, parameters, options)?;
        let part = subset(probings, |i| part.contains(&i));
        let tips = tips(measured, &part, &without);
        let part_squares = (0..part.balls.len())
            .map(|ball| scatter(&tips, ball))
            .sum::<f64>();
        squares += part_squares;
        balls.extend(name.map(|name| (name, (part_squares / part.rows.len() as f64).sqrt())));
    }
    Ok(HeldOut {
        rms: (squares / probings.rows.len() as f64).sqrt(),
        balls,
        together: together(measured, parameters, options),
    })
}

/// Identifies without the rows of each run or thermal cycle. `None` if there are too few, one is needed, or none has balls of
/// the others.
fn together(
    measured: &Measured<'_>,
    parameters: &[Parameter],
    options: IdentifyOptions,
) -> Option<Together> {
    let Measured { probings, .. } = *measured;
    let all = runs(probings, measured.observations)?;
    let (mut squares, mut rows) = (0.0, 0);
    for own in &all {
        let others = subset(probings, |i| !own.contains(&i));
        let without = without(measured, own, parameters, options).ok()?;
        let part = subset(probings, |i| own.contains(&i));
        let off = |(ball, tip): (usize, Vector3<f64>)| {
            let name = &part.balls[ball];
            let known = others.balls.iter().position(|other| other == name);
            known.map(|known| tip - without.balls[known])
        };
        let tips = tips(measured, &part, &without).into_iter();
        let off: Vec<Vector3<f64>> = tips.filter_map(off).collect();
        let zero = off.iter().sum::<Vector3<f64>>() / off.len().max(1) as f64;
        squares += (off.iter())
            .map(|off| (off - zero).norm_squared())
            .sum::<f64>();
        rows += off.len();
    }
    (rows > 0).then(|| Together {
        count: all.len(),
        rms: (squares / rows as f64).sqrt(),
    })
}

/// The rows of each run, or else of each thermal cycle, in their order; `None` if there are too few.
fn runs(probings: &Probings, observations: &Observations) -> Option<Vec<Vec<usize>>> {
    let rows = probings.rows.iter();
    let cycle = |row: &Probing| {
        let thermal = observations.thermal.as_ref()?;
        Some(thermal.log.cycle_at(row.time?)? as f64)
    };
    let by_run: Option<Vec<f64>> = rows.clone().map(|row| row.run).collect();
    let of_rows: Vec<f64> = match by_run {
        Some(runs) => runs,
        None => rows.map(cycle).collect::<Option<_>>()?,
    };
    let mut names = of_rows.clone();
    ascending(&mut names);
    names.dedup();
    if names.len() < FEW_RUNS {
        return None;
    }
    let count = names.len().min(MANY_RUNS);
    let mut all = vec![Vec::new(); count];
    for (row, run) in of_rows.iter().enumerate() {
        let number = names.partition_point(|name| name < run);
        all[number * count / names.len()].push(row);
    }
    Some(all)
}

/// An identification without these rows.
fn without(
    measured: &Measured<'_>,
    rows: &[usize],
    parameters: &[Parameter],
    options: IdentifyOptions,
) -> Result<Identified, IdentifyError> {
    let others = Measured {
        probings: &subset(measured.probings, |i| !rows.contains(&i)),
        ..*measured
    };
    identify(&others.problem(parameters), options)
}

/// Where an identification without these rows says that the tip was, with the ball of each row.
fn tips(
    measured: &Measured<'_>,
    rows: &Probings,
    without: &Identified,
) -> Vec<(usize, Vector3<f64>)> {
    let (machine, artefact) = (measured.machine, measured.artefact);
    let problem = Problem::new(machine, rows, artefact, &[], &without.errors);
    let problem = problem.at_times(measured.observations);
    let mut tips = problem.tips(&without.errors, &without.stylus);
    if let Some(drift) = without.place.estimate.drift_of(None) {
        for (place, (_, tip)) in problem.places.iter().zip(&mut tips) {
            *tip = moved(*tip, &drift, &place.hours);
        }
    }
    tips
}

/// Rows that are held out together: those of each ball, with its name.
fn parts(probings: &Probings) -> Vec<(Option<String>, Vec<usize>)> {
    let order = order(probings);
    if probings.balls.len() < FEW_BALLS {
        let every = |k: usize| order.iter().copied().skip(k).step_by(PARTS).collect();
        return (0..PARTS).map(|k| (None, every(k))).collect();
    }
    let balls = by_name(probings);
    let of = |ball: usize| {
        let rows = order.iter().copied();
        rows.filter(|i| probings.rows[*i].ball == ball).collect()
    };
    (balls.into_iter())
        .map(|ball| (Some(probings.balls[ball].clone()), of(ball)))
        .collect()
}

/// The rows that are kept, and their balls.
pub(crate) fn subset(probings: &Probings, is_in: impl Fn(usize) -> bool) -> Probings {
    let rows = probings.rows.iter().enumerate().filter(|(i, _)| is_in(*i));
    let mut subset = Probings {
        balls: Vec::new(),
        rows: rows
            .map(|(_, row): (usize, &Probing)| row.clone())
            .collect(),
    };
    for row in &mut subset.rows {
        row.ball = ball_index(&mut subset.balls, &probings.balls[row.ball]);
    }
    subset
}

/// Distance (mm) of the tip from its mean position at the same ball, for each row, with the stylus at this position. It
/// contains the noise and every error of the machine that `errors` lacks.
#[must_use]
pub fn scatters(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    errors: &ErrorModel,
    stylus: &Vector3<f64>,
) -> Vec<f64> {
    let problem = Problem::new(machine, probings, artefact, &[], errors);
    let tips = problem.tips(errors, stylus);
    let mean = |ball: usize| {
        let own = || tips.iter().filter(|(b, _)| *b == ball).map(|(_, tip)| tip);
        own().sum::<Vector3<f64>>() / own().count() as f64
    };
    let means: Vec<Vector3<f64>> = (0..probings.balls.len()).map(mean).collect();
    tips.iter()
        .map(|(ball, tip)| (tip - means[*ball]).norm())
        .collect()
}

/// Sum of the squared distances from the mean tip position at a ball.
fn scatter(tips: &[(usize, Vector3<f64>)], ball: usize) -> f64 {
    let tips = tips.iter().filter(|(b, _)| *b == ball).map(|(_, tip)| tip);
    let tips: Vec<&Vector3<f64>> = tips.collect();
    let mean = tips.iter().copied().sum::<Vector3<f64>>() / tips.len() as f64;
    tips.iter().map(|tip| (*tip - mean).norm_squared()).sum()
}
