//! The log of a probing program.
//!
//! LinuxCNC writes a line for each touch between `PROBEOPEN` and `PROBECLOSE`: X Y Z A B C U V W, with six decimals
//! and spaces between them. Logs of other controllers have a header with the letters of the axes and commas. All
//! are machine positions, mm and degrees.

use std::ops::Range;
use trueaxis_model::formats::cells::{cells, lines, separated};
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::source::FileError;

/// What LinuxCNC writes.
const LINUXCNC: &str = "XYZABCUVW";
/// Beyond this (mm, deg) the travel an axis is somewhere else: travels are not exact.
const BEYOND: f64 = 1e-3;

/// A touch in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Touched {
    /// Axis positions (mm, deg).
    pub position: PerAxis,
    /// Its line, counted from 1.
    pub line: usize,
    /// Where it stands in the file.
    pub span: Range<usize>,
    /// Where the number of each axis stands, and in which column, counted from 1.
    pub(super) cells: Vec<(usize, Range<usize>)>,
}

/// Reads the touches of a log.
///
/// # Errors
/// [`FileError`]: nothing in it, a column that is missing, a line that is too short or too long, what is not a number,
/// a position outside the travel.
pub fn read_log(text: &str, machine: &Machine) -> Result<Vec<Touched>, FileError> {
    let mut lines = lines(text).peekable();
    let Some(&(first, start)) = lines.peek() else {
        return Err(FileError::whole(
            "the log is empty: nothing was touched",
            "run the probing program to its end; LinuxCNC writes the log on closing it (PROBECLOSE)",
        ));
    };
    let has_header = (first
        .split([',', ' ', '\t', ';'])
        .find(|word| !word.is_empty()))
    .is_some_and(|word| word.parse::<f64>().is_err());
    let names: Vec<String> = if has_header {
        if let Some(error) = separated(first, start) {
            return Err(error);
        }
        let _ = lines.next();
        cells(first, start)
            .iter()
            .map(|(name, _)| (*name).to_owned())
            .collect()
    } else {
        LINUXCNC.chars().map(String::from).collect()
    };
    let column = |letter: char| names.iter().position(|n| n.chars().eq([letter]));
    let mut columns = Vec::new();
    for axis in &machine.axes {
        let letter = axis.letter.char();
        columns.push(column(letter).ok_or_else(|| {
            FileError::at(
                start..start + first.len(),
                format!("the column `{letter}` is missing"),
                "the header",
                "write a column for each axis of the machine, or give the log as LinuxCNC writes it",
            )
        })?);
    }
    let mut touches = Vec::new();
    let (mut number, mut counted) = (1, 0);
    for (line, start) in lines {
        number += text[counted..start].matches('\n').count();
        counted = start;
        let span = start..start + line.len();
        let found = if has_header {
            cells(line, start)
        } else {
            words(line, start)
        };
        if found.len() != names.len() {
            return Err(FileError::at(
                span,
                format!(
                    "the line has {} numbers, where there are {} ({})",
                    found.len(),
                    names.len(),
                    names.join(" ")
                ),
                "here",
                "give the log as the controller wrote it; a line that was cut off has to be probed again",
            ));
        }
        touches.push(touched(machine, &columns, &found, number, span)?);
    }
    if touches.is_empty() {
        return Err(FileError::at(
            start..start + first.len(),
            "there are no touches below the header",
            "the only line",
            "run the probing program to its end",
        ));
    }
    Ok(touches)
}

/// Words between spaces, with their places.
fn words(line: &str, start: usize) -> Vec<(&str, Range<usize>)> {
    let mut at = 0;
    line.split_whitespace()
        .map(|word| {
            at += line[at..].find(word).unwrap_or(0);
            let span = start + at..start + at + word.len();
            at += word.len();
            (word, span)
        })
        .collect()
}

fn touched(
    machine: &Machine,
    columns: &[usize],
    found: &[(&str, Range<usize>)],
    line: usize,
    span: Range<usize>,
) -> Result<Touched, FileError> {
    let mut touched = Touched {
        position: [0.0; MAX_AXES],
        line,
        span,
        cells: Vec::new(),
    };
    for (i, (axis, column)) in machine.axes.iter().zip(columns).enumerate() {
        let (text, span) = &found[*column];
        let Some(value) = text.parse::<f64>().ok().filter(|v| v.is_finite()) else {
            return Err(FileError::at(
                if span.is_empty() {
                    touched.span.clone()
                } else {
                    span.clone()
                },
                format!("column {}: `{text}` is not a finite number", column + 1),
                "not a number",
                "numbers are in mm and degrees, with a decimal point: 12.5",
            ));
        };
        let [low, high] = axis.travel;
        if !axis.modulo && !(low - BEYOND..=high + BEYOND).contains(&value) {
            return Err(FileError::at(
                span.clone(),
                format!(
                    "column {}: {} = {value} is outside the travel of {low} to {high}",
                    column + 1,
                    axis.letter
                ),
                "outside the travel",
                "the log must have machine positions, without work offset and tool length: probe with the program that trueaxis plan writes",
            ));
        }
        touched.position[i] = value;
        touched.cells.push((column + 1, span.clone()));
    }
    Ok(touched)
}
