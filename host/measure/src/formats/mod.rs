//! Measurement files: artefacts, probes, probings, readings of instruments, of ball-bars and of displacement sensors, observations,
//! validations.

pub mod artefact;
pub mod displacements;
pub mod kind;
pub mod observations;
pub mod probe;
pub mod probings;
pub mod radii;
pub mod revolutions;
pub mod runs;
pub mod temperatures;
pub mod validation;

use trueaxis_model::formats::csv::CsvRow;
use trueaxis_model::machine::{Axis, Machine};
use trueaxis_model::source::FileError;

/// The axis whose letter is the name of a column.
fn axis(name: &str, machine: &Machine) -> Option<usize> {
    let mut letters = name.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => machine.index(letter),
        _ => None,
    }
}

/// Recorded positions are not exact: an axis may be this far (mm, deg) beyond its travel.
const BEYOND: f64 = 1e-3;

/// Checks that a position (mm, deg) read from a column is within the travel of an axis.
pub(crate) fn is_in_travel(
    row: &CsvRow<'_>,
    column: usize,
    axis: &Axis,
    position: f64,
    remedy: &str,
) -> Result<(), FileError> {
    let [low, high] = axis.travel;
    if (low - BEYOND..=high + BEYOND).contains(&position) {
        return Ok(());
    }
    let message = format!(
        "{} = {position} is outside the travel of {low} to {high}",
        axis.letter
    );
    Err(row.error(column, message, "outside the travel", remedy))
}

/// The position (mm, deg) of an axis where something was measured.
fn position(row: &CsvRow<'_>, column: usize, axis: &Axis) -> Result<f64, FileError> {
    let value = row.number(column)?;
    if !axis.modulo {
        let remedy = "correct the row, or the range of the axis in the machine file";
        is_in_travel(row, column, axis, value, remedy)?;
    }
    Ok(value)
}

/// The direction from which an axis arrived.
fn direction(row: &CsvRow<'_>, column: usize) -> Result<f64, FileError> {
    let value = row.number(column)?;
    match [1.0, -1.0, 0.0].contains(&value) {
        true => Ok(value),
        false => Err(row.error(
            column,
            format!("`{}` is not a direction", row.cells[column].text),
            "here",
            "write 1 after positive travel, -1 after negative travel, 0 if unknown",
        )),
    }
}
