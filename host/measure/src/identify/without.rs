//! Removes rows from probings.

use super::held_out::subset;
use crate::formats::probings::{Probing, Probings};
use trueaxis_model::machine::Machine;

/// Positions (deg or mm) that differ by less are equal.
const SAME: f64 = 1e-3;

/// Probings without `line 17`, without `ball 3`, or without the rows at a position such as `C = 90` or `S = 180`.
///
/// # Errors
/// What is wrong with `what`: it cannot be parsed, or it matches no row.
pub fn without(machine: &Machine, probings: &Probings, what: &str) -> Result<Probings, String> {
    let is_out = rows(machine, probings, what).ok_or_else(|| {
        format!("`{what}` is neither a line, nor a ball, nor a position of an axis")
    })?;
    let left = subset(probings, |i| !is_out(&probings.rows[i]));
    match probings.rows.len() - left.rows.len() {
        0 => Err(format!("no row is {what}")),
        _ => Ok(left),
    }
}

type IsOut = Box<dyn Fn(&Probing) -> bool>;

fn rows(machine: &Machine, probings: &Probings, what: &str) -> Option<IsOut> {
    if let Some((axis, value)) = what.split_once('=') {
        let value: f64 = value.trim().trim_end_matches('°').parse().ok()?;
        let near = move |position: f64| (position - value).abs() < SAME;
        let axis = axis.trim().to_ascii_uppercase();
        if axis == "S" {
            return Some(Box::new(move |row| near(row.spindle)));
        }
        let i = (machine.axes.iter()).position(|a| a.letter.to_string() == axis)?;
        return Some(Box::new(move |row| near(row.position[i])));
    }
    let (kind, name) = what.trim().split_once(char::is_whitespace)?;
    let name = name.trim();
    match kind {
        "line" => {
            let line: usize = name.parse().ok()?;
            Some(Box::new(move |row| row.line == line))
        }
        "ball" => {
            let ball = probings.balls.iter().position(|ball| ball == name);
            Some(Box::new(move |row| Some(row.ball) == ball))
        }
        _ => None,
    }
}
