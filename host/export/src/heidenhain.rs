//! KinematicsComp of a Heidenhain iTNC 530 HSCI: the error motions of each axis, to enter in its `.COM` table.
//!
//! A line has a position of the axis (`AXISPOS`) and the errors there: by the recommendation of the technical manual, EXX to
//! EZX in the columns C1 to C3 and EAX to ECX in C4 to C6, which entries of the kinematics description take in before the
//! axis. Sources: technical manuals iTNC 530 HSCI (KinematicsComp) and MANUALplus 620 (`.COM` tables). They do not say in
//! which unit an angle is entered, so that must be chosen, nor how a control combines the errors: a rigid body that moves
//! back its tip is assumed. So the values are plain CSV with a header that says so. No control has run it.

use crate::NotExported;
use crate::rigid_body::{AxisErrors, Chain, RemainingErrors};
use crate::text_lines::lines;
use std::fmt::Write;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Unit of the columns C4 to C6.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Angles {
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
}

impl Angles {
    /// Size of a unit in rad.
    fn size(self) -> f64 {
        match self {
            Self::Deg => 1_f64.to_radians(),
            Self::Rad => 1.0,
        }
    }
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct HeidenhainTable {
    /// Letter of its axis.
    pub axis: char,
    /// Text of the table.
    pub text: String,
}

/// The names of the columns.
const COLUMNS: [&str; 8] = ["NR", "AXISPOS", "C1", "C2", "C3", "C4", "C5", "C6"];

/// Writes a table for each axis with `points` over its travel, reads them again, and drives the machine with what they
/// correct, at `positions` random commands in both directions of travel.
///
/// # Errors
/// [`NotExported`] if what was written is not read.
pub fn export(
    machine: &Machine,
    errors: &ErrorModel,
    points: usize,
    angles: Angles,
    positions: usize,
    seed: u64,
) -> Result<(Vec<HeidenhainTable>, RemainingErrors), NotExported> {
    let chain = Chain::new(machine);
    let motions = chain.motions(errors, points);
    let files: Vec<HeidenhainTable> = (machine.axes.iter().zip(&motions))
        .map(|(axis, motions)| HeidenhainTable {
            axis: axis.letter.char(),
            text: print(axis.letter.char(), motions, angles),
        })
        .collect();
    let again = files.iter().map(|file| read(&file.text, angles));
    let again: Result<Vec<AxisErrors>, _> = again.collect();
    let again = again.map_err(NotExported::unread)?;
    let left = chain.left(errors, &again, positions, seed);
    Ok((files, left))
}

fn print(axis: char, motions: &AxisErrors, angles: Angles) -> String {
    let unit = match angles {
        Angles::Deg => "deg",
        Angles::Rad => "rad",
    };
    let mut text = format!(
        "# trueaxis: errors of axis {axis} for KinematicsComp of a Heidenhain iTNC 530: C1 to C3 in mm, C4 to C6 in {unit}\n\
         # plain CSV: the unit of angles in the control's tables is not public, so check it and enter the values\n\
         {}\n",
        COLUMNS.join(",")
    );
    for (number, (at, error)) in motions.at.iter().zip(&motions.errors).enumerate() {
        let _ = write!(text, "{number},{at:.6}");
        for (k, value) in error.iter().enumerate() {
            let value = if k < 3 { *value } else { value / angles.size() };
            // Nanometres; 1e-9 of a unit.
            let value = (value * 1e9).round() / 1e9 + 0.0;
            let _ = write!(text, ",{value:.9}");
        }
        text.push('\n');
    }
    text
}

/// Reads a table with the columns that are written here, in any order.
///
/// # Errors
/// [`FileError`]
fn read(text: &str, angles: Angles) -> Result<AxisErrors, FileError> {
    let remedy = "give the table as it was written";
    let short = || FileError::whole("the table ends too early", remedy);
    let all = lines(text);
    let mut rows = all.iter().filter(|line| !line.text.starts_with('#'));
    let head = rows.next().ok_or_else(short)?;
    let names: Vec<&str> = head.text.split(',').collect();
    let column = |name: &str| {
        let found = names.iter().position(|n| *n == name);
        found.ok_or_else(|| head.bad(format!("there is no column {name}"), remedy))
    };
    let position = column("AXISPOS")?;
    let errors = COLUMNS[2..].iter().map(|name| column(name));
    let errors: Vec<usize> = errors.collect::<Result<_, _>>()?;
    let mut motions = AxisErrors::default();
    for line in rows {
        let words: Vec<&str> = line.text.split(',').collect();
        if words.len() != names.len() {
            return Err(line.bad(
                format!("{} values below {} names", words.len(), names.len()),
                remedy,
            ));
        }
        let at = line.number(words[position])?;
        if motions.at.last().is_some_and(|last| *last >= at) {
            return Err(line.bad("positions must increase", "sort the lines by position"));
        }
        let mut error = [0.0; 6];
        for (k, (error, column)) in error.iter_mut().zip(&errors).enumerate() {
            let size = if k < 3 { 1.0 } else { angles.size() };
            *error = line.number(words[*column])? * size;
        }
        motions.at.push(at);
        motions.errors.push(error);
    }
    match motions.at.is_empty() {
        false => Ok(motions),
        true => Err(short()),
    }
}

#[cfg(test)]
mod tests;
