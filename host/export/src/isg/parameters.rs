//! Parameters in a file: the CSV of ISG, and the exchange format of Etalon.

use crate::rigid_body::AxisErrors;
use crate::text_lines::{TextLine, lines};
use std::ops::Range;
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Values over the position of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct IsgTable {
    /// The parameter, like `EYX`.
    pub name: String,
    /// The letter of the axis whose position is the argument.
    pub argument: char,
    /// Positions (mm, deg), increasing.
    pub at: Vec<f64>,
    /// Values (mm, rad).
    pub values: Vec<f64>,
    /// Where the table begins in the file.
    pub span: Range<usize>,
}

/// What a file has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IsgParameters {
    /// Names and values that do not depend on a position, with their places.
    pub constants: Vec<(String, f64, Range<usize>)>,
    /// Values that do.
    pub tables: Vec<IsgTable>,
}

/// A line without its comment.
fn without_comment<'t>(line: &TextLine<'t>) -> TextLine<'t> {
    let text = line.text.split("//").next().unwrap_or("").trim_end();
    TextLine {
        text,
        span: line.span.start..line.span.start + text.len(),
    }
}

fn without_rows(line: &TextLine<'_>) -> FileError {
    line.bad("a table without rows", "write its rows, or leave it out")
}

fn is_argument(name: &str) -> bool {
    name.len() == 1 && "XYZABC".contains(name)
}

impl IsgParameters {
    /// Reads the CSV of ISG.
    ///
    /// # Errors
    /// [`FileError`]: a row that does not fit its header, a value that is not a number, positions that do not increase, a
    /// table over several axes, which no error motion of one axis is.
    pub fn read_csv(text: &str) -> Result<Self, FileError> {
        let mut found = Self::default();
        let mut header: Option<(TextLine<'_>, Vec<&str>)> = None;
        let mut rows: Vec<(TextLine<'_>, Vec<f64>)> = Vec::new();
        for line in &lines(text) {
            let line = without_comment(line);
            let trimmed = line.text.trim();
            if trimmed.starts_with('#') {
                found.take(header.take(), std::mem::take(&mut rows))?;
            } else if trimmed.is_empty() {
            } else if let Some((_, names)) = &header {
                let words: Vec<&str> = trimmed.split_whitespace().collect();
                if words.len() != names.len() {
                    return Err(line.bad(
                        format!("{} values below {} names", words.len(), names.len()),
                        "write a value for each column, with spaces in between",
                    ));
                }
                let values = words.into_iter().map(|word| line.number(word));
                let values = values.collect::<Result<_, _>>()?;
                rows.push((line, values));
            } else {
                let names = trimmed.split_whitespace().collect();
                header = Some((line, names));
            }
        }
        found.take(header, rows)?;
        Ok(found)
    }

    /// Takes one table of a CSV.
    fn take(
        &mut self,
        header: Option<(TextLine<'_>, Vec<&str>)>,
        rows: Vec<(TextLine<'_>, Vec<f64>)>,
    ) -> Result<(), FileError> {
        let Some((line, names)) = header else {
            return Ok(());
        };
        let arguments: Vec<usize> = (0..names.len())
            .filter(|k| is_argument(names[*k]))
            .collect();
        match arguments[..] {
            [] => {
                let [(_, values)] = &rows[..] else {
                    return Err(line.bad(
                        format!("{} rows of parameters without an argument", rows.len()),
                        "write one row, or a column with the position of an axis",
                    ));
                };
                let constants = names.iter().zip(values);
                (self.constants)
                    .extend(constants.map(|(name, v)| ((*name).to_owned(), *v, line.span.clone())));
                Ok(())
            }
            [argument] => {
                let rows_increase = rows
                    .windows(2)
                    .find(|w| w[0].1[argument] >= w[1].1[argument]);
                if let Some([_, (line, _)]) = rows_increase {
                    return Err(line.bad("positions must increase", "sort the rows by position"));
                }
                if rows.is_empty() {
                    return Err(without_rows(&line));
                }
                for (k, name) in names.iter().enumerate().filter(|(k, _)| *k != argument) {
                    let letter = names[argument].chars().next();
                    self.tables.push(IsgTable {
                        at: rows.iter().map(|(_, row)| row[argument]).collect(),
                        values: rows.iter().map(|(_, row)| row[k]).collect(),
                        ..IsgTable::new(name, letter, line.span.clone())
                    });
                }
                Ok(())
            }
            _ => {
                let of: Vec<&str> = arguments.iter().map(|k| names[*k]).collect();
                Err(line.bad(
                    format!(
                        "a table over {}: here, an error belongs to one axis",
                        of.join(" and ")
                    ),
                    "write one table over the axis itself, at one position of the others",
                ))
            }
        }
    }

    /// Reads the exchange format of Etalon in its variant *Vendor*.
    ///
    /// # Errors
    /// [`FileError`]: a block that is neither a value nor grid points, a value that is not a number, positions that do not
    /// increase.
    pub fn read_etalon(text: &str) -> Result<Self, FileError> {
        let mut found = Self::default();
        let mut block: Option<(String, Range<usize>)> = None;
        let mut points: Option<IsgTable> = None;
        for line in &lines(text) {
            let line = without_comment(line);
            let trimmed = line.text.trim();
            if trimmed.is_empty() {
                continue;
            }
            if let Some(table) = &mut points {
                if trimmed != "}" {
                    table.add_row(&line)?;
                } else if table.at.is_empty() {
                    return Err(without_rows(&line));
                } else {
                    found.tables.extend(points.take());
                }
                continue;
            }
            if let Some(name) = trimmed.strip_prefix('[').and_then(|b| b.strip_suffix(']')) {
                block = Some((name.trim().to_owned(), line.span.clone()));
                continue;
            }
            let entry = trimmed
                .split_once('=')
                .map(|(key, value)| (key.trim(), value.trim()));
            match (&block, entry) {
                (Some((name, span)), Some((key, value))) if key.eq_ignore_ascii_case("value") => {
                    let value = line.number(value)?;
                    found.constants.push((name.clone(), value, span.clone()));
                }
                (Some((name, span)), Some((key, "{")))
                    if key.eq_ignore_ascii_case("gridpoints") =>
                {
                    points = Some(IsgTable::new(name, name.chars().last(), span.clone()));
                }
                _ => {
                    return Err(line.bad(
                        format!("`{trimmed}` is neither a value nor grid points"),
                        "give a file of the variant Vendor: [NAME], then VALUE = … or Gridpoints = { … }",
                    ));
                }
            }
        }
        match points {
            None => Ok(found),
            Some(table) => Err(FileError::here(
                table.span,
                format!("the grid points of {} do not end", table.name),
                "write } after the last row; is the file cut off?",
            )),
        }
    }

    /// The error motions of the axes of a machine, in its coordinates. Constants have no part in them.
    ///
    /// # Errors
    /// [`FileError`] for a motion that the machine does not have, or over another axis.
    pub fn motions(&self, machine: &Machine) -> Result<Vec<AxisErrors>, FileError> {
        let mut motions = vec![AxisErrors::default(); machine.axes.len()];
        for table in &self.tables {
            let (component, index) = table.motion(machine)?;
            let error =
                |value: &f64| std::array::from_fn(|k| if k == component { *value } else { 0.0 });
            motions[index].add(&AxisErrors {
                at: table.at.clone(),
                errors: table.values.iter().map(error).collect(),
            });
        }
        Ok(motions)
    }
}

impl IsgTable {
    fn new(name: &str, argument: Option<char>, span: Range<usize>) -> Self {
        Self {
            name: name.to_owned(),
            argument: argument.unwrap_or(' '),
            at: Vec::new(),
            values: Vec::new(),
            span,
        }
    }

    /// A row of Etalon's grid points.
    fn add_row(&mut self, line: &TextLine<'_>) -> Result<(), FileError> {
        let words: Vec<&str> = line.text.split_whitespace().collect();
        let [at, value] = words[..] else {
            return Err(line.bad(
                format!("{} numbers instead of a position and a value", words.len()),
                "write a position and a value, and } after the last row",
            ));
        };
        let at = line.number(at)?;
        if self.at.last().is_some_and(|last| *last >= at) {
            return Err(line.bad("positions must increase", "sort the rows by position"));
        }
        self.at.push(at);
        self.values.push(line.number(value)?);
        Ok(())
    }

    fn bad(&self, what: &str) -> FileError {
        FileError::at(
            self.span.clone(),
            format!("{} {what}", self.name),
            "this table",
            "write EXX to ECC over the position of the axis that the name ends with",
        )
    }

    /// The component of an error motion, and the index of its axis.
    ///
    /// # Errors
    /// [`FileError`] if it is no error motion of an axis of the machine over this axis.
    pub fn motion(&self, machine: &Machine) -> Result<(usize, usize), FileError> {
        let named = Parameter::parse_motion(&self.name);
        let (component, letter) = named.ok_or_else(|| self.bad("is no error motion"))?;
        let index = machine
            .index(letter)
            .ok_or_else(|| self.bad("is of an axis that the machine does not have"))?;
        match self.argument == letter {
            true => Ok((component, index)),
            false => Err(self.bad(&format!("is a table over {}", self.argument))),
        }
    }
}
