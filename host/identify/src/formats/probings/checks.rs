//! Checks of probings that do not depend on the file's syntax.

use super::super::artefact::Artefact;
use super::{Probing, Probings};
use trueaxis_model::formats::csv::place;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Refuses balls that are not in the artefact, if it lists any. `text` is the source of the probings.
///
/// # Errors
/// [`FileError`] at the first row with such a ball.
pub fn have_known_balls(
    text: &str,
    probings: &Probings,
    artefact: &Artefact,
) -> Result<(), FileError> {
    let names: Vec<&str> = artefact.balls.iter().map(|b| b.name.as_str()).collect();
    let name = |row: &Probing| probings.balls[row.ball].as_str();
    let is_unknown = |row: &&Probing| !names.contains(&name(row));
    let unknown = probings.rows.iter().find(is_unknown);
    let Some(row) = unknown.filter(|_| !names.is_empty()) else {
        return Ok(());
    };
    Err(FileError::at(
        place(text, row.line, "ball"),
        format!("the artefact has no ball `{}`", name(row)),
        "unknown ball",
        format!(
            "write one of {}, or add [[ball]] with this name to the artefact",
            names.join(", ")
        ),
    ))
}

/// Largest rotary position (deg) of a file that could be in radians: 2π is 6.28.
const RADIANS: f64 = 6.3;
/// Most plans consist of half degrees; and the accuracy with which these are written in radians.
const STEP: f64 = 0.5;
const NEARLY: f64 = 0.01;

/// Refuses positions that are half degrees if read as radians but not if read as degrees.
pub(super) fn are_degrees(
    text: &str,
    probings: &Probings,
    machine: &Machine,
) -> Result<(), FileError> {
    let rotary = (0..machine.axes.len()).filter(|i| machine.axes[*i].letter.is_rotary());
    let rotary: Vec<usize> = rotary.collect();
    let all = probings.rows.iter();
    let values = all.flat_map(|row| rotary.iter().map(move |i| (row, *i, row.position[*i])));
    let values: Vec<_> = values.filter(|(_, _, v)| *v != 0.0).collect();
    let is_round = |v: f64| (v / STEP - (v / STEP).round()).abs() * STEP < NEARLY;
    let is_radian = |v: f64| v.abs() <= RADIANS && !is_round(v) && is_round(v.to_degrees());
    match values.first() {
        Some((row, axis, value)) if values.iter().all(|(_, _, v)| is_radian(*v)) => {
            let axis = machine.axes[*axis].letter;
            Err(FileError::at(
                place(text, row.line, &axis.to_string()),
                format!("rotary positions such as {axis} = {value} look like radians"),
                "a round number of degrees, in radians",
                "write rotary positions in degrees",
            ))
        }
        _ => Ok(()),
    }
}
