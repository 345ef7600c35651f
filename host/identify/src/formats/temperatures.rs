//! Temperatures over time as CSV, and what error parameters see of them: differences from a reference, with a lag.
//!
//! The columns are `time_s`, `NAME_C` for each sensor (°C), and `cycle` (a number) where a warm-up or cool-down begins
//! that is to be left out as a whole. Without it, a new cycle begins after each gap in time. A file of probings or
//! observations with these columns is read, too.

use std::ops::Range;
use trueaxis_model::errors::{MAX_SENSORS, Parameter, Thermal};
use trueaxis_model::formats::csv::{self, CsvRow, CsvTable};
use trueaxis_model::numbers::{ascending, by};
use trueaxis_model::source::FileError;

/// Temperatures of sensors over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Temperatures {
    /// Names of the sensors.
    pub sensors: Vec<String>,
    /// The readings in the order of their times.
    pub readings: Vec<Celsius>,
}

/// The temperatures at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Celsius {
    /// Time (s), by the clock of the measurements.
    pub time: f64,
    /// Warm-up or cool-down, counted from 0.
    pub cycle: usize,
    /// True after a gap in time: nothing is known of what was before, and lags start at this reading.
    pub is_first: bool,
    /// Of each sensor (°C).
    pub celsius: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
enum TemperatureColumn {
    Time,
    Cycle,
    Sensor(String),
    /// What is measured, in a file of probings or observations.
    Other(String),
}

const COLUMNS: &str =
    "write the header time_s, a column NAME_C for each sensor, and cycle where cycles are numbered";
/// Columns that only a file of measurements has.
const MEASURED: [&str; 2] = ["ball", "kind"];
const VALUES: &str = "write one row for each time, with a temperature in °C in each column";
/// Temperatures (°C) that a sensor on a machine can read.
const CELSIUS: Range<f64> = -60.0..200.0;
/// A gap is this many times as long as the median time between readings, and at least this long (s).
const GAP: f64 = 5.0;
const SHORTEST_GAP: f64 = 600.0;

/// The name of the sensor of a column `NAME_C`.
pub(super) fn sensor(column: &str) -> Option<&str> {
    let name = column.strip_suffix("_C")?;
    (1..=16).contains(&name.len()).then_some(name)
}

/// The temperature (°C) in a column.
pub(super) fn celsius(row: &CsvRow<'_>, column: usize) -> Result<f64, FileError> {
    let value = row.number(column)?;
    if CELSIUS.contains(&value) {
        return Ok(value);
    }
    let message = format!("{value} °C is no temperature of a machine");
    Err(row.error(column, message, "here", VALUES))
}

/// Reads a file. Rows of measurements may be in any order, and those without all temperatures are left out; of rows at the
/// same time, the first counts.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: whatever [`CsvTable`] refuses, missing columns, times that do not increase,
/// temperatures that no sensor reads, names that a compensation cannot hold, fewer than two rows.
pub fn read(text: &str) -> Result<Temperatures, FileError> {
    let (_, start): (toml::Table, usize) = csv::heading(text, COLUMNS)?;
    let table = CsvTable::open(text, start, COLUMNS, VALUES)?;
    let mut names = table.header.cells.iter().map(|cell| cell.text);
    let is_measured = names.any(|name| MEASURED.contains(&name));
    let columns = table.columns(0, |name| match name {
        "time_s" => Some(TemperatureColumn::Time),
        "cycle" => Some(TemperatureColumn::Cycle),
        _ => match sensor(name) {
            Some(sensor) => Some(TemperatureColumn::Sensor(sensor.to_owned())),
            None => is_measured.then(|| TemperatureColumn::Other(name.to_owned())),
        },
    })?;
    let place = |column: &TemperatureColumn| columns.iter().position(|c| c == column);
    let time = place(&TemperatureColumn::Time).ok_or_else(|| table.missing("time_s"))?;
    let cycle = place(&TemperatureColumn::Cycle);
    let sensors: Vec<(usize, String)> = (columns.iter().enumerate())
        .filter_map(|(k, column)| match column {
            TemperatureColumn::Sensor(name) => Some((k, name.clone())),
            _ => None,
        })
        .collect();
    if sensors.is_empty() {
        return Err(table.wrong_header("there is no column with temperatures"));
    }
    let rows = rows(table, is_measured, time, cycle, &sensors)?;
    let readings = in_order(rows)?;
    Ok(Temperatures {
        sensors: sensors.into_iter().map(|(_, name)| name).collect(),
        readings,
    })
}

/// A row, and the number of its cycle, if the file says it.
type LabelledRow = (Celsius, Option<i64>);

fn rows(
    table: CsvTable<'_>,
    is_measured: bool,
    time: usize,
    cycle: Option<usize>,
    sensors: &[(usize, String)],
) -> Result<Vec<LabelledRow>, FileError> {
    let mut rows: Vec<LabelledRow> = Vec::new();
    for row in table {
        let row = row?;
        let is_empty = |(column, _): &(usize, String)| row.cells[*column].text.is_empty();
        if is_measured && sensors.iter().any(is_empty) {
            continue;
        }
        let last = rows.last().filter(|_| !is_measured);
        let last = last.map(|(reading, _)| reading.time);
        let temperatures = sensors.iter().map(|(column, _)| celsius(&row, *column));
        let temperatures = temperatures.collect::<Result<_, _>>()?;
        let label = cycle.map(|column| row.number(column)).transpose()?;
        let reading = Celsius {
            time: row.increasing(time, last, "write the rows in the order of their times")?,
            cycle: 0,
            is_first: false,
            celsius: temperatures,
        };
        rows.push((reading, label.map(|label| label as i64)));
    }
    Ok(rows)
}

/// The rows in the order of their times, divided into cycles.
fn in_order(rows: Vec<LabelledRow>) -> Result<Vec<Celsius>, FileError> {
    let mut rows = by(rows, |(reading, _)| reading.time);
    rows.dedup_by(|later, first| later.0.time == first.0.time);
    let (mut readings, labels): (Vec<Celsius>, Vec<Option<i64>>) = rows.into_iter().unzip();
    let labels: Vec<i64> = labels.into_iter().flatten().collect();
    if readings.len() < 2 {
        return Err(FileError::whole(
            "temperatures need at least two rows",
            VALUES,
        ));
    }
    divide(&mut readings, &labels);
    Ok(readings)
}

/// Finds gaps, and numbers the cycles: by `labels`, or from gap to gap.
fn divide(readings: &mut [Celsius], labels: &[i64]) {
    let mut steps: Vec<f64> = readings.windows(2).map(|w| w[1].time - w[0].time).collect();
    let gap = {
        let mut sorted = steps.clone();
        ascending(&mut sorted);
        (GAP * sorted[sorted.len() / 2]).max(SHORTEST_GAP)
    };
    steps.insert(0, f64::INFINITY);
    let mut known: Vec<i64> = Vec::new();
    let mut gaps = 0;
    for (i, (reading, step)) in readings.iter_mut().zip(steps).enumerate() {
        reading.is_first = step >= gap;
        gaps += usize::from(reading.is_first);
        reading.cycle = match labels.get(i) {
            None => gaps - 1,
            Some(label) => known.iter().position(|k| k == label).unwrap_or_else(|| {
                known.push(*label);
                known.len() - 1
            }),
        };
    }
}

impl Temperatures {
    /// Number of cycles.
    #[must_use]
    pub fn cycles(&self) -> usize {
        self.readings.iter().map(|r| r.cycle + 1).max().unwrap_or(0)
    }

    /// The reading at or before a time (s), if the time is within the file and not in a gap.
    fn before(&self, time: f64) -> Option<usize> {
        let after = self.readings.partition_point(|r| r.time <= time);
        let before = after.checked_sub(1)?;
        match self.readings.get(after) {
            None => (self.readings[before].time == time).then_some(before),
            Some(next) if next.is_first && self.readings[before].time < time => None,
            Some(_) => Some(before),
        }
    }

    /// The cycle at a time (s); `None` outside the file and in gaps.
    #[must_use]
    pub fn cycle_at(&self, time: f64) -> Option<usize> {
        Some(self.readings[self.before(time)?].cycle)
    }

    /// The differences of a sensor (by its number) from a reference (°C), at every reading, after a first-order lag of
    /// `lag` s (0: none). Between readings the temperature changes steadily. After a gap it starts at the reading, as a
    /// controller does when it is switched on.
    #[must_use]
    pub fn kelvin(&self, sensor: usize, reference: f64, lag: f64) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::with_capacity(self.readings.len());
        let mut last: Option<&Celsius> = None;
        for reading in &self.readings {
            let u = reading.celsius[sensor] - reference;
            let value = match (last, found.last()) {
                (Some(last), Some(y)) if lag > 0.0 && !reading.is_first => {
                    let before = last.celsius[sensor] - reference;
                    let h = (reading.time - last.time) / lag;
                    let slope = (u - before) / h;
                    // y' = (u − y)/τ with u steady from `before` to `u` in h·τ.
                    u - slope + (y - before + slope) * libm::exp(-h)
                }
                _ => u,
            };
            found.push(value);
            last = Some(reading);
        }
        found
    }

    /// A value at a time (s) from the values at the readings, on a straight line between them; `None` outside the file
    /// and in gaps.
    #[must_use]
    pub fn at(&self, values: &[f64], time: f64) -> Option<f64> {
        let before = self.before(time)?;
        let Some(next) = self.readings.get(before + 1) else {
            return Some(values[before]);
        };
        let span = next.time - self.readings[before].time;
        let part = (time - self.readings[before].time) / span;
        Some(values[before] + part * (values[before + 1] - values[before]))
    }
}

/// Temperatures on which parameters depend, and by how much is to be found.
#[derive(Clone, Debug, PartialEq)]
pub struct ThermalModel {
    /// The temperatures over time.
    pub log: Temperatures,
    /// Sensors with their lags.
    pub inputs: Vec<Thermal>,
    /// The parameters that change with one of `inputs` (by its number).
    pub terms: Vec<(Parameter, usize)>,
    /// Standard uncertainty of each term (per kelvin) because other temperatures, lags and terms could have been chosen.
    pub choice: Vec<f64>,
    /// `inputs` at every reading of the log (K).
    pub kelvin: Vec<Vec<f64>>,
    /// What they leave of another cycle (mm, 95 % of coordinates).
    pub left: Option<f64>,
}

impl ThermalModel {
    /// The differences from the references (K) at a time (s); zero outside the log.
    #[must_use]
    pub fn at(&self, time: Option<f64>) -> [f64; MAX_SENSORS] {
        let mut all = [0.0; MAX_SENSORS];
        for (kelvin, values) in all.iter_mut().zip(&self.kelvin) {
            *kelvin = time.and_then(|t| self.log.at(values, t)).unwrap_or(0.0);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_the_exact_solution_for_a_ramp_and_restarts_after_a_gap() {
        let rows: String = (0..200)
            .map(|k| format!("{},{}\n", 10 * k, 20.0 + 0.01 * f64::from(k)))
            .chain((0..3).map(|k| format!("{},30\n", 10_000 + 10 * k)))
            .collect();
        let found = read(&format!("time_s,bed_C\n{rows}")).unwrap();
        assert_eq!((found.cycles(), found.sensors.len()), (2, 1));
        let tau = 300.0;
        let lagged = found.kelvin(0, 20.0, tau);
        for (reading, y) in found.readings.iter().zip(&lagged).take(200) {
            let t = reading.time;
            let exact = 1e-3 * (t - tau * (1.0 - libm::exp(-t / tau)));
            assert!((y - exact).abs() < 1e-12, "{t}: {y} {exact}");
        }
        assert_eq!(lagged[200], 10.0);
        assert_eq!(found.at(&lagged, 5000.0), None);
        assert_eq!(found.cycle_at(10_005.0), Some(1));
        let half = found.at(&found.kelvin(0, 20.0, 0.0), 15.0).unwrap();
        assert!((half - 0.015).abs() < 1e-12);
    }

    #[test]
    fn cycles_are_numbered_by_their_column() {
        let found = read("time_s,cycle,bed_C\n0,7,20\n1,7,21\n2,3,20\n3,7,20\n").unwrap();
        let cycles: Vec<usize> = found.readings.iter().map(|r| r.cycle).collect();
        assert_eq!(cycles, [0, 0, 1, 0]);
    }

    #[test]
    fn rows_of_measurements_are_a_log() {
        let log = read("time_s,cycle,bed_C\n0,1,20\n60,1,21.5\n120,2,22\n").unwrap();
        let rows = "kind,time_s,bed_C,cycle\npoint,60,21.5,1\npoint,0,20,1\npoint,0,20,1\npoint,90,,1\npoint,120,22,2\n";
        assert_eq!(read(rows).unwrap(), log);
        let heading = format!("# [setup.camera]\n{rows}");
        assert_eq!(read(&heading).unwrap(), log);
        let message = read("ball,X,bed_C\n1,0,20\n").unwrap_err().message;
        assert!(message.contains("time_s"), "{message}");
    }

    #[test]
    fn what_is_not_a_log_is_refused_with_its_place() {
        for (text, cause) in [
            ("time_s\n0\n1\n", "no column with temperatures"),
            ("bed_C\n20\n21\n", "time_s"),
            ("time_s,bed_C\n0,20\n0,21\n", "must increase"),
            ("time_s,bed_C\n0,20\n1,900\n", "900 °C"),
            ("time_s,bed_C\n0,20\n", "at least two rows"),
            (
                "time_s,a name that is too long_C\n0,20\n",
                "not a known column",
            ),
        ] {
            let message = read(text).unwrap_err().message;
            assert!(message.contains(cause), "{message}");
        }
    }
}
