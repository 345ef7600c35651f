//! Probings as CSV: the axis positions at which a stylus was on the centre of a ball.
//!
//! The header names the columns, in any order: `ball`, one column per axis (mm, degrees), and where they were
//! recorded `S` (spindle angle, degrees), `run`, `time_s`, `sigma_um` (standard uncertainty of one
//! coordinate), `temperature_C` and `A_dir` … (+1 or −1: the direction from which an axis came). Empty lines
//! are skipped.

use super::artefact::Artefact;
use std::collections::HashMap;
use std::ops::{Range, RangeInclusive};
use trueaxis_model::formats::cells::{Cell, cells, lines, separated};
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::source::{FileError, right_case};

/// Where a stylus was on the centre of a ball.
#[derive(Clone, Debug, PartialEq)]
pub struct Probing {
    /// Which ball, as an index into [`Probings::balls`].
    pub ball: usize,
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Direction from which each axis came: +1, −1, or 0 if unknown.
    pub direction: PerAxis,
    /// Angle of the spindle (deg).
    pub spindle: f64,
    /// Number of the run.
    pub run: Option<f64>,
    /// When (s).
    pub time: Option<f64>,
    /// Standard uncertainty of one coordinate (mm).
    pub sigma: Option<f64>,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// The line of the file, counted from 1.
    pub line: usize,
}

/// All probings of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Probings {
    /// Names of the balls, in the order of their first rows.
    pub balls: Vec<String>,
    /// The rows.
    pub rows: Vec<Probing>,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Column {
    Ball,
    Axis(usize),
    Direction(usize),
    Spindle,
    Run,
    Time,
    Sigma,
    Temperature,
}

/// Names of the columns that are not axes.
const NAMES: [(&str, Column); 6] = [
    ("ball", Column::Ball),
    ("S", Column::Spindle),
    ("run", Column::Run),
    ("time_s", Column::Time),
    ("sigma_um", Column::Sigma),
    ("temperature_C", Column::Temperature),
];

/// Standard uncertainties (µm) that can be: files have nine digits, and nothing is a metre off.
const SIGMAS: RangeInclusive<f64> = 1e-6..=1e6;
/// Beyond this (mm, deg) the travel an axis is somewhere else: travels are not exact.
const BEYOND: f64 = 1e-3;

/// Reads them; with `linear` false without columns of linear axes, which are then 0: a strategy.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: another separator, a column that is unknown, missing
/// or there twice, a row that is too short or too long, what is not a finite number, a position outside the
/// travel, rotary positions that look like radians, a direction that is none, the same row twice.
pub fn read(text: &str, machine: &Machine, linear: bool) -> Result<Probings, FileError> {
    let needed = needed(machine, linear);
    let header = format!(
        "ball,{}",
        needed
            .iter()
            .map(|i| machine.axes[*i].letter.to_string())
            .collect::<Vec<_>>()
            .join(",")
    );
    let mut lines = lines(text);
    let Some((first, start)) = lines.next() else {
        return Err(FileError::whole(
            "the file is empty",
            format!("start it with a header, for example {header}, then one probing per line"),
        ));
    };
    if let Some(error) = separated(first, start) {
        return Err(error);
    }
    let columns = read_header(&cells(first, start), machine, &needed, &header)?;
    let mut probings = Probings::default();
    let mut seen = HashMap::new();
    let (mut number, mut counted) = (1, 0);
    let mut last = start..start + first.len();
    for (line, start) in lines {
        if let Some(error) = separated(line, start) {
            return Err(error);
        }
        last = start..start + line.len();
        number += text[counted..start].matches('\n').count();
        counted = start;
        let row = read_row(
            &cells(line, start),
            last.clone(),
            &columns,
            machine,
            &mut probings,
            number,
        )?;
        if let Some(twin) = seen.insert(key(&row), number) {
            return Err(FileError::at(
                last,
                format!("this row is the same as line {twin}"),
                "the same once more",
                "remove one of the two; rows of repeated runs get a column `run`",
            ));
        }
        probings.rows.push(row);
    }
    if probings.rows.is_empty() {
        return Err(FileError::at(
            last,
            "there are no probings below the header",
            "the only line",
            "write one probing per line, in mm and degrees",
        ));
    }
    looks_like_radians(text, &probings, machine)?;
    Ok(probings)
}

/// Refuses balls that an artefact does not have, if it has any; `text` is where the probings were read.
///
/// # Errors
/// [`FileError`] with the first row of such a ball.
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

/// Where a column stands in a line of the file, counted from 1; all of the line if it does not.
fn place(text: &str, line: usize, column: &str) -> Range<usize> {
    let header = lines(text).next().map(|(first, start)| cells(first, start));
    let index = header.and_then(|names| names.iter().position(|(name, _)| *name == column));
    let start: usize = text
        .split_inclusive('\n')
        .take(line - 1)
        .map(str::len)
        .sum();
    let row = text[start..].lines().next().unwrap_or_default();
    let cell = index.and_then(|i| cells(row, start).into_iter().nth(i));
    cell.map_or(start..start + row.len(), |(_, span)| span)
}

/// The axes that must have a column.
fn needed(machine: &Machine, linear: bool) -> Vec<usize> {
    let is_needed = |i: &usize| linear || machine.axes[*i].letter.is_rotary();
    (0..machine.axes.len()).filter(is_needed).collect()
}

/// What two rows have in common if one is a copy of the other.
fn key(row: &Probing) -> (usize, Vec<Option<u64>>) {
    let some = row
        .position
        .iter()
        .chain(&row.direction)
        .chain([&row.spindle]);
    let others = [row.run, row.time, row.sigma, row.temperature];
    let values = some.map(|v| Some(*v)).chain(others);
    (row.ball, values.map(|v| v.map(f64::to_bits)).collect())
}

fn read_header(
    cells: &[Cell<'_>],
    machine: &Machine,
    needed: &[usize],
    header: &str,
) -> Result<Vec<Column>, FileError> {
    let column = |name: &str| -> Option<Column> {
        let axis = |name: &str| {
            let mut letters = name.chars();
            let letter = letters.next()?;
            letters
                .next()
                .is_none()
                .then(|| machine.index(letter))
                .flatten()
        };
        let named = NAMES.iter().find(|(n, _)| *n == name).map(|(_, c)| *c);
        named.or_else(|| axis(name).map(Column::Axis)).or_else(|| {
            name.strip_suffix("_dir")
                .and_then(axis)
                .map(Column::Direction)
        })
    };
    let mut columns = Vec::new();
    for (name, span) in cells {
        let Some(found) = column(name) else {
            return Err(FileError::at(
                span.clone(),
                format!("column {}: `{name}` is not known", columns.len() + 1),
                "unknown column",
                match right_case(name, |n| column(n).is_some()) {
                    Some(right) => format!("write {right}"),
                    None => format!(
                        "write {header}, and S, run, time_s, sigma_um, temperature_C or A_dir where they were recorded"
                    ),
                },
            ));
        };
        if columns.contains(&found) {
            return Err(FileError::at(
                span.clone(),
                format!("column {}: `{name}` is listed twice", columns.len() + 1),
                "the second one",
                "keep one of the two columns",
            ));
        }
        columns.push(found);
    }
    let whole = cells.first().map_or(0, |c| c.1.start)..cells.last().map_or(0, |c| c.1.end);
    let missing = |name: String| {
        FileError::at(
            whole.clone(),
            format!("the column `{name}` is missing"),
            "the header",
            format!("the header is {header}, in any order"),
        )
    };
    if !columns.contains(&Column::Ball) {
        return Err(missing("ball".to_owned()));
    }
    match needed
        .iter()
        .find(|i| !columns.contains(&Column::Axis(**i)))
    {
        Some(i) => Err(missing(machine.axes[*i].letter.to_string())),
        None => Ok(columns),
    }
}

fn read_row(
    cells: &[Cell<'_>],
    whole: Range<usize>,
    columns: &[Column],
    machine: &Machine,
    probings: &mut Probings,
    line: usize,
) -> Result<Probing, FileError> {
    if cells.len() != columns.len() {
        return Err(FileError::at(
            whole,
            format!(
                "the row has {} columns, the header has {}",
                cells.len(),
                columns.len()
            ),
            "here",
            "one value per column of the header, with a decimal point, not a comma",
        ));
    }
    let mut row = Probing {
        ball: 0,
        position: [0.0; MAX_AXES],
        direction: [0.0; MAX_AXES],
        spindle: 0.0,
        run: None,
        time: None,
        sigma: None,
        temperature: None,
        line,
    };
    for ((text, span), column) in cells.iter().zip(columns) {
        let span = if span.is_empty() {
            whole.clone()
        } else {
            span.clone()
        };
        if *column == Column::Ball {
            if text.is_empty() {
                return Err(FileError::at(
                    span,
                    "the ball has no name",
                    "here",
                    "write which ball it is",
                ));
            }
            let known = probings.balls.iter().position(|name| name == text);
            row.ball = known.unwrap_or_else(|| {
                probings.balls.push((*text).to_owned());
                probings.balls.len() - 1
            });
            continue;
        }
        let Some(value) = text.parse::<f64>().ok().filter(|v| v.is_finite()) else {
            return Err(FileError::at(
                span,
                format!("`{text}` is not a finite number"),
                "not a number",
                "write numbers in mm and degrees with a decimal point: 12.5",
            ));
        };
        match *column {
            Column::Ball => {}
            Column::Axis(i) => {
                let axis = &machine.axes[i];
                let [low, high] = axis.travel;
                if !axis.modulo && !(low - BEYOND..=high + BEYOND).contains(&value) {
                    return Err(FileError::at(
                        span,
                        format!(
                            "{} = {value} is outside the travel of {low} to {high}",
                            axis.letter
                        ),
                        "outside the travel",
                        "correct the row, or the range of the axis in the machine file",
                    ));
                }
                row.position[i] = value;
            }
            Column::Direction(i) if value == 1.0 || value == -1.0 || value == 0.0 => {
                row.direction[i] = value;
            }
            Column::Direction(_) => {
                return Err(FileError::at(
                    span,
                    format!("`{text}` is not a direction"),
                    "here",
                    "write 1 after positive travel, -1 after negative travel, 0 if it is not known",
                ));
            }
            Column::Spindle => row.spindle = value,
            Column::Run => row.run = Some(value),
            Column::Time => row.time = Some(value),
            Column::Temperature => row.temperature = Some(value),
            Column::Sigma if SIGMAS.contains(&value) => row.sigma = Some(value * 1e-3),
            Column::Sigma => {
                return Err(FileError::at(
                    span,
                    format!("{value} µm is not an uncertainty of a probing"),
                    "here",
                    "write the standard uncertainty of one coordinate in µm, more than 0",
                ));
            }
        }
    }
    Ok(row)
}

/// Largest rotary position (deg) of a file that may be in radians: 2π is 6.28.
const RADIANS: f64 = 6.3;
/// Half degrees, of which most strategies consist, as nearly as radians are written.
const STEP: f64 = 0.5;
const NEARLY: f64 = 0.01;

/// Positions that are half degrees if they are radians, and are not if they are degrees.
fn looks_like_radians(text: &str, probings: &Probings, machine: &Machine) -> Result<(), FileError> {
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

/// How a row is written in a column.
type Written = Box<dyn Fn(&Probing) -> String>;

/// Writes them: the columns that any row has, positions with nine decimals.
#[must_use]
pub fn write(probings: &Probings, machine: &Machine) -> String {
    written(probings, machine, true)
}

/// Writes what is to be probed: without linear axes and uncertainties.
#[must_use]
pub fn write_strategy(strategy: &Probings, machine: &Machine) -> String {
    let mut strategy = strategy.clone();
    for row in &mut strategy.rows {
        row.sigma = None;
    }
    written(&strategy, machine, false)
}

fn written(probings: &Probings, machine: &Machine, linear: bool) -> String {
    type Of = fn(&Probing) -> Option<f64>;
    let mut columns: Vec<(String, Written)> = Vec::new();
    for i in needed(machine, linear) {
        let of: Written = match linear {
            true => Box::new(move |row| format!("{:.9}", row.position[i])),
            false => Box::new(move |row| row.position[i].to_string()),
        };
        columns.push((machine.axes[i].letter.to_string(), of));
    }
    for (i, axis) in machine.axes.iter().enumerate() {
        if probings.rows.iter().any(|row| row.direction[i] != 0.0) {
            columns.push((
                format!("{}_dir", axis.letter),
                Box::new(move |row| row.direction[i].to_string()),
            ));
        }
    }
    let others: [(&str, Of); 5] = [
        ("S", |row| Some(row.spindle)),
        ("run", |row| row.run),
        ("time_s", |row| row.time),
        ("sigma_um", |row| row.sigma.map(|s| s * 1e3)),
        ("temperature_C", |row| row.temperature),
    ];
    for (name, of) in others {
        let is_there = |row: &Probing| of(row).is_some_and(|v| name != "S" || v != 0.0);
        if probings.rows.iter().any(is_there) {
            columns.push((
                name.to_owned(),
                Box::new(move |row| of(row).unwrap_or(0.0).to_string()),
            ));
        }
    }
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = format!("ball,{}\n", names.join(","));
    for row in &probings.rows {
        text += &probings.balls[row.ball];
        for (_, cell) in &columns {
            text.push(',');
            text += &cell(row);
        }
        text.push('\n');
    }
    text
}
