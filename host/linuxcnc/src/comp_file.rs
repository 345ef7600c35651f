//! Files of `COMP_FILE`: one per joint, what the joint's own position calls for.
//!
//! A line has a position p and a value after positive and after negative travel: the position that is reached (type 0)
//! or the correction that is added to the command (type 1). In between, corrections are linear, and constant outside;
//! after a reversal LinuxCNC passes smoothly to the other column. At most 256 lines, read until the first that is not
//! three numbers. Sources: LinuxCNC's manual, *INI Configuration*, `COMP_FILE`, and `compute_screw_comp` of its motion
//! controller.

use crate::configuration::{Configuration, JointAxis};
use std::fmt::Write;
use trueaxis::Travel;
use trueaxis_export::difference::{Difference, differences};
use trueaxis_export::positions::{random_of, travel};
use trueaxis_export::sampled::{Nodes, OtherAxes};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::source::FileError;
use trueaxis_model::validate::{Command, Runtime};

/// Largest number of lines.
const MOST_LINES: usize = 256;

/// `COMP_FILE_TYPE`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// 0: the positions that are reached.
    Positions,
    /// 1: corrections.
    Corrections,
}

/// A joint's position, and its correction after positive and after negative travel, in the unit of the joint.
pub type CompFileRow = [f64; 3];

/// Reads a file. An empty one has no rows.
///
/// # Errors
/// [`FileError`]: a line that LinuxCNC does not read.
pub fn read(text: &str, kind: Type) -> Result<Vec<CompFileRow>, FileError> {
    let mut rows: Vec<CompFileRow> = Vec::new();
    let mut start = 0;
    for line in text.trim_end().split_inclusive('\n') {
        let span = start..start + line.trim_end().len();
        start += line.len();
        let bad = |message: &str, remedy: &str| FileError::here(span.clone(), message, remedy);
        let mut words = line.split_whitespace().map(|word| word.parse::<f64>());
        let (Some(Ok(p)), Some(Ok(forward)), Some(Ok(reverse))) =
            (words.next(), words.next(), words.next())
        else {
            return Err(bad(
                "not three numbers: LinuxCNC reads no further",
                "write position, and value after positive and after negative travel; no comments",
            ));
        };
        if ![p, forward, reverse].iter().all(|v| v.is_finite()) {
            return Err(bad("a number that is not finite", "write a finite one"));
        }
        if rows.last().is_some_and(|last| last[0] >= p) {
            return Err(bad("positions must increase", "sort the lines by position"));
        }
        if rows.len() == MOST_LINES {
            return Err(bad(
                "more than 256 lines: LinuxCNC refuses the file",
                "leave out lines between which the correction is nearly a straight line",
            ));
        }
        rows.push(match kind {
            Type::Positions => [p, p - forward, p - reverse],
            Type::Corrections => [p, forward, reverse],
        });
    }
    Ok(rows)
}

/// The text of a file. Six decimals: nanometres, or 25 nm in inches.
fn print(rows: &[CompFileRow], kind: Type) -> String {
    let mut text = String::new();
    for [p, forward, reverse] in rows {
        let values = match kind {
            // From the position as it is written, so that rounding it does not count.
            Type::Positions => {
                let p = (p * 1e6).round() / 1e6;
                [p - forward, p - reverse]
            }
            Type::Corrections => [*forward, *reverse],
        };
        let _ = writeln!(text, "{p:.6} {:.6} {:.6}", values[0] + 0.0, values[1] + 0.0);
    }
    text
}

/// The correction of a joint at a position after positive or negative travel, as LinuxCNC computes it.
fn correction(rows: &[CompFileRow], position: f64, travel: Travel) -> f64 {
    let column = match travel {
        Travel::Negative => 2,
        _ => 1,
    };
    let after = rows.partition_point(|row| row[0] <= position);
    match (after.checked_sub(1).map(|k| rows[k]), rows.get(after)) {
        (None, None) => 0.0,
        (None, Some(first)) => first[column],
        (Some(last), None) => last[column],
        (Some(a), Some(b)) => {
            a[column] + (b[column] - a[column]) / (b[0] - a[0]) * (position - a[0])
        }
    }
}

/// A file of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct CompFile {
    /// The joint.
    pub joint: JointAxis,
    /// Content of the file.
    pub text: String,
    /// Number of lines.
    pub lines: usize,
}

/// Why no files can be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// An axis of the compensation has no joint.
    #[error("the compensation has the axis {0}, and no joint of the INI file moves it")]
    NoJoint(char),
    /// What was written is not read.
    #[error("the written file cannot be read back: {0}, in {1}")]
    Read(Box<FileError>, String),
}

/// Numbers of lines that are tried.
const LINES: [usize; 9] = [2, 3, 5, 9, 17, 33, 65, 129, MOST_LINES];
/// What more lines must gain (µm, µrad): the finest tolerance of a compensation.
const GAIN: f64 = 0.05;

/// Writes a file for each joint that a compensation corrects, with as few lines as make no difference, or as many as
/// given. An axis without limits gets none, because LinuxCNC's files do not repeat after a turn. Reads the files again and
/// compares them with the compensation at random positions over the travel, each axis after positive or negative travel.
///
/// # Errors
/// [`ExportError`]
pub fn export(
    runtime: &Runtime<'_>,
    configuration: &Configuration,
    kind: Type,
    lines: Option<usize>,
    positions: usize,
    seed: u64,
) -> Result<(Vec<CompFile>, Vec<Difference>), ExportError> {
    let axes = runtime.compensation().axes();
    let joints = configuration.axes();
    let mut commands = random_of(runtime.compensation(), positions, seed);
    for travel in commands.iter_mut().flat_map(|command| &mut command.travel) {
        // Before its first motion a joint has no direction, and no correction.
        if *travel == Travel::Unknown {
            *travel = Travel::Positive;
        }
    }
    let mut files = Vec::new();
    let mut tables: Vec<Option<(Vec<CompFileRow>, f64)>> = vec![None; axes.len()];
    for (i, axis) in axes.iter().enumerate() {
        let letter = char::from(axis.name);
        let own: Vec<&JointAxis> = joints.iter().filter(|j| j.letter == letter).collect();
        let first = **own.first().ok_or(ExportError::NoJoint(letter))?;
        if axis.period > 0.0 {
            continue;
        }
        let unit = configuration.unit(first);
        let made = |count| {
            let text = print(&sample(runtime, i, count, unit, &commands), kind);
            let rows =
                read(&text, kind).map_err(|bad| ExportError::Read(bad.into(), text.clone()))?;
            let left = differences(runtime, &commands, |command| {
                let mut found = [0.0; MAX_AXES];
                found[i] = of_axis(&rows, unit, command, i);
                found
            });
            Ok((text, rows, left[i].difference))
        };
        let most = made(lines.unwrap_or(MOST_LINES))?;
        let fewer = LINES.into_iter().filter(|_| lines.is_none());
        let fewer: Vec<_> = fewer.map(made).collect::<Result<_, _>>()?;
        let enough = most.2 + GAIN;
        let mut tried = fewer.into_iter().chain([most]);
        let Some((text, rows, _)) = tried.find(|(_, _, left)| *left <= enough) else {
            continue;
        };
        if rows.iter().all(|row| row[1] == 0.0 && row[2] == 0.0) {
            continue;
        }
        for joint in own {
            let (text, lines) = (text.clone(), rows.len());
            files.push(CompFile {
                joint: *joint,
                text,
                lines,
            });
        }
        tables[i] = Some((rows, unit));
    }
    let found = differences(runtime, &commands, |command| {
        let mut found = [0.0; MAX_AXES];
        for (i, table) in tables.iter().enumerate() {
            if let Some((rows, unit)) = table {
                found[i] = of_axis(rows, *unit, command, i);
            }
        }
        found
    });
    Ok((files, found))
}

/// The correction of an axis (mm, deg).
fn of_axis(rows: &[CompFileRow], unit: f64, command: &Command, axis: usize) -> f64 {
    let position = f64::from(command.axes[axis]) / unit;
    correction(rows, position, command.travel[axis]) * unit
}

/// What an axis' own position calls for, in `count` lines over its travel: the middle of what its correction is
/// anywhere in the travel of the others. `unit` is the size of the joint's unit (mm, deg).
fn sample(
    runtime: &Runtime<'_>,
    axis: usize,
    count: usize,
    unit: f64,
    commands: &[Command],
) -> Vec<CompFileRow> {
    let axes = runtime.compensation().axes();
    let rest = OtherAxes::new(axes, &[axis], commands);
    let nodes = Nodes::over(travel(&axes[axis]), count);
    let row = |k: usize| {
        let [forward, reverse] = [Travel::Positive, Travel::Negative].map(|direction| {
            let set = |command: &mut Command| {
                command.axes[axis] = nodes.at(k) as f32;
                command.travel[axis] = direction;
            };
            rest.middle(set, |command| [f64::from(runtime.evaluate(command)[axis])])[0]
        });
        [nodes.at(k), forward, reverse].map(|value| value / unit)
    };
    (0..count).map(row).collect()
}

#[cfg(test)]
mod tests;
