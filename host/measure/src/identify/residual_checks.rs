//! Checks of the residuals that show whether the uncertainties can be believed.

use super::trend::{OfBall, Repeats, Trend, by_ball, repeats, trend};
use super::{Identified, Problem};
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// What a trend is along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Along {
    /// Time (s) over so long.
    Time(f64),
    /// The order of the rows: there is no time.
    Order,
    /// Temperature (°C), over so much.
    Temperature(f64),
    /// Rows of this run against all others.
    Run(f64),
    /// Rows before which this axis came from the negative side (1) against the others (−1).
    Direction(char),
}

/// A check of what is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// Along what.
    pub along: Along,
    /// What was found; `None` if these rows cannot tell it from what was identified.
    pub trend: Option<Trend>,
    /// True if the model has a parameter that should take it in.
    pub is_modelled: bool,
}

/// All of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Honesty {
    /// Each ball.
    pub balls: Vec<OfBall>,
    /// Root of the mean square of what is left along x, y and z of the workpiece frame (mm).
    pub coordinates: Vector3<f64>,
    /// Time, temperature, runs, directions, where they are known.
    pub checks: Vec<Checked>,
    /// What repeats, if anything was probed twice.
    pub repeats: Option<Repeats>,
}

/// Runs are compared one by one up to so many.
const RUNS: usize = 20;

/// Looks at what an identification leaves of the probings that it was made from, with this artefact and what
/// was known before.
#[must_use]
pub fn honesty(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    base: &ErrorModel,
    identified: &Identified,
) -> Honesty {
    let problem = &Problem::new(machine, probings, artefact, &identified.looked_for, base);
    let rows = &probings.rows;
    let mut checks = Vec::new();
    let mut check = |along, values: Vec<f64>, is_modelled| {
        checks.push(Checked {
            along,
            trend: trend(problem, identified, &values),
            is_modelled,
        });
    };
    let all = |of: fn(&Probing) -> Option<f64>| -> Option<(Vec<f64>, f64)> {
        let values: Vec<f64> = rows.iter().map(of).collect::<Option<_>>()?;
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (high > low).then_some((values, high - low))
    };
    match all(|row| row.time) {
        Some((times, span)) => check(Along::Time(span), times, false),
        None => {
            let order = (0..rows.len()).map(|i| i as f64).collect();
            check(Along::Order, order, false);
        }
    }
    if let Some((temperatures, span)) = all(|row| row.temperature) {
        check(Along::Temperature(span), temperatures, false);
    }
    if let Some((runs, _)) = all(|row| row.run) {
        let mut names = runs.clone();
        names.sort_by(f64::total_cmp);
        names.dedup();
        // Of two, one says it all.
        let compared = if names.len() == 2 { 1 } else { RUNS };
        for name in names.into_iter().rev().take(compared) {
            let is_in = runs.iter().map(|run| f64::from(u8::from(*run == name)));
            check(Along::Run(name), is_in.collect(), false);
        }
    }
    for (i, axis) in problem.machine.axes.iter().enumerate() {
        let directions: Vec<f64> = rows.iter().map(|row| row.direction[i]).collect();
        if directions.iter().any(|d| *d != directions[0]) {
            let letter = axis.letter.char();
            let is_backlash = |p: &Parameter| p.axis == letter && p.kind == ParameterKind::Backlash;
            let mut found = identified.parameters.iter().map(|e| &e.parameter);
            let is_modelled = found.any(is_backlash);
            check(Along::Direction(letter), directions, is_modelled);
        }
    }
    let rotary = |i: &usize| problem.machine.axes[*i].letter.is_rotary();
    let key = |row: &Probing| {
        let positions = (0..problem.machine.axes.len()).filter(rotary);
        let positions = positions.map(|i| row.position[i]);
        let known = [row.ball as f64, row.spindle].into_iter();
        known
            .chain(positions)
            .chain(row.direction)
            .collect::<Vec<f64>>()
    };
    let keys: Vec<Vec<f64>> = rows.iter().map(key).collect();
    let square = |row: &super::Row| row.after.component_mul(&row.after);
    let squares: Vector3<f64> = identified.rows.iter().map(square).sum();
    Honesty {
        balls: by_ball(problem, identified),
        coordinates: (squares / rows.len() as f64).map(f64::sqrt),
        checks,
        repeats: repeats(problem, identified, &keys),
    }
}

impl Checked {
    /// A sentence about it, with what to do, if it is significant; sizes in µm.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let trend = self.trend.filter(Trend::is_significant)?;
        let um: [String; 3] = std::array::from_fn(|i| {
            format!(
                "{:.2} ± {:.2}",
                trend.change[i] * 1e3,
                2e3 * trend.uncertainty[i]
            )
        });
        let um = um.join(", ");
        let drift = "probe the balls in an order that repeats them, warm the machine up first, or add the temperature of the artefact to the rows";
        Some(match self.along {
            Along::Time(span) => format!(
                "the tip drifts against the balls, by {um} µm (x, y, z, k = 2) over {span:.0} s: {drift}"
            ),
            Along::Order => format!(
                "the tip drifts against the balls, or the model lacks something, by {um} µm (x, y, z, k = 2) from the first to the last row: {drift}"
            ),
            Along::Temperature(span) => format!(
                "the residuals follow temperature, by {um} µm (x, y, z, k = 2) over {span:.1} K: probe at one temperature, or one run for each, and identify each by itself"
            ),
            Along::Run(run) => format!(
                "run {run} is off the others by {um} µm (x, y, z, k = 2): look whether the artefact has moved, and identify the runs one by one"
            ),
            Along::Direction(axis) if self.is_modelled => format!(
                "the residuals depend on the direction from which {axis} came, by {um} µm (x, y, z, k = 2), although its backlash is in the model: its backlash varies over the travel"
            ),
            Along::Direction(axis) => format!(
                "the residuals depend on the direction from which {axis} came, by {um} µm (x, y, z, k = 2): add its backlash to the model, as EAAb is that of A"
            ),
        })
    }
}
