//! Volumetric compensation of ISG and Beckhoff (TF5280): a table of the error motions of each axis.
//!
//! The control has a rigid-body model of ISO 230-1 errors and moves the tip back by its error; it does not correct the
//! orientation. Its CSV has columns between spaces: arguments (positions of axes, mm and degrees) and parameters (mm and
//! rad); `//` begins a comment, `#` a table of its own. Between rows it interpolates linearly. Sources: ISG and Beckhoff,
//! *Volumetric compensation*, sections on file formats, units, parameters and configuration. Written here are error motions
//! only, because what an axis location turns besides its axis differs between conventions: see [`rigid_body`].
//!
//! [`rigid_body`]: crate::rigid_body

mod imported;
mod parameters;

use crate::NotExported;
use crate::rigid_body::{AxisErrors, Chain, RemainingErrors};
use crate::text_lines::lines;
pub use imported::imported;
pub use parameters::{IsgParameters, IsgTable};
use std::fmt::Write;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::{Letter, Machine};

/// Errors of an axis in the order of its columns.
const COMPONENTS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];
/// Decimals of values: nanometres, and 1 nm at 1 m.
const DECIMALS: usize = 9;

/// Writes the errors of a machine with `points` over the travel of each axis, reads them again, and drives the machine with
/// what the control makes of them, at `positions` random commands in both directions of travel.
///
/// # Errors
/// [`NotExported`]
pub fn export(
    machine: &Machine,
    errors: &ErrorModel,
    points: usize,
    positions: usize,
    seed: u64,
) -> Result<(String, RemainingErrors), NotExported> {
    let letters: String = machine.axes.iter().map(|axis| axis.letter.char()).collect();
    if letters.chars().any(|letter| !COMPONENTS.contains(&letter)) {
        return Err(NotExported::new(
            format!(
                "the control compensates the axes X, Y, Z and up to three of A, B, C, and the machine has {letters}"
            ),
            "name the linear axes X, Y and Z in the machine file",
        ));
    }
    let chain = Chain::new(machine);
    let motions = chain.motions(errors, points);
    let csv = print(&chain, &motions);
    let read = IsgParameters::read_csv(&csv).map_err(NotExported::unread)?;
    let again = read.motions(machine).map_err(NotExported::unread)?;
    let left = chain.left(errors, &again, positions, seed);
    Ok((csv, left))
}

fn print(chain: &Chain<'_>, motions: &[AxisErrors]) -> String {
    let machine = chain.machine;
    let mut text = format!(
        "// trueaxis: {}\n// Zero position of the tool, and centres of rotation\n",
        machine.name
    );
    let (mut names, mut values) = (Vec::new(), Vec::new());
    let mut add = |prefix: &str, suffix: &str, vector: nalgebra::Vector3<f64>| {
        for (k, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            names.push(match prefix {
                "P0" | "N0" => format!("{prefix}{letter}"),
                _ => format!("{prefix}{letter}{suffix}"),
            });
            values.push(number(vector[k]));
        }
    };
    add("P0", "", chain.tip);
    add("N0", "", chain.tool);
    for (axis, placed) in machine.axes.iter().zip(&chain.axes) {
        let letter = axis.letter.to_string();
        if axis.letter.is_rotary() {
            add("P", &letter, placed.point);
        }
        // The control moves an axis along its letter or turns it about that; a reversed one goes the other way. The file
        // shows no smaller difference.
        let own = nalgebra::Vector3::ith(axis.letter.component(), 1.0);
        if (placed.direction - own).abs().max() > 1e-9 {
            add("V", &letter, placed.direction);
        }
    }
    let _ = writeln!(text, "{}\n{}", names.join("\t"), values.join("\t"));
    for (axis, motions) in machine.axes.iter().zip(motions) {
        text += &errors_of_axis(axis.letter, motions);
    }
    text
}

fn errors_of_axis(letter: Letter, motions: &AxisErrors) -> String {
    let mut text = format!("#\n// Errors of {letter}\n{letter}");
    for component in COMPONENTS {
        let _ = write!(text, "\tE{component}{letter}");
    }
    text.push('\n');
    for (at, error) in motions.at.iter().zip(&motions.errors) {
        let row: Vec<String> = error.iter().map(|v| number(*v)).collect();
        let _ = writeln!(text, "{at:.6}\t{}", row.join("\t"));
    }
    text
}

/// A number without −0.
fn number(value: f64) -> String {
    let scale = 10_f64.powi(DECIMALS as i32);
    format!("{:.DECIMALS$}", (value * scale).round() / scale + 0.0)
}

/// True if a text is of the exchange format of Etalon, whose parameters stand in square brackets.
#[must_use]
pub fn is_etalon(text: &str) -> bool {
    lines(text)
        .iter()
        .any(|line| line.text.trim_start().starts_with('['))
}

#[cfg(test)]
mod tests;
