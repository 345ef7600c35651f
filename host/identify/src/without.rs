//! Removes rows from measurements.

use crate::formats::observations::{Observation, Observations};
use crate::formats::probings::{Probing, Probings};
use crate::held_out::subset;
use trueaxis_model::machine::Machine;

/// Positions (deg or mm) that differ by less are equal.
const SAME: f64 = 1e-3;

/// Rows by the words that name them.
enum NamedRows {
    /// `C = 90`.
    Axis(usize, f64),
    /// `S = 180`.
    Spindle(f64),
    /// `line 17`.
    Line(usize),
    /// `ball 3`, by index; `None` if no row has this name.
    Ball(Option<usize>),
    /// `setup bar`, by index.
    Setup(usize),
    /// `bar.csv line 12`: of a file, by index.
    LineOf(usize, usize),
}

impl NamedRows {
    fn of(
        machine: &Machine,
        probings: &Probings,
        observations: &Observations,
        what: &str,
    ) -> Option<Self> {
        if let Some((axis, value)) = what.split_once('=') {
            let value: f64 = value.trim().trim_end_matches('°').parse().ok()?;
            let axis = axis.trim().to_ascii_uppercase();
            if axis == "S" {
                return Some(Self::Spindle(value));
            }
            let i = (machine.axes.iter()).position(|a| a.letter.to_string() == axis)?;
            return Some(Self::Axis(i, value));
        }
        let (first, name) = what.trim().split_once(char::is_whitespace)?;
        let name = name.trim();
        Some(match first {
            "line" => Self::Line(name.parse().ok()?),
            "ball" => Self::Ball(probings.balls.iter().position(|ball| ball == name)),
            "setup" => Self::Setup(observations.setups.iter().position(|s| s.name == name)?),
            file => {
                let file = observations.files.iter().position(|name| name == file)?;
                Self::LineOf(file, name.strip_prefix("line")?.trim().parse().ok()?)
            }
        })
    }

    fn has(&self, row: &Probing) -> bool {
        match *self {
            Self::Axis(i, at) => (row.position[i] - at).abs() < SAME,
            Self::Spindle(at) => (row.spindle - at).abs() < SAME,
            Self::Line(line) => row.line == line,
            Self::Ball(ball) => Some(row.ball) == ball,
            Self::Setup(_) | Self::LineOf(..) => false,
        }
    }

    fn has_observed(&self, row: &Observation) -> bool {
        match *self {
            Self::Axis(i, at) => (row.position[i] - at).abs() < SAME,
            Self::Spindle(at) => (row.spindle - at).abs() < SAME,
            Self::Setup(setup) => row.setup == setup,
            Self::LineOf(file, line) => (row.file, row.line) == (file, line),
            Self::Line(_) | Self::Ball(_) => false,
        }
    }
}

/// Measurements without `line 17` or `ball 3` of the probings, without `setup bar` or `bar.csv line 12` of the observations, or
/// without the rows at a position such as `C = 90` or `S = 180`.
///
/// # Errors
/// What is wrong with `what`: it cannot be parsed, or it matches no row.
pub fn without(
    machine: &Machine,
    probings: &Probings,
    observations: &Observations,
    what: &str,
) -> Result<(Probings, Observations), String> {
    let named = NamedRows::of(machine, probings, observations, what).ok_or_else(|| {
        format!("`{what}` is neither a line, nor a ball, nor a position of an axis")
    })?;
    let left = subset(probings, |i| !named.has(&probings.rows[i]));
    let mut observed = observations.clone();
    observed.rows.retain(|row| !named.has_observed(row));
    let is_same =
        left.rows.len() == probings.rows.len() && observed.rows.len() == observations.rows.len();
    match is_same {
        true => Err(format!("no row is {what}")),
        false => Ok((left, observed)),
    }
}
