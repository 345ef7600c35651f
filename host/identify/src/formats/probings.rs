//! Probings as CSV: the axis positions at which a stylus was at the centre of a ball.
//!
//! The header names the columns, in any order: `ball`, one column per axis (mm, degrees), and optionally `S`
//! (spindle angle, degrees), `run`, `time_s`, `sigma_um` (standard uncertainty of one coordinate), `temperature_C`,
//! `A_dir` … (+1 or −1: the direction from which an axis arrived), and columns of [`temperatures`]: `NAME_C` and `cycle`.
//! Empty lines are ignored.

mod checks;

pub use checks::have_known_balls;

use super::{axis, direction, position, temperatures};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use trueaxis_model::formats::csv::{CsvRow, CsvTable};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::source::FileError;

/// One probing: the stylus was at the centre of a ball.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Probing {
    /// The ball, as an index into [`Probings::balls`].
    pub ball: usize,
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Direction from which each axis arrived: +1, −1, or 0 if unknown.
    pub direction: PerAxis,
    /// Angle of the spindle (deg).
    pub spindle: f64,
    /// Number of the run.
    pub run: Option<f64>,
    /// Time (s).
    pub time: Option<f64>,
    /// Standard uncertainty of one coordinate (mm).
    pub sigma: Option<f64>,
    /// Temperature (°C).
    pub temperature: Option<f64>,
    /// The line of the file, counted from 1.
    pub line: usize,
}

/// All probings of a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Probings {
    /// Names of the balls, in order of first appearance.
    pub balls: Vec<String>,
    /// The rows.
    pub rows: Vec<Probing>,
}

impl Probings {
    /// The rows of all files, each of which is a run, or has runs of its own. If files have balls of their own, those of a further
    /// one have its name.
    #[must_use]
    pub fn joined(files: Vec<(String, Self)>, have_own_balls: bool) -> Self {
        let is_alone = files.len() == 1;
        let mut all = Self::default();
        // The largest number of a run so far.
        let mut runs = 0.0_f64;
        for (number, (name, file)) in files.into_iter().enumerate() {
            let before = runs;
            for mut row in file.rows {
                let ball = &file.balls[row.ball];
                row.ball = match number > 0 && have_own_balls {
                    true => ball_index(&mut all.balls, &format!("{ball} of {name}")),
                    false => ball_index(&mut all.balls, ball),
                };
                if !is_alone {
                    let run = before + row.run.unwrap_or(1.0);
                    runs = runs.max(run);
                    row.run = Some(run);
                }
                all.rows.push(row);
            }
        }
        all
    }
}

/// The index of a ball, which is added if it is new.
pub fn ball_index(balls: &mut Vec<String>, name: &str) -> usize {
    let known = balls.iter().position(|ball| ball == name);
    known.unwrap_or_else(|| {
        balls.push(name.to_owned());
        balls.len() - 1
    })
}

/// Content of a column.
#[derive(Clone, Debug, PartialEq)]
enum ProbingColumn {
    Ball,
    Axis(usize),
    Direction(usize),
    Spindle,
    Run,
    Time,
    Sigma,
    Temperature,
    Cycle,
    /// A temperature for [`temperatures::read`].
    Sensor(String),
}

/// Names of the columns that are not axes.
const NAMES: [(&str, ProbingColumn); 7] = [
    ("ball", ProbingColumn::Ball),
    ("S", ProbingColumn::Spindle),
    ("run", ProbingColumn::Run),
    ("time_s", ProbingColumn::Time),
    ("sigma_um", ProbingColumn::Sigma),
    ("temperature_C", ProbingColumn::Temperature),
    ("cycle", ProbingColumn::Cycle),
];

/// Permitted standard uncertainties (µm): files have nine digits, and no error is as large as a metre.
const SIGMAS: RangeInclusive<f64> = 1e-6..=1e6;
const VALUES: &str = "write one value per column of the header, in mm and degrees with a decimal point, not a comma: 12.5";

impl ProbingColumn {
    /// The column with a name.
    fn named(name: &str, machine: &Machine) -> Option<Self> {
        let axis = |name: &str| axis(name, machine);
        let named = (NAMES.iter())
            .find(|(n, _)| *n == name)
            .map(|(_, c)| c.clone());
        let direction = || axis(name.strip_suffix("_dir")?).map(Self::Direction);
        named
            .or_else(|| axis(name).map(Self::Axis))
            .or_else(direction)
            .or_else(|| Some(Self::Sensor(temperatures::sensor(name)?.to_owned())))
    }
}

/// Reads probings, or, if `linear` is false, a plan without columns of linear axes, which are then 0.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: whatever [`CsvTable`] refuses, a missing column, a position
/// outside the travel, rotary positions that look like radians, an impossible direction or uncertainty, a repeated
/// row.
pub fn read(text: &str, machine: &Machine, linear: bool) -> Result<Probings, FileError> {
    let needed = needed(machine, linear);
    let letters = needed.iter().map(|i| machine.axes[*i].letter.to_string());
    let layout = format!(
        "write the header ball,{} in any order, with S, run, time_s, sigma_um, temperature_C, NAME_C of other sensors or A_dir where they were recorded, then one probing per line",
        letters.collect::<Vec<_>>().join(",")
    );
    let table = CsvTable::open(text, 0, layout, VALUES)?;
    let columns = table.columns(0, |name| ProbingColumn::named(name, machine))?;
    let ball = columns.iter().position(|c| *c == ProbingColumn::Ball);
    let ball = ball.ok_or_else(|| table.missing("ball"))?;
    let lacks = |i: &&usize| !columns.contains(&ProbingColumn::Axis(**i));
    if let Some(i) = needed.iter().find(lacks) {
        return Err(table.missing(machine.axes[*i].letter));
    }
    let mut probings = Probings::default();
    let mut indices = HashMap::new();
    let mut seen = HashMap::new();
    for row in table {
        let row = row?;
        let name = row.text(ball)?;
        let index = *indices.entry(name).or_insert_with(|| {
            probings.balls.push(name.to_owned());
            probings.balls.len() - 1
        });
        let probing = probing(&row, &columns, machine, index)?;
        if let Some(twin) = seen.insert(key(&probing), row.line) {
            return Err(FileError::at(
                row.span,
                format!("this row is the same as line {twin}"),
                "the same once more",
                "remove one of the two; rows of repeated runs get a column `run`",
            ));
        }
        probings.rows.push(probing);
    }
    checks::are_degrees(text, &probings, machine)?;
    Ok(probings)
}

/// The axes that require a column.
fn needed(machine: &Machine, linear: bool) -> Vec<usize> {
    let is_needed = |i: &usize| linear || machine.axes[*i].letter.is_rotary();
    (0..machine.axes.len()).filter(is_needed).collect()
}

/// The values that are equal if one row is a copy of another.
fn key(row: &Probing) -> (usize, Vec<Option<u64>>) {
    let some = (row.position.iter())
        .chain(&row.direction)
        .chain([&row.spindle]);
    let others = [row.run, row.time, row.sigma, row.temperature];
    let values = some.map(|v| Some(*v)).chain(others);
    (row.ball, values.map(|v| v.map(f64::to_bits)).collect())
}

fn probing(
    row: &CsvRow<'_>,
    columns: &[ProbingColumn],
    machine: &Machine,
    ball: usize,
) -> Result<Probing, FileError> {
    let mut probing = Probing {
        ball,
        line: row.line,
        ..Probing::default()
    };
    for (k, column) in columns.iter().enumerate() {
        if *column == ProbingColumn::Ball {
            continue;
        }
        let value = row.number(k)?;
        match *column {
            ProbingColumn::Ball | ProbingColumn::Cycle => {}
            ProbingColumn::Sensor(_) => _ = temperatures::celsius(row, k)?,
            ProbingColumn::Axis(i) => probing.position[i] = position(row, k, &machine.axes[i])?,
            ProbingColumn::Direction(i) => probing.direction[i] = direction(row, k)?,
            ProbingColumn::Spindle => probing.spindle = value,
            ProbingColumn::Run => probing.run = Some(value),
            ProbingColumn::Time => probing.time = Some(value),
            ProbingColumn::Temperature => probing.temperature = Some(value),
            ProbingColumn::Sigma if SIGMAS.contains(&value) => probing.sigma = Some(value * 1e-3),
            ProbingColumn::Sigma => {
                return Err(row.error(
                    k,
                    format!("{value} µm cannot be the uncertainty of a probing"),
                    "here",
                    "write the standard uncertainty of one coordinate in µm, more than 0",
                ));
            }
        }
    }
    Ok(probing)
}

/// Formats a row's value in a column.
type CellWriter = Box<dyn Fn(&Probing) -> String>;

/// Writes probings: all columns that any row has, positions with nine decimals.
#[must_use]
pub fn write(probings: &Probings, machine: &Machine) -> String {
    written(probings, machine, true)
}

/// Writes a plan: without linear axes and uncertainties.
#[must_use]
pub fn write_plan(plan: &Probings, machine: &Machine) -> String {
    let mut plan = plan.clone();
    for row in &mut plan.rows {
        row.sigma = None;
    }
    written(&plan, machine, false)
}

fn written(probings: &Probings, machine: &Machine, linear: bool) -> String {
    type Of = fn(&Probing) -> Option<f64>;
    let mut columns: Vec<(String, CellWriter)> = Vec::new();
    for i in needed(machine, linear) {
        let of: CellWriter = match linear {
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
    table(probings, &columns)
}

fn table(probings: &Probings, columns: &[(String, CellWriter)]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = format!("ball,{}\n", names.join(","));
    for row in &probings.rows {
        text += &probings.balls[row.ball];
        for (_, cell) in columns {
            text.push(',');
            text += &cell(row);
        }
        text.push('\n');
    }
    text
}
