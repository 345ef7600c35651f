//! Measurement files: artefacts, probings, observations, temperatures; which kind a file is.

pub mod artefact;
pub mod kind;
pub mod observations;
pub mod probings;
pub mod temperatures;

use trueaxis_model::formats::csv::CsvRow;
use trueaxis_model::machine::{Axis, Machine};
use trueaxis_model::positions::is_in_travel;
use trueaxis_model::source::FileError;

/// The axis whose letter is the name of a column.
fn axis(name: &str, machine: &Machine) -> Option<usize> {
    let mut letters = name.chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => machine.index(letter),
        _ => None,
    }
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
