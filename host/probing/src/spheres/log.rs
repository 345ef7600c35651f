//! The log of a probing program.
//!
//! LinuxCNC writes a line for each touch between `PROBEOPEN` and `PROBECLOSE`: X Y Z A B C U V W, with six decimals,
//! separated by spaces. Logs of other controllers have a header with the letters of the axes, and commas. All values
//! are machine positions, mm and degrees.

use std::ops::Range;
use trueaxis_model::formats::csv::{CsvRow, CsvTable};
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::positions::is_in_travel;
use trueaxis_model::source::FileError;

/// Columns of LinuxCNC.
const LINUXCNC: [&str; 9] = ["X", "Y", "Z", "A", "B", "C", "U", "V", "W"];

const LAYOUT: &str = "run the probing program to its end: LinuxCNC writes the log on closing it (PROBECLOSE); logs of other controllers have a header with a column for each axis of the machine";
const VALUES: &str = "give the log as the controller wrote it, in mm and degrees with a decimal point; a line that was cut off has to be probed again";

/// A touch in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Touched {
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Time (s), if the log has a column `time_s`.
    pub time: Option<f64>,
    /// Temperature (°C), if the log has a column `temperature_C`.
    pub temperature: Option<f64>,
    /// Line, counted from 1.
    pub line: usize,
    /// Location in the file.
    pub span: Range<usize>,
    /// Location of the number of each axis, with its column counted from 1.
    pub(super) cells: Vec<(usize, Range<usize>)>,
}

/// Reads the touches of a log.
///
/// # Errors
/// [`FileError`]: whatever [`CsvTable`] refuses, a missing column, a position outside the travel.
pub fn read_log(text: &str, machine: &Machine) -> Result<Vec<Touched>, FileError> {
    let first = text.trim_start_matches(|c: char| c == '\u{feff}' || c.is_whitespace());
    let word = first.split([',', ' ', '\t', ';', '\r', '\n']).next();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    let (table, names) = match word.is_some_and(is_number) {
        true => {
            let table = CsvTable::without_header(text, 0, &LINUXCNC, VALUES);
            (table.spaced(), LINUXCNC.to_vec())
        }
        false => {
            let table = CsvTable::open(text, 0, LAYOUT, VALUES)?;
            let names = table.header.cells.iter().map(|cell| cell.text).collect();
            (table, names)
        }
    };
    let column = |letter: char| names.iter().position(|name| name.chars().eq([letter]));
    let mut columns = Vec::new();
    for axis in &machine.axes {
        let letter = axis.letter.char();
        columns.push(column(letter).ok_or_else(|| table.missing(letter))?);
    }
    let [time, temperature] =
        ["time_s", "temperature_C"].map(|name| names.iter().position(|n| *n == name));
    let one = |row: &CsvRow<'_>| {
        let number = |column: Option<usize>| column.map(|c| row.number(c)).transpose();
        Ok(Touched {
            time: number(time)?,
            temperature: number(temperature)?,
            ..touched(machine, &columns, row)?
        })
    };
    table.map(|row| one(&row?)).collect()
}

fn touched(machine: &Machine, columns: &[usize], row: &CsvRow<'_>) -> Result<Touched, FileError> {
    let mut touched = Touched {
        position: [0.0; MAX_AXES],
        time: None,
        temperature: None,
        line: row.line,
        span: row.span.clone(),
        cells: Vec::new(),
    };
    for (i, (axis, column)) in machine.axes.iter().zip(columns).enumerate() {
        let value = row.number(*column)?;
        if !axis.modulo {
            let remedy = "the log must have machine positions, without work offset and tool length: probe with the program that trueaxis plan writes";
            is_in_travel(row, *column, axis, value, remedy)?;
        }
        touched.position[i] = value;
        let span = row.cells[*column].span.clone();
        touched.cells.push((column + 1, span));
    }
    Ok(touched)
}
