//! The readings: a line for each target, a column for each run.

use super::heading::Readings;
use crate::{AxisRuns, MeasurementSetup, RunColumn};
use std::ops::Range;
use trueaxis_model::formats::csv::{CsvRow, CsvTable};
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::extremes;
use trueaxis_model::positions::is_in_travel;
use trueaxis_model::source::FileError;

/// Largest number of targets and of runs in a file.
const MAX_TARGETS: usize = 10_000;
const MAX_RUNS: usize = 1_000;
/// Largest reading (mm, rad) that an error may cause.
const LARGEST: [f64; 2] = [100.0, 0.1];

const LAYOUT: &str = "write target,+1,-1,+2,-2 …: a column for each run, with the direction of travel before its number; of a square, a column line with the axis before target";
const VALUES: &str = "write a reading for every run, with decimal points";

/// Reads targets and runs of a line, or of both legs of a square.
pub fn read(
    text: &str,
    start: usize,
    machine: &Machine,
    setups: &[MeasurementSetup],
    readings: Readings,
) -> Result<Vec<AxisRuns>, FileError> {
    let is_square = setups.len() > 1;
    let first = &["line", "target"][usize::from(!is_square)..];
    let (table, columns) = open(text, start, first)?;
    let line = |setup: &MeasurementSetup| AxisRuns {
        setup: setup.clone(),
        targets: Vec::new(),
        columns: columns.clone(),
    };
    let mut found: Vec<AxisRuns> = setups.iter().map(line).collect();
    let letter = |line: &AxisRuns| machine.axes[line.setup.moved].letter.to_string();
    for row in table {
        let row = row?;
        let name = row.cells[0].text;
        let is_own = |line: &&mut AxisRuns| !is_square || letter(line) == name;
        let line = found.iter_mut().find(is_own).ok_or_else(|| {
            row.error(
                0,
                format!("`{name}` is not a line of this square"),
                "unknown line",
                "write the axis that moves along the line, one of the two in reads_along",
            )
        })?;
        take(&row, first.len() - 1, machine, readings, line)?;
    }
    for line in &found {
        let what = if is_square {
            letter(line)
        } else {
            "the axis".to_owned()
        };
        enough(&line.targets, start..text.len(), &what)?;
        if line.setup.is_positioning() && !readings.are_positions {
            are_deviations(line, machine, readings, start..text.len())?;
        }
    }
    Ok(found)
}

fn enough(targets: &[f64], all: Range<usize>, what: &str) -> Result<(), FileError> {
    match targets.len() {
        0 | 1 => Err(FileError::here(
            all,
            format!("{what} has {} targets, not at least two", targets.len()),
            "write a line for each target position",
        )),
        n if n > MAX_TARGETS => Err(FileError::here(
            all,
            format!("{what} has {n} targets, more than {MAX_TARGETS}"),
            "leave out targets between which the error is a straight line within its uncertainty",
        )),
        _ => Ok(()),
    }
}

/// Converts a target to mm or rad.
fn size(target: f64, setup: &MeasurementSetup) -> f64 {
    if setup.is_angular() {
        target.to_radians()
    } else {
        target
    }
}

/// Readings whose slope over the targets is 1 within this are positions: no axis has an error of a tenth of its
/// motion, or an error of as many units as its targets are apart.
const FOLLOWS: f64 = 0.02;

/// Refuses positions that were written as deviations.
fn are_deviations(
    line: &AxisRuns,
    machine: &Machine,
    readings: Readings,
    all: Range<usize>,
) -> Result<(), FileError> {
    let (setup, targets) = (&line.setup, &line.targets);
    let middle = targets.iter().sum::<f64>() / targets.len() as f64;
    let square: f64 = targets.iter().map(|t| (t - middle).powi(2)).sum();
    let step = targets.windows(2).map(|w| size(w[1] - w[0], setup));
    let step = step.fold(f64::INFINITY, f64::min);
    let unit = machine.axes[setup.moved].unit();
    let refused =
        |message: &str, remedy: &str| Err(FileError::at(all.clone(), message, "these", remedy));
    for column in &line.columns {
        let rises = targets.iter().zip(&column.readings);
        let rises = rises.map(|(target, reading)| (target - middle) * reading);
        let rise: f64 = rises.sum();
        // As written, and as if the readings were in the unit of the targets.
        let slope = rise / square / size(1.0, setup);
        let of_numbers = rise / square / readings.factor;
        let follows = |slope: &f64| (slope.abs() - 1.0).abs() < FOLLOWS;
        if [slope, of_numbers].iter().any(follows) {
            return refused(
                "the readings follow their targets: they are positions, not deviations",
                &format!(
                    "readings are positions: say # reads_position = true, with # unit = \"{unit}\" if that is what they are in"
                ),
            );
        }
        let [least, most] = extremes(column.readings.iter().copied());
        if most - least > step {
            return refused(
                "deviations differ by more than a step between targets",
                "if the readings are positions, say # reads_position = true; else correct unit",
            );
        }
    }
    Ok(())
}

/// The table, whose columns from `first` on are runs, and these runs without readings yet.
fn open<'t>(
    text: &'t str,
    start: usize,
    first: &[&str],
) -> Result<(CsvTable<'t>, Vec<RunColumn>), FileError> {
    let table = CsvTable::open(text, start, LAYOUT, VALUES)?;
    table.begins_with(first)?;
    let count = table.header.cells.len();
    if count == first.len() {
        return Err(table.wrong_header("the header has no column for a run"));
    }
    if count > MAX_RUNS {
        let message = format!("the file has {count} columns, more than {MAX_RUNS}");
        return Err(table.wrong_header(message));
    }
    let mut columns = Vec::new();
    for (k, cell) in table.header.cells.iter().enumerate().skip(first.len()) {
        let name = cell.text;
        let signs = [('+', 1.0), ('-', -1.0)];
        let signed = |(sign, direction)| Some((name.strip_prefix(sign)?, direction));
        let run = signs.into_iter().find_map(signed);
        let run = run.filter(|(number, _)| number.bytes().all(|b| b.is_ascii_digit()));
        let Some((_, direction)) = run else {
            let message = format!("`{name}` is not a run with a direction of travel");
            return Err(table.header.error(k, message, "here", LAYOUT));
        };
        let mut before = table.header.cells[first.len()..k].iter();
        if before.any(|cell| cell.text == name) && name.len() > 1 {
            let message = format!("`{name}` is there twice");
            return Err(table
                .header
                .error(k, message, "here", "give each run its own number"));
        }
        columns.push(RunColumn {
            direction,
            readings: Vec::new(),
        });
    }
    Ok((table, columns))
}

/// Adds a row: its target, and the readings in the columns that follow.
fn take(
    row: &CsvRow<'_>,
    column: usize,
    machine: &Machine,
    readings: Readings,
    line: &mut AxisRuns,
) -> Result<(), FileError> {
    let AxisRuns {
        setup,
        targets,
        columns,
    } = line;
    let axis = &machine.axes[setup.moved];
    let target = row.increasing(
        column,
        targets.last().copied(),
        "sort the rows by target and give each only once; repeated runs are columns",
    )?;
    let remedy = format!(
        "write targets in {} of the command, or correct the range of the axis in the machine file",
        axis.unit()
    );
    is_in_travel(row, column, axis, target, &remedy)?;
    let largest = LARGEST[usize::from(setup.is_angular())];
    let wanted = readings.are_positions.then(|| size(target, setup));
    for (run, k) in columns.iter_mut().zip(column + 1..) {
        let reading = row.number(k)? * readings.factor * setup.counts - wanted.unwrap_or(0.0);
        if reading.abs() > largest {
            return Err(row.error(
                k,
                format!("a reading of {} is too large for an error of a machine", row.cells[k].text),
                "here",
                "write readings minus targets, or set reads_position = true if the readings are positions, and check the unit",
            ));
        }
        run.readings.push(reading);
    }
    targets.push(target);
    Ok(())
}
