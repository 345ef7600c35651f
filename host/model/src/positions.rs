//! Positions and corrections as CSV.
//!
//! The header names the inputs in any order: axes by their letter, the tool length as `tool length` or `length`,
//! temperature sensors by their name. Numbers are in mm, degrees and K (difference from the reference), with a
//! decimal point. Empty lines are skipped. The order of the rows is the motion.

use crate::errors::{Thermal, temperature_name};
use crate::formats::csv::{CsvRow, CsvTable};
use crate::machine::{self, Machine};
use crate::source::FileError;
use std::fmt::{Display, Write};
use trueaxis::{Auxiliary, AuxiliaryKind, Axis, Lag};

/// An input that needs a column.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnInput {
    /// Name in messages of the input.
    pub name: String,
    /// An alternative name.
    pub alias: Option<&'static str>,
    /// A description for messages.
    pub meaning: String,
    /// Of a temperature with a lag: the name of the sensor, and 1/τ (1/s).
    pub lag: Option<(String, f32)>,
}

/// Name of the tool length as an input.
pub(crate) const TOOL_LENGTH: &str = "tool length";

impl ColumnInput {
    fn axis(letter: char) -> Self {
        Self {
            name: letter.to_string(),
            alias: None,
            meaning: format!("axis {letter}"),
            lag: None,
        }
    }

    fn tool_length(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            alias: Some("length"),
            meaning: "the tool length in mm".to_owned(),
            lag: None,
        }
    }

    fn sensor(sensor: &str, lag_rate: f32) -> Self {
        let name = temperature_name(sensor, lag_rate);
        Self {
            alias: None,
            meaning: format!("temperature `{name}` in K from its reference"),
            lag: (lag_rate > 0.0).then(|| (sensor.to_owned(), lag_rate)),
            name,
        }
    }

    /// The inputs of a compensation: axes, then auxiliaries, in its order.
    #[must_use]
    pub fn of_compensation(axes: &[Axis], auxiliaries: &[Auxiliary]) -> Vec<Self> {
        let axes = axes.iter().map(|a| Self::axis(char::from(a.name)));
        let auxiliaries = auxiliaries.iter().map(|a| match a.kind {
            AuxiliaryKind::ToolLength => Self::tool_length(&a.name),
            AuxiliaryKind::Temperature => Self::sensor(&a.name, a.sensor.lag_rate),
        });
        axes.chain(auxiliaries).collect()
    }

    /// The inputs of a machine with its temperatures: axes, the tool length if it is an input, temperatures.
    #[must_use]
    pub fn of_machine<'a>(
        machine: &Machine,
        temperatures: impl IntoIterator<Item = &'a Thermal>,
    ) -> Vec<Self> {
        let axes = machine.axes.iter().map(|a| Self::axis(a.letter.char()));
        let length = machine.length_range.map(|_| Self::tool_length(TOOL_LENGTH));
        let temperatures =
            (temperatures.into_iter()).map(|t| Self::sensor(&t.sensor, t.lag_rate()));
        axes.chain(length).chain(temperatures).collect()
    }

    /// True for a temperature with a lag behind this sensor.
    fn lags_behind(&self, sensor: &str) -> bool {
        self.lag.as_ref().is_some_and(|(name, _)| name == sensor)
    }
}

/// Recorded positions are not exact: an axis may be this far (mm, deg) beyond its travel.
const BEYOND: f64 = 1e-3;

/// Checks that a position (mm, deg) read from a column is within the travel of an axis.
///
/// # Errors
/// [`FileError`] with this remedy: it is not.
pub fn is_in_travel(
    row: &CsvRow<'_>,
    column: usize,
    axis: &machine::Axis,
    position: f64,
    remedy: &str,
) -> Result<(), FileError> {
    let [low, high] = axis.travel;
    if (low - BEYOND..=high + BEYOND).contains(&position) {
        return Ok(());
    }
    let message = format!(
        "{} = {position} is outside the travel of {low} to {high}",
        axis.letter
    );
    Err(row.error(column, message, "outside the travel", remedy))
}

const VALUES: &str = "give every position a value in each column: a plain number in mm or degrees with a decimal point, not a comma: -12.5";

/// Content of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PositionColumn {
    Input(usize),
    /// The sensor of the lagging input with this number.
    Sensor(usize),
    Time,
}

/// A column, and the lag to apply to it (1/τ, 1/s).
type InputSource = (usize, Option<f32>);

/// Period of a controller (s) in which lags are stepped between rows.
const PERIOD: f64 = 0.01;

/// Reads positions: one row per position, with values in the order of `inputs`. With a column `time_s`, an input with a
/// lag may have the column of its sensor instead of its own: it follows from row to row, with the temperature of a row
/// since the one before.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: whatever [`CsvTable`] refuses, a column that is not an input, an
/// input without a column, a value that is not finite as f32, times that do not increase, no rows.
pub fn read(text: &str, inputs: &[ColumnInput]) -> Result<Vec<Vec<f64>>, FileError> {
    let names: Vec<&str> = inputs.iter().map(|i| i.name.as_str()).collect();
    let layout = format!(
        "write the header {} (exactly the inputs, in any order), then one position per line in mm and degrees",
        names.join(",")
    );
    let table = CsvTable::open(text, 0, layout, VALUES)?;
    let columns = table.columns(0, |name| {
        let exact = inputs.iter().position(|i| i.name == name);
        let known = exact.or_else(|| inputs.iter().position(|i| i.alias == Some(name)));
        let lagging = || inputs.iter().position(|i| i.lags_behind(name));
        let is_time = name == "time_s" && inputs.iter().any(|i| i.lag.is_some());
        known
            .map(PositionColumn::Input)
            .or_else(|| is_time.then_some(PositionColumn::Time))
            .or_else(|| lagging().map(PositionColumn::Sensor))
    })?;
    let place = |column: PositionColumn| columns.iter().position(|c| *c == column);
    let time = place(PositionColumn::Time);
    let mut sources = Vec::with_capacity(inputs.len());
    for number in 0..inputs.len() {
        let Some(source) = source(inputs, number, &columns) else {
            let mut error = table.missing(&inputs[number].name);
            let input = &inputs[number];
            error.remedy = format!("add {}: {}", input.meaning, error.remedy);
            if let Some((sensor, _)) = &input.lag {
                error.remedy += &format!("; or time_s and {sensor}");
            }
            return Err(error);
        };
        sources.push(source);
    }
    rows(table, time, &sources)
}

/// The column of an input, and the lag to apply to it.
fn source(
    inputs: &[ColumnInput],
    number: usize,
    columns: &[PositionColumn],
) -> Option<InputSource> {
    let place = |column: PositionColumn| columns.iter().position(|c| *c == column);
    if let Some(own) = place(PositionColumn::Input(number)) {
        return Some((own, None));
    }
    let (sensor, rate) = inputs[number].lag.as_ref()?;
    place(PositionColumn::Time)?;
    let same = inputs.iter().position(|i| i.name == *sensor);
    let first = inputs.iter().position(|i| i.lags_behind(sensor))?;
    let column = same.map_or(PositionColumn::Sensor(first), PositionColumn::Input);
    Some((place(column)?, Some(*rate)))
}

fn rows(
    table: CsvTable<'_>,
    time: Option<usize>,
    sources: &[InputSource],
) -> Result<Vec<Vec<f64>>, FileError> {
    let mut lags = vec![Lag::NEW; sources.len()];
    let mut last: Option<f64> = None;
    let mut rows = Vec::new();
    for row in table {
        let row = row?;
        let now = time.map(|column| {
            row.increasing(column, last, "write the rows in the order of their times")
        });
        let now = now.transpose()?;
        let elapsed = now.zip(last).map_or(0.0, |(now, last)| now - last);
        let mut position = vec![0.0; sources.len()];
        let each = position.iter_mut().zip(sources).zip(&mut lags);
        for ((place, (column, rate)), lag) in each {
            let value = row.number(*column)?;
            // The runtime computes in f32, where the value must also be finite.
            if !(value as f32).is_finite() {
                let message = format!("{value:e} is too large for a position");
                return Err(row.error(*column, message, "too large", VALUES));
            }
            *place = rate.map_or(value, |rate| follow(lag, value as f32, rate, elapsed));
        }
        last = now;
        rows.push(position);
    }
    Ok(rows)
}

/// A lag after `elapsed` s in periods of a controller; beyond a day of them in as many longer ones.
fn follow(lag: &mut Lag, value: f32, rate: f32, elapsed: f64) -> f64 {
    let periods = (elapsed / PERIOD).ceil().clamp(1.0, 8_640_000.0);
    let dt = (elapsed / periods) as f32;
    let mut y = value;
    for _ in 0..periods as u32 {
        y = lag.follow(value, rate, dt);
    }
    f64::from(y)
}

/// Corrections as CSV, `dX,dY,…`, each with the fewest digits that read back as the same number.
#[must_use]
pub fn write<T: Display>(letters: &[char], rows: &[Vec<T>]) -> String {
    let header: Vec<String> = letters.iter().map(|l| format!("d{l}")).collect();
    let mut text = header.join(",");
    text.push('\n');
    for row in rows {
        for (column, value) in row.iter().enumerate() {
            let comma = if column == 0 { "" } else { "," };
            // Writing to a string cannot fail.
            let _ = write!(text, "{comma}{value}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inputs() -> Vec<ColumnInput> {
        vec![
            ColumnInput::axis('X'),
            ColumnInput::axis('A'),
            ColumnInput::tool_length(TOOL_LENGTH),
        ]
    }

    #[test]
    fn columns_are_found_by_name_in_any_order() {
        let text = "\u{feff}length, \"A\" ,X\r\n100,2,1\r\n\r\n110,-4.5,3e1\r\n";
        assert_eq!(
            read(text, &inputs()).unwrap(),
            [vec![1.0, 2.0, 100.0], vec![30.0, -4.5, 110.0]]
        );
    }

    #[test]
    fn every_mistake_is_reported_with_line_and_place() {
        for (text, line, message, marked) in [
            (
                "X,A,Q\n1,2,3\n",
                1,
                "column 3: `Q` is not a known column",
                "Q",
            ),
            ("X,A,A\n1,2,3\n", 1, "column 3: `A` is listed twice", "A"),
            (
                "X,A\n1,2\n",
                1,
                "the column `tool length` is missing",
                "X,A",
            ),
            (
                "X,A,length\n",
                1,
                "there are no rows below the header",
                "X,A,length",
            ),
            (
                "X,A,length\n1,2\n",
                2,
                "the row has 2 columns, the header has 3",
                "1,2",
            ),
            (
                "X,A,length\n1,2,3\n1,2,3,4\n",
                3,
                "the row has 4 columns, the header has 3",
                "4",
            ),
            (
                "X,A,length\n1,,3\n",
                2,
                "column 2 (A): the value is missing",
                "1,,3",
            ),
            (
                "X,A,length\n1,two,3\n",
                2,
                "column 2 (A): `two` is not a finite number",
                "two",
            ),
            (
                "X,A,length\n1, nan,3\n",
                2,
                "column 2 (A): `nan` is not a finite number",
                "nan",
            ),
            (
                "X,A,length\n1,2,1e39\n",
                2,
                "column 3 (length): 1e39 is too large for a position",
                "1e39",
            ),
        ] {
            let error = read(text, &inputs()).unwrap_err();
            assert_eq!(error.message, message);
            assert_eq!(error.line(text), Some(line), "{text}");
            assert_eq!(&text[error.span.clone().unwrap()], marked, "{text}");
            assert!(!error.remedy.is_empty());
        }
        assert_eq!(
            read("", &inputs()).unwrap_err().message,
            "the file is empty"
        );
    }

    #[test]
    fn written_numbers_read_back_to_the_same() {
        let values = vec![0.1_f32, -1.234_567_8e-7, f32::MIN_POSITIVE, 16_777_216.0];
        let text = write(&['X', 'Y', 'Z', 'A'], std::slice::from_ref(&values));
        let (header, row) = text.trim_end().split_once('\n').unwrap();
        assert_eq!(header, "dX,dY,dZ,dA");
        let back: Vec<f32> = row.split(',').map(|v| v.parse().unwrap()).collect();
        assert_eq!(back, values);
    }
}
