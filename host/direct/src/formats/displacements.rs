//! Readings of displacement sensors at a spindle over time, for tests to ISO 230-3, as CSV.

use crate::iso230_3::{Displacements, DriftReading, SENSORS, Test};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use trueaxis_model::formats::csv::{self, CsvRow, CsvTable};
use trueaxis_model::source::FileError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DisplacementHeading {
    test: Option<Spanned<String>>,
    axis: Option<Spanned<String>>,
    sensors_apart_mm: Option<Spanned<f64>>,
    stops_at_s: Option<Spanned<f64>>,
    #[serde(rename = "machine")]
    _machine: Option<String>,
}

const HEADING: &str =
    "begin the file with # test = \"environment\", \"spindle\" or \"axis\", in a line of its own";
const COLUMNS: &str = "name the columns: time_s, then x1_um, y1_um, x2_um, y2_um, z_um as far as there are sensors, position_mm for an axis, and temperatures such as air_C";
const VALUES: &str = "write one value per column, with a decimal point";
/// Largest plausible distance between sensors, and position (mm).
const FAR: f64 = 1e4;
/// Largest plausible reading (µm).
pub(super) const LARGE: f64 = 1e4;
const TEMPERATURES: Range<f64> = -50.0..200.0;

/// Where the columns are.
struct DisplacementColumns {
    time: usize,
    position: Option<usize>,
    sensors: [Option<usize>; 5],
    temperatures: Vec<(usize, String)>,
}

impl DisplacementColumns {
    fn of(table: &CsvTable<'_>) -> Result<Self, FileError> {
        let is_known = |name: &str| {
            let place = name.strip_suffix("_C");
            ["time_s", "position_mm"].contains(&name)
                || sensor(name).is_some()
                || place.is_some_and(|place| !place.is_empty())
        };
        let columns = table.columns(0, |name| is_known(name).then(|| name.to_owned()))?;
        let place = |name: &str| columns.iter().position(|c| c == name);
        let time = place("time_s").ok_or_else(|| table.missing("time_s"))?;
        let position = place("position_mm");
        let sensors = sensors(table, &columns)?;
        let temperatures = columns.iter().enumerate();
        let temperatures = temperatures
            .filter_map(|(k, name)| Some((k, name.strip_suffix("_C")?.to_owned())))
            .collect();
        Ok(Self {
            time,
            position,
            sensors,
            temperatures,
        })
    }

    /// Checks that there is a position just where an axis moves.
    fn fit(&self, table: &CsvTable<'_>, test: Test) -> Result<(), FileError> {
        match (test, self.position) {
            (Test::Axis(_), None) => Err(table.missing("position_mm")),
            (Test::Environment | Test::Spindle, Some(_)) => Err(table
                .wrong_header("there is a column `position_mm`, but no axis moves in this test")),
            _ => Ok(()),
        }
    }

    fn reading(
        &self,
        row: &CsvRow<'_>,
        last: Option<&DriftReading>,
    ) -> Result<DriftReading, FileError> {
        let displacements = displacements(row, self.sensors)?;
        let celsius = self.temperatures.iter();
        let celsius = celsius.map(|(column, _)| within(row, *column, TEMPERATURES, "°C"));
        let last = last.map(|reading| reading.time);
        Ok(DriftReading {
            time: row.increasing(
                self.time,
                last,
                "write the rows in the order of their times",
            )?,
            position: (self.position)
                .map(|column| within(row, column, -FAR..FAR, "mm"))
                .transpose()?,
            displacements,
            celsius: celsius.collect::<Result<_, _>>()?,
        })
    }
}

/// The readings (mm) of sensors; 0 for one that is not there.
pub(super) fn displacements(
    row: &CsvRow<'_>,
    sensors: [Option<usize>; 5],
) -> Result<[f64; 5], FileError> {
    let mut read = [0.0; 5];
    for (value, column) in read.iter_mut().zip(sensors) {
        if let Some(column) = column {
            *value = within(row, column, -LARGE..LARGE, "µm")? * 1e-3;
        }
    }
    Ok(read)
}

/// Reads a file.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: whatever [`CsvTable`] refuses, an unknown test, missing columns, times that do
/// not increase, readings that no sensor gives.
pub fn read(text: &str) -> Result<Displacements, FileError> {
    let (heading, end): (DisplacementHeading, usize) = csv::heading(text, HEADING)?;
    let table = CsvTable::open(text, end, COLUMNS, VALUES)?;
    let columns = DisplacementColumns::of(&table)?;
    let test = heading.test()?;
    columns.fit(&table, test)?;
    let mut readings: Vec<DriftReading> = Vec::new();
    for row in table {
        readings.push(columns.reading(&row?, readings.last())?);
    }
    if readings.len() < 2 {
        return Err(FileError::whole(
            "a drift needs at least two readings",
            "write one row for each time at which the sensors were read",
        ));
    }
    Ok(Displacements {
        test,
        apart: apart(heading.sensors_apart_mm.as_ref())?,
        stop: heading.stop(&readings)?,
        sensors: columns.sensors.map(|column| column.is_some()),
        temperatures: (columns.temperatures.into_iter())
            .map(|(_, place)| place)
            .collect(),
        readings,
    })
}

/// The sensor, by its place in [`SENSORS`], of a column such as `x1_um`.
pub(super) fn sensor(column: &str) -> Option<usize> {
    let is = |sensor: &&str| format!("{}_um", sensor.to_lowercase()) == column;
    SENSORS.iter().position(is)
}

/// The columns of the sensors; there is at least one.
pub(super) fn sensors(
    table: &CsvTable<'_>,
    columns: &[String],
) -> Result<[Option<usize>; 5], FileError> {
    let all = std::array::from_fn(|k| columns.iter().position(|c| sensor(c) == Some(k)));
    match all == [None; 5] {
        true => Err(table.wrong_header("there is no column with readings of a sensor")),
        false => Ok(all),
    }
}

/// A number in a column that must be within a range.
pub(super) fn within(
    row: &CsvRow<'_>,
    column: usize,
    range: Range<f64>,
    unit: &str,
) -> Result<f64, FileError> {
    let value = row.number(column)?;
    match range.contains(&value) {
        true => Ok(value),
        false => Err(row.error(
            column,
            format!("{value} {unit} is larger than any value of such a test"),
            "here",
            VALUES,
        )),
    }
}

/// How far the sensors 2 are from the sensors 1 (mm), if that is stated.
pub(super) fn apart(stated: Option<&Spanned<f64>>) -> Result<Option<f64>, FileError> {
    let Some(apart) = stated else {
        return Ok(None);
    };
    match (0.1..FAR).contains(&apart.get_ref().abs()) {
        true => Ok(Some(*apart.get_ref())),
        false => Err(FileError::here(
            apart.span(),
            format!("sensors cannot be {} mm apart", apart.get_ref()),
            "write how far X2 and Y2 are from X1 and Y1 in +Z, in mm",
        )),
    }
}

impl DisplacementHeading {
    fn test(&self) -> Result<Test, FileError> {
        let Some(test) = &self.test else {
            return Err(FileError::whole("the file does not say `test`", HEADING));
        };
        match (&test.get_ref()[..], &self.axis) {
            ("environment", None) => Ok(Test::Environment),
            ("spindle", None) => Ok(Test::Spindle),
            ("axis", Some(axis)) => match axis.get_ref().parse() {
                Ok(letter @ 'X'..='Z') => Ok(Test::Axis(letter)),
                _ => Err(FileError::here(
                    axis.span(),
                    format!(
                        "`{}` is not a linear axis with sensors along it",
                        axis.get_ref()
                    ),
                    "write # axis = \"X\", \"Y\" or \"Z\"",
                )),
            },
            ("axis", None) => Err(FileError::here(
                test.span(),
                "the file does not say which axis moved",
                "add # axis = \"X\"",
            )),
            ("environment" | "spindle", Some(axis)) => Err(FileError::here(
                axis.span(),
                "no axis moves in this test",
                "leave out `axis`, or write # test = \"axis\"",
            )),
            (name, _) => Err(FileError::here(
                test.span(),
                format!("`{name}` is not a known test"),
                HEADING,
            )),
        }
    }

    fn stop(&self, readings: &[DriftReading]) -> Result<Option<f64>, FileError> {
        let Some(stop) = &self.stops_at_s else {
            return Ok(None);
        };
        let [first, last] = [readings.first(), readings.last()].map(|r| r.map_or(0.0, |r| r.time));
        match (first..=last).contains(stop.get_ref()) {
            true => Ok(Some(*stop.get_ref())),
            false => Err(FileError::here(
                stop.span(),
                format!(
                    "nothing was read at {} s: the readings are from {first} to {last} s",
                    stop.get_ref()
                ),
                "write the time at which the motion stopped, or leave it out",
            )),
        }
    }
}
