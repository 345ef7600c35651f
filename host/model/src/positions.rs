//! Positions and corrections as CSV.
//!
//! The header names the inputs: axes by their letter, the tool length as `tool length` or
//! `length`, temperature sensors by their name; in any order. Numbers are in mm, degrees and
//! (difference to the reference) K, with a decimal point. Empty lines are skipped. The order of
//! the rows is the motion.

use crate::formats::cells::{Cell, cells, lines, separated};
use crate::machine::Machine;
use crate::source::{FileError, right_case};
use std::fmt::{Display, Write};
use trueaxis::{Auxiliary, AuxiliaryKind, Axis};

/// An input that positions must give.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The name to be used in messages.
    pub name: String,
    /// What stands for the same.
    pub alias: Option<&'static str>,
    /// What is meant, for messages.
    pub meaning: String,
}

/// Name of the tool length as an input.
pub(crate) const TOOL_LENGTH: &str = "tool length";

impl Input {
    fn axis(letter: char) -> Self {
        Self {
            name: letter.to_string(),
            alias: None,
            meaning: format!("axis {letter}"),
        }
    }

    fn tool_length(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            alias: Some("length"),
            meaning: "the tool length in mm".to_owned(),
        }
    }

    fn sensor(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            alias: None,
            meaning: format!("sensor `{name}` in K from its reference"),
        }
    }

    /// The inputs of a compensation: axes, then auxiliaries, in its order.
    #[must_use]
    pub fn of_compensation(axes: &[Axis], auxiliaries: &[Auxiliary]) -> Vec<Self> {
        let axes = axes.iter().map(|a| Self::axis(char::from(a.name)));
        let auxiliaries = auxiliaries.iter().map(|a| match a.kind {
            AuxiliaryKind::ToolLength => Self::tool_length(&a.name),
            AuxiliaryKind::Temperature => Self::sensor(&a.name),
        });
        axes.chain(auxiliaries).collect()
    }

    /// The inputs of a machine with its sensors: axes, the tool length if it is an input, sensors.
    #[must_use]
    pub fn of_machine<'a>(
        machine: &Machine,
        sensors: impl IntoIterator<Item = &'a str>,
    ) -> Vec<Self> {
        let axes = machine.axes.iter().map(|a| Self::axis(a.letter.char()));
        let length = machine.length_range.map(|_| Self::tool_length(TOOL_LENGTH));
        let sensors = sensors.into_iter().map(Self::sensor);
        axes.chain(length).chain(sensors).collect()
    }
}

/// Reads positions: one row per position, its values in the order of `inputs`.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: no header, a name that is not an input, one that
/// stands twice or is missing, a row that is too short or too long, a value that is missing or
/// no finite number of f32 size, no rows.
pub fn read(text: &str, inputs: &[Input]) -> Result<Vec<Vec<f64>>, FileError> {
    let names: Vec<&str> = inputs.iter().map(|i| i.name.as_str()).collect();
    let header = names.join(",");
    let mut lines = lines(text);
    let Some((first, start)) = lines.next() else {
        return Err(FileError::whole(
            "the file is empty",
            format!("start it with the header {header}, then one position per line"),
        ));
    };
    if let Some(mut error) = separated(first, start) {
        error.remedy = format!("{}; the header is {header}", error.remedy);
        return Err(error);
    }
    let columns = read_header(&cells(first, start), inputs, &header)?;
    let mut rows = Vec::new();
    for (line, start) in lines {
        if let Some(error) = separated(line, start) {
            return Err(error);
        }
        rows.push(read_row(line, start, &columns, inputs)?);
    }
    if rows.is_empty() {
        return Err(FileError::at(
            start..start + first.len(),
            "there are no positions below the header",
            "the only line",
            "write one position per line, in mm and degrees",
        ));
    }
    Ok(rows)
}

/// The line, counted from 1, of a row of positions, counted from 1 below the header.
#[must_use]
pub fn line_of(text: &str, row: usize) -> Option<usize> {
    let (_, start) = lines(text).nth(row)?;
    Some(text[..start].matches('\n').count() + 1)
}

/// Which input each column is.
fn read_header(
    cells: &[Cell<'_>],
    inputs: &[Input],
    header: &str,
) -> Result<Vec<usize>, FileError> {
    let mut columns: Vec<usize> = Vec::new();
    for (name, span) in cells {
        let exact = inputs.iter().position(|i| i.name == *name);
        let found = exact.or_else(|| inputs.iter().position(|i| i.alias == Some(name)));
        let Some(input) = found else {
            return Err(FileError::at(
                span.clone(),
                if name.is_empty() {
                    format!("column {} has no name", columns.len() + 1)
                } else {
                    format!("column {}: `{name}` is not an input", columns.len() + 1)
                },
                "unknown column",
                match right_case(name, |n| inputs.iter().any(|i| i.name == n)) {
                    Some(right) => format!("write {right}: axes have capital letters"),
                    None => format!(
                        "the header must name exactly the inputs, separated by commas, in any order: {header}"
                    ),
                },
            ));
        };
        if columns.contains(&input) {
            return Err(FileError::at(
                span.clone(),
                format!("column {}: `{name}` is listed twice", columns.len() + 1),
                "second column of this input",
                "keep one of the two columns",
            ));
        }
        columns.push(input);
    }
    if let Some(missing) = (0..inputs.len()).find(|i| !columns.contains(i)) {
        let input = &inputs[missing];
        let whole = cells.first().map_or(0, |c| c.1.start)..cells.last().map_or(0, |c| c.1.end);
        return Err(FileError::at(
            whole,
            format!("the column `{}` is missing", input.name),
            "the header",
            format!("add {}: the header must name {header}", input.meaning),
        ));
    }
    Ok(columns)
}

fn read_row(
    line: &str,
    start: usize,
    columns: &[usize],
    inputs: &[Input],
) -> Result<Vec<f64>, FileError> {
    let cells = cells(line, start);
    let whole = start..start + line.len();
    if cells.len() > columns.len() {
        return Err(FileError::at(
            cells[columns.len()].1.start..whole.end,
            format!(
                "the row has {} columns, the header has {}",
                cells.len(),
                columns.len()
            ),
            "too many columns",
            "one value per column of the header, with a decimal point, not a comma",
        ));
    }
    if cells.len() < columns.len() {
        let missing = &inputs[columns[cells.len()]].name;
        return Err(FileError::at(
            whole,
            format!(
                "the row has {} columns, the header has {}",
                cells.len(),
                columns.len()
            ),
            format!("`{missing}` is missing"),
            "give every position a value in each column",
        ));
    }
    let mut row = vec![0.0; inputs.len()];
    for (column, (cell, span)) in cells.iter().enumerate() {
        let name = &inputs[columns[column]].name;
        let place = format!("column {} ({name})", column + 1);
        let span = if span.is_empty() {
            whole.clone()
        } else {
            span.clone()
        };
        if cell.is_empty() {
            return Err(FileError::at(
                span,
                format!("{place}: the value is missing"),
                "nothing here",
                "give every position a value in each column",
            ));
        }
        let Ok(value) = cell.parse::<f64>() else {
            return Err(FileError::at(
                span,
                format!("{place}: `{cell}` is not a number"),
                "not a number",
                "write a plain number in mm or degrees, like -12.5",
            ));
        };
        // The runtime computes in f32: what is infinite there is no position.
        if !(value as f32).is_finite() {
            return Err(FileError::at(
                span,
                format!("{place}: {cell} is not a finite position"),
                "not finite",
                "write a plain number in mm or degrees, like -12.5",
            ));
        }
        row[columns[column]] = value;
    }
    Ok(row)
}

/// Corrections as CSV, `dX,dY,…`: each number with the fewest digits that read back to the same.
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

    fn inputs() -> Vec<Input> {
        vec![
            Input::axis('X'),
            Input::axis('A'),
            Input::tool_length(TOOL_LENGTH),
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
    fn every_mistake_is_told_with_line_and_place() {
        for (text, line, message, marked) in [
            ("X,A,Q\n1,2,3\n", 1, "column 3: `Q` is not an input", "Q"),
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
                "there are no positions below the header",
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
                "column 2 (A): `two` is not a number",
                "two",
            ),
            (
                "X,A,length\n1, nan,3\n",
                2,
                "column 2 (A): nan is not a finite position",
                "nan",
            ),
            (
                "X,A,length\n1,2,1e39\n",
                2,
                "column 3 (tool length): 1e39 is not a finite position",
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
