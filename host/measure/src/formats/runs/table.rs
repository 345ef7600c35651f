//! The readings: a line for each target, a column for each run.

use super::heading::Readings;
use crate::direct::{Column, Line, Setup};
use std::ops::Range;
use trueaxis_model::formats::cells::{Cell, cells, lines, separated};
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// The most targets and runs of a file.
const MAX_TARGETS: usize = 10_000;
const MAX_RUNS: usize = 1_000;
/// Beyond this (mm, deg) the travel an axis is somewhere else: travels are not exact.
const BEYOND: f64 = 1e-3;
/// Largest reading (mm, rad) that is one of an error.
const LARGEST: [f64; 2] = [100.0, 0.1];

const REMEDY: &str = "write target,+1,-1,+2,-2 …: a column for each run, with the direction of travel before its number";

/// Targets and runs of one line.
pub fn read(
    text: &str,
    start: usize,
    machine: &Machine,
    setup: &Setup,
    readings: Readings,
) -> Result<(Vec<f64>, Vec<Column>), FileError> {
    let mut table = Table::open(text, start, &["target"])?;
    let mut targets = Vec::new();
    let mut columns = table.columns();
    while let Some(row) = table.next(text)? {
        table.row(
            &row.0,
            &row.1,
            0,
            machine,
            setup,
            readings,
            &mut targets,
            &mut columns,
        )?;
    }
    enough(&targets, start..text.len(), "the axis")?;
    if setup.is_positioning() && !readings.are_positions {
        are_deviations(
            &targets,
            &columns,
            machine,
            setup,
            readings,
            start..text.len(),
        )?;
    }
    Ok((targets, columns))
}

/// The same of the two lines of a square.
pub(crate) fn read_square(
    text: &str,
    start: usize,
    machine: &Machine,
    setups: &[Setup],
    readings: Readings,
) -> Result<[Line; 2], FileError> {
    let mut table = Table::open(text, start, &["line", "target"])?;
    let mut found: Vec<Line> = (setups.iter())
        .map(|setup| Line {
            setup: setup.clone(),
            targets: Vec::new(),
            columns: table.columns(),
        })
        .collect();
    while let Some((row, whole)) = table.next(text)? {
        let (name, span) = &row[0];
        let letter = |line: &Line| machine.axes[line.setup.moved].letter.to_string();
        let Some(line) = found.iter_mut().find(|line| letter(line) == *name) else {
            return Err(FileError::at(
                span.clone(),
                format!("`{name}` is not a line of this square"),
                "unknown line",
                "write the axis that moves along the line, one of the two in reads_along",
            ));
        };
        let Line {
            setup,
            targets,
            columns,
        } = line;
        table.row(&row, &whole, 1, machine, setup, readings, targets, columns)?;
    }
    for line in &found {
        let letter = machine.axes[line.setup.moved].letter;
        enough(&line.targets, start..text.len(), &format!("{letter}"))?;
    }
    found
        .try_into()
        .map_err(|_| FileError::whole("a square has two lines", "write reads_along with two axes"))
}

fn enough(targets: &[f64], all: Range<usize>, what: &str) -> Result<(), FileError> {
    match targets.len() {
        0 | 1 => Err(FileError::at(
            all,
            format!("{what} has {} targets, not at least two", targets.len()),
            "here",
            "write a line for each target position",
        )),
        n if n > MAX_TARGETS => Err(FileError::at(
            all,
            format!("{what} has {n} targets, more than {MAX_TARGETS}"),
            "here",
            "leave out targets between which the error is a straight line within its uncertainty",
        )),
        _ => Ok(()),
    }
}

/// A target in mm or rad.
fn size(target: f64, setup: &Setup) -> f64 {
    match setup.is_angular() {
        true => target.to_radians(),
        false => target,
    }
}

/// Readings that follow their targets by this much and 1 are positions: no axis is off by a tenth of its way, and
/// none by as many units as its targets are apart.
const FOLLOWS: f64 = 0.02;

/// Refuses positions that were written as deviations.
fn are_deviations(
    targets: &[f64],
    columns: &[Column],
    machine: &Machine,
    setup: &Setup,
    readings: Readings,
    all: Range<usize>,
) -> Result<(), FileError> {
    let count = targets.len() as f64;
    let middle = targets.iter().sum::<f64>() / count;
    let square: f64 = targets.iter().map(|t| (t - middle).powi(2)).sum();
    let step = targets.windows(2).map(|w| size(w[1] - w[0], setup));
    let step = step.fold(f64::INFINITY, f64::min);
    let unit = machine.axes[setup.moved].unit();
    for column in columns {
        let rise: f64 = (targets.iter().zip(&column.readings))
            .map(|(target, reading)| (target - middle) * reading)
            .sum();
        // As it is, and as if the numbers were in the unit of the targets.
        let slope = rise / square / size(1.0, setup);
        let of_numbers = rise / square / readings.factor;
        if [slope, of_numbers]
            .iter()
            .any(|s| (s.abs() - 1.0).abs() < FOLLOWS)
        {
            return Err(FileError::at(
                all,
                "the readings follow their targets: they are positions, not deviations",
                "these",
                format!(
                    "readings are positions: say # reads_position = true, with # unit = \"{unit}\" if that is what they are in"
                ),
            ));
        }
        let most = column
            .readings
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        let least = column
            .readings
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        if most - least > step {
            return Err(FileError::at(
                all,
                "deviations differ by more than a step between targets",
                "these",
                "if the readings are positions, say # reads_position = true; else correct unit",
            ));
        }
    }
    Ok(())
}

/// A table that is read row by row.
struct Table {
    directions: Vec<f64>,
    width: usize,
    /// Where the next row starts.
    next: usize,
}

type Row<'t> = (Vec<Cell<'t>>, Range<usize>);

impl Table {
    /// Reads the header.
    fn open(text: &str, start: usize, first: &[&str]) -> Result<Self, FileError> {
        let Some((line, at)) = lines(&text[start..]).next() else {
            return Err(FileError::whole("there are no readings", REMEDY));
        };
        let at = at + start;
        if let Some(error) = separated(line, at) {
            return Err(error);
        }
        let cells = cells(line, at);
        let names: Vec<&str> = cells.iter().map(|(name, _)| *name).collect();
        if !names.starts_with(first) || names.len() == first.len() {
            return Err(FileError::at(
                at..at + line.len(),
                format!(
                    "the header does not begin with {} and a run",
                    first.join(",")
                ),
                "here",
                match first {
                    ["target"] => REMEDY.to_owned(),
                    _ => format!("{REMEDY}, after a column `line` with the axis"),
                },
            ));
        }
        if names.len() > MAX_RUNS {
            return Err(FileError::at(
                at..at + line.len(),
                format!("the file has {} columns, more than {MAX_RUNS}", names.len()),
                "here",
                "write a line for each target, a column for each run",
            ));
        }
        let mut directions = Vec::new();
        for (name, span) in &cells[first.len()..] {
            let number = name.get(1..).unwrap_or("");
            let direction = match name.as_bytes().first() {
                Some(b'+') => 1.0,
                Some(b'-') => -1.0,
                _ => 0.0,
            };
            if direction == 0.0 || !number.bytes().all(|b| b.is_ascii_digit()) {
                return Err(FileError::at(
                    span.clone(),
                    format!("`{name}` is not a run with a direction of travel"),
                    "here",
                    REMEDY,
                ));
            }
            directions.push(direction);
        }
        Ok(Self {
            directions,
            width: cells.len(),
            next: at + line.len(),
        })
    }

    fn columns(&self) -> Vec<Column> {
        let new = |direction: &f64| Column {
            direction: *direction,
            readings: Vec::new(),
        };
        self.directions.iter().map(new).collect()
    }

    /// The next row, if there is one.
    fn next<'t>(&mut self, text: &'t str) -> Result<Option<Row<'t>>, FileError> {
        let Some((line, at)) = lines(&text[self.next..]).next() else {
            return Ok(None);
        };
        let at = at + self.next;
        self.next = at + line.len();
        if let Some(error) = separated(line, at) {
            return Err(error);
        }
        let row = cells(line, at);
        if row.len() != self.width {
            return Err(FileError::at(
                at..at + line.len(),
                format!(
                    "the row has {} columns, the header has {}",
                    row.len(),
                    self.width
                ),
                "here",
                "write a reading for every run, with decimal points",
            ));
        }
        Ok(Some((row, at..at + line.len())))
    }

    /// Takes a row whose target is in a column.
    #[expect(clippy::too_many_arguments, reason = "one row of one line")]
    fn row(
        &self,
        row: &[Cell<'_>],
        whole: &Range<usize>,
        first: usize,
        machine: &Machine,
        setup: &Setup,
        readings: Readings,
        targets: &mut Vec<f64>,
        columns: &mut [Column],
    ) -> Result<(), FileError> {
        let number = |(cell, span): &Cell<'_>| match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(FileError::at(
                if span.is_empty() {
                    whole.clone()
                } else {
                    span.clone()
                },
                format!("`{cell}` is not a finite number"),
                "not a number",
                "write a reading for every run, with decimal points",
            )),
        };
        let target = number(&row[first])?;
        let axis = &machine.axes[setup.moved];
        let [low, high] = axis.travel;
        if !(low - BEYOND..=high + BEYOND).contains(&target) {
            return Err(FileError::at(
                row[first].1.clone(),
                format!(
                    "{} = {target} is outside the travel of {low} to {high}",
                    axis.letter
                ),
                "outside the travel",
                format!(
                    "write targets in {} of the command, or correct the range of the axis in the machine file",
                    axis.unit()
                ),
            ));
        }
        if targets.last().is_some_and(|last| *last >= target) {
            return Err(FileError::at(
                row[first].1.clone(),
                format!("the targets do not increase at {target}"),
                "here",
                "sort the rows by target and give each only once; repeated runs are columns",
            ));
        }
        let largest = LARGEST[usize::from(setup.is_angular())];
        for (column, cell) in columns.iter_mut().zip(&row[first + 1..]) {
            let wanted = match readings.are_positions {
                true => size(target, setup),
                false => 0.0,
            };
            let reading = number(cell)? * readings.factor * setup.counts - wanted;
            if reading.abs() > largest {
                return Err(FileError::at(
                    cell.1.clone(),
                    format!("a reading of {} is not an error of a machine", cell.0),
                    "here",
                    "write readings minus targets, or set reads_position = true if the readings are positions, and check the unit",
                ));
            }
            column.readings.push(reading);
        }
        targets.push(target);
        Ok(())
    }
}
