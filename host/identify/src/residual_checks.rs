//! Checks of the residuals that show whether the uncertainties can be trusted.

use crate::formats::probings::{Probing, Probings};
use crate::trend::{OfBall, Repeats, Trend, by_ball, repeats, trend};
use crate::{Identified, Problem, RowResult, Unknown};
use nalgebra::Vector3;
use std::fmt;
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::numbers::{ascending, extremes, order};

/// The quantity that a trend depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrendAlong {
    /// Time, over a span (s).
    Time(f64),
    /// The order of the rows, if there is no time.
    Order,
    /// Temperature (°C), over a span.
    Temperature(f64),
    /// Rows of this run compared with all others.
    Run(f64),
    /// Rows that this axis approached in negative direction (1) compared with the others (−1).
    Direction(char),
}

impl fmt::Display for TrendAlong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Time(span) => write!(f, "drift over {span:.0} s"),
            Self::Order => f.write_str("drift from the first to the last row"),
            Self::Temperature(span) => write!(f, "over {span:.1} K"),
            Self::Run(run) => write!(f, "run {run} from the others"),
            Self::Direction(axis) => write!(f, "{axis} from below less from above"),
        }
    }
}

/// One check of the residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// The quantity.
    pub along: TrendAlong,
    /// The trend found; `None` if these rows cannot separate it from what was identified.
    pub trend: Option<Trend>,
    /// True if the model has a parameter that should account for it.
    pub is_modelled: bool,
}

/// All checks.
#[derive(Clone, Debug, PartialEq)]
pub struct Honesty {
    /// Residuals of each ball.
    pub balls: Vec<OfBall>,
    /// Root mean square of the residuals along x, y and z of the workpiece frame (mm).
    pub coordinates: Vector3<f64>,
    /// Time, temperature, runs and directions, if they are known.
    pub checks: Vec<Checked>,
    /// The correlation of the residuals of each row with the next one, if chance gives one this large less than once in a
    /// thousand.
    pub alike: Option<f64>,
    /// Repeatability, if anything was probed more than once.
    pub repeats: Option<Repeats>,
}

impl Honesty {
    /// A sentence with a remedy if neighbouring rows are alike, and no trend says why.
    #[must_use]
    pub fn alike_warning(&self) -> Option<String> {
        let explained = self.checks.iter().any(|check| check.warning().is_some());
        let alike = self.alike.filter(|_| !explained)?;
        Some(format!(
            "the residuals of one row and the next are alike (correlation {alike:.2}): the machine drifts in no simple way, or the model lacks something. Uncertainties count rows as independent and may be too small: probe the balls in an order that repeats them, warm the machine up first, or give a model with more parameters"
        ))
    }
}

/// The correlation of the residuals of each row with the next one (in time, or in the file), if it is significant. What the
/// unknowns have absorbed makes it smaller.
fn alike(problem: &Problem<'_>, rows: &[Probing], identified: &Identified) -> Option<f64> {
    /// One-sided: one in a thousand.
    const CHANCE: f64 = 3.1;
    /// Of fewer rows the unknowns of a set-up absorb most.
    const FEW: usize = 10;
    let times = varying(rows, |row| row.time).map(|(times, _)| times);
    let places = times.map_or_else(|| (0..rows.len()).collect(), |times| order(&times));
    let probed: Vec<&RowResult> = places.into_iter().map(|i| &identified.rows[i]).collect();
    let of = |setup: usize| {
        let rows = problem.observed.rows.iter().zip(&identified.observed);
        let own = rows.filter(move |(row, _)| row.setup == setup);
        own.map(|(_, result)| result).collect::<Vec<_>>()
    };
    let setups = (0..problem.observed.setups.len()).map(of);
    // Sums over the sources, each in units of its own noise.
    let (mut products, mut coordinates) = (0.0, 0.0);
    for source in std::iter::once(probed).chain(setups) {
        let trusted = source.into_iter().filter(|row| row.is_trusted);
        let left: Vec<Vector3<f64>> = trusted.map(|row| row.after).collect();
        let squares: Vector3<f64> = left.iter().map(|left| left.component_mul(left)).sum();
        let count = squares.iter().filter(|square| **square > 0.0).count() * left.len();
        if left.len() < FEW || count == 0 {
            continue;
        }
        let pairs = left.windows(2).map(|pair| pair[0].dot(&pair[1]));
        products += pairs.sum::<f64>() / squares.sum() * count as f64;
        coordinates += count as f64;
    }
    if coordinates == 0.0 {
        return None;
    }
    let correlation = products / coordinates;
    let is_significant = correlation * coordinates.sqrt() > CHANCE;
    is_significant.then_some(correlation)
}

/// Largest number of runs that are compared one by one.
const RUNS: usize = 20;

/// Checks the residuals of an identification at its probings, given the problem that it solved.
#[must_use]
pub fn honesty(problem: &Problem<'_>, probings: &Probings, identified: &Identified) -> Honesty {
    let rows = &probings.rows;
    let mut checks = Vec::new();
    let mut check = |along, values: Vec<f64>, is_modelled| {
        checks.push(Checked {
            along,
            trend: trend(problem, identified, &values),
            is_modelled,
        });
    };
    if let Some((along, values)) = time(problem, rows) {
        check(along, values, false);
    }
    if let Some((temperatures, span)) = varying(rows, |row| row.temperature) {
        check(TrendAlong::Temperature(span), temperatures, false);
    }
    for (run, is_in) in compared_runs(rows) {
        check(TrendAlong::Run(run), is_in, false);
    }
    for (i, axis) in problem.machine.axes.iter().enumerate() {
        let directions: Vec<f64> = rows.iter().map(|row| row.direction[i]).collect();
        if directions.iter().any(|d| *d != directions[0]) {
            let letter = axis.letter.char();
            let is_backlash = |p: &Parameter| p.axis == letter && p.kind == ParameterKind::Backlash;
            let mut found = identified.parameters.iter().map(|e| &e.parameter);
            let is_modelled = found.any(is_backlash);
            check(TrendAlong::Direction(letter), directions, is_modelled);
        }
    }
    let keys: Vec<Vec<f64>> = rows.iter().map(|row| place_of(problem, row)).collect();
    let square = |row: &super::RowResult| row.after.component_mul(&row.after);
    let squares: Vector3<f64> = identified.rows.iter().map(square).sum();
    Honesty {
        balls: by_ball(problem, identified),
        coordinates: (squares / rows.len().max(1) as f64).map(f64::sqrt),
        checks,
        alike: alike(problem, rows, identified),
        repeats: repeats(problem, identified, &keys),
    }
}

/// Time or the order of the rows, unless it is known not to matter.
fn time(problem: &Problem<'_>, rows: &[Probing]) -> Option<(TrendAlong, Vec<f64>)> {
    // Drift that was found together with the parameters has been tested, and so has the rest of it.
    let is_drift = |unknown: &Unknown| matches!(unknown, Unknown::Drift(None, _));
    let drifts = problem.unknowns.iter().any(is_drift);
    match varying(rows, |row| row.time) {
        Some(_) if drifts => None,
        Some((times, span)) => Some((TrendAlong::Time(span), times)),
        None if rows.is_empty() => None,
        None => Some((
            TrendAlong::Order,
            (0..rows.len()).map(|i| i as f64).collect(),
        )),
    }
}

/// A quantity of all rows and its span, if all have it and it is not the same in all.
fn varying(rows: &[Probing], of: fn(&Probing) -> Option<f64>) -> Option<(Vec<f64>, f64)> {
    let values: Vec<f64> = rows.iter().map(of).collect::<Option<_>>()?;
    let [low, high] = extremes(values.iter().copied());
    (high > low).then_some((values, high - low))
}

/// The runs that are compared with all others, the last first, and for each row whether it is in the run (1) or not (0).
fn compared_runs(rows: &[Probing]) -> Vec<(f64, Vec<f64>)> {
    let Some((runs, _)) = varying(rows, |row| row.run) else {
        return Vec::new();
    };
    let mut names = runs.clone();
    ascending(&mut names);
    names.dedup();
    // Of two runs, one comparison is enough.
    let compared = if names.len() == 2 { 1 } else { RUNS };
    let names = names.into_iter().rev().take(compared);
    let is_in = |name: f64| {
        runs.iter()
            .map(move |run| f64::from(u8::from(*run == name)))
    };
    names.map(|name| (name, is_in(name).collect())).collect()
}

/// What is the same where something was probed again.
fn place_of(problem: &Problem<'_>, row: &Probing) -> Vec<f64> {
    let rotary = |i: &usize| problem.machine.axes[*i].letter.is_rotary();
    let positions = (0..problem.machine.axes.len()).filter(rotary);
    let positions = positions.map(|i| row.position[i]);
    // What a machine does differs from run to run: that is no noise.
    let known = [row.ball as f64, row.spindle, row.run.unwrap_or(0.0)].into_iter();
    known.chain(positions).chain(row.direction).collect()
}

impl Checked {
    /// A sentence with a remedy, if the trend is significant; sizes in µm.
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
            TrendAlong::Time(span) => format!(
                "the tip drifts against the balls, by {um} µm (x, y, z, k = 2) over {span:.0} s: {drift}"
            ),
            TrendAlong::Order => format!(
                "the tip drifts against the balls, or the model lacks something, by {um} µm (x, y, z, k = 2) from the first to the last row: {drift}"
            ),
            TrendAlong::Temperature(span) => format!(
                "the residuals follow temperature, by {um} µm (x, y, z, k = 2) over {span:.1} K: probe at one temperature, or one run for each, and identify each by itself"
            ),
            TrendAlong::Run(run) => format!(
                "run {run} is off the others by {um} µm (x, y, z, k = 2): look whether the artefact has moved, and identify the runs one by one"
            ),
            TrendAlong::Direction(axis) if self.is_modelled => format!(
                "the residuals depend on the direction from which {axis} came, by {um} µm (x, y, z, k = 2), although its backlash is in the model: its backlash varies over the travel"
            ),
            TrendAlong::Direction(axis) => format!(
                "the residuals depend on the direction from which {axis} came, by {um} µm (x, y, z, k = 2): add its backlash to the model, as EAAb is that of A"
            ),
        })
    }
}
