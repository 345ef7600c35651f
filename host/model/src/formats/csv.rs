//! Tables as CSV: lines with TOML that begin with `#`, in some formats; a header; and rows.
//!
//! Blank lines and a byte order mark are skipped, and names may be quoted. Every cell keeps its place in the file.
//! The lines are not split by `csv-core`: it could count the bytes of each cell, but it treats a quote after a space
//! as part of the name, and one unclosed quote swallows the rest of the file.

mod lines;
#[cfg(test)]
mod tests;

use crate::source::{FileError, right_case};
use lines::{CsvLine, TextLines, lines};
use serde::de::DeserializeOwned;
use std::cmp::Ordering;
use std::iter::repeat_n;
use std::ops::Range;

/// One value of a row.
#[derive(Clone, Debug)]
pub struct Cell<'t> {
    /// The text without surrounding spaces and quotes.
    pub text: &'t str,
    /// Bytes in the file; those of the whole row if the cell is empty.
    pub span: Range<usize>,
    /// The name of its column; empty if the column has none.
    name: &'t str,
}

/// A line of cells.
#[derive(Clone, Debug)]
pub struct CsvRow<'t> {
    /// Line in the file, counted from 1.
    pub line: usize,
    /// Bytes in the file.
    pub span: Range<usize>,
    /// One for each column.
    pub cells: Vec<Cell<'t>>,
    remedy: &'static str,
}

impl<'t> CsvRow<'t> {
    /// The text in a column.
    ///
    /// # Errors
    /// [`FileError`]: the cell is empty.
    pub fn text(&self, column: usize) -> Result<&'t str, FileError> {
        match self.cells[column].text {
            "" => Err(self.error(column, "the value is missing", "nothing here", self.remedy)),
            text => Ok(text),
        }
    }

    /// The finite number in a column.
    ///
    /// # Errors
    /// [`FileError`]: the cell is empty or not a finite number.
    pub fn number(&self, column: usize) -> Result<f64, FileError> {
        let text = self.text(column)?;
        let number = text.parse::<f64>().ok().filter(|v| v.is_finite());
        number.ok_or_else(|| {
            let message = format!("`{text}` is not a finite number");
            self.error(column, message, "not a number", self.remedy)
        })
    }

    /// The number in a column whose numbers increase from row to row; `last` is that of the previous row.
    ///
    /// # Errors
    /// [`FileError`]: not a finite number, or not larger than the previous one.
    pub fn increasing(
        &self,
        column: usize,
        last: Option<f64>,
        remedy: &str,
    ) -> Result<f64, FileError> {
        let number = self.number(column)?;
        match last.filter(|last| *last >= number) {
            Some(last) => {
                let message = format!("the values must increase, but {number} follows {last}");
                Err(self.error(column, message, "here", remedy))
            }
            None => Ok(number),
        }
    }

    /// An error at a cell; its message begins with the name of the column.
    pub fn error(
        &self,
        column: usize,
        message: impl AsRef<str>,
        label: &str,
        remedy: impl Into<String>,
    ) -> FileError {
        let Cell { name, span, .. } = &self.cells[column];
        let name = match *name {
            "" => String::new(),
            name => format!(" ({name})"),
        };
        let message = format!("column {}{name}: {}", column + 1, message.as_ref());
        FileError::at(span.clone(), message, label, remedy)
    }
}

/// A file whose rows are read one by one; all have as many cells as the header.
#[derive(Clone, Debug)]
pub struct CsvTable<'t> {
    /// The names of the columns; no cells in a table without a header.
    pub header: CsvRow<'t>,
    names: Vec<&'t str>,
    lines: TextLines<'t>,
    /// Number of cells per row; 0 before the first row of a table without names.
    width: usize,
    is_spaced: bool,
    /// True if lines that begin with `#` come before it.
    has_heading: bool,
    has_rows: bool,
    layout: String,
    remedy: &'static str,
}

impl<'t> CsvTable<'t> {
    /// Reads the header, the first line at or after byte `start`.
    ///
    /// `layout` describes the file; it is the remedy for a wrong header. `remedy` is that for wrong rows.
    ///
    /// # Errors
    /// [`FileError`]: an empty file, or columns that are not separated by commas.
    pub fn open(
        text: &'t str,
        start: usize,
        layout: impl Into<String>,
        remedy: &'static str,
    ) -> Result<Self, FileError> {
        let mut table = Self::without_header(text, start, &[], remedy);
        table.layout = layout.into();
        table.has_heading = start > 0;
        let Some(line) = table.lines.next() else {
            let message = match table.has_heading {
                true => "nothing follows the lines with #",
                false => "the file is empty",
            };
            return Err(FileError::whole(message, table.layout));
        };
        table.header = table.split(&line)?;
        table.names = table.header.cells.iter().map(|c| c.text).collect();
        table.width = table.names.len();
        Ok(table)
    }

    /// Rows without a header, starting at byte `start`; with the width of the first row if `names` is empty.
    #[must_use]
    pub fn without_header(
        text: &'t str,
        start: usize,
        names: &[&'t str],
        remedy: &'static str,
    ) -> Self {
        Self {
            header: CsvRow {
                line: 1,
                span: 0..0,
                cells: Vec::new(),
                remedy,
            },
            names: names.to_vec(),
            lines: lines(text, start),
            width: names.len(),
            is_spaced: false,
            has_heading: false,
            has_rows: false,
            layout: String::new(),
            remedy,
        }
    }

    /// With spaces between the columns.
    #[must_use]
    pub fn spaced(self) -> Self {
        Self {
            is_spaced: true,
            ..self
        }
    }

    /// The meaning of each column from `first` on.
    ///
    /// # Errors
    /// [`FileError`]: a name for which `known` returns `None`, or a column that is listed twice.
    pub fn columns<C: PartialEq>(
        &self,
        first: usize,
        known: impl Fn(&str) -> Option<C>,
    ) -> Result<Vec<C>, FileError> {
        let mut columns = Vec::new();
        for (k, Cell { text, span, .. }) in self.header.cells.iter().enumerate().skip(first) {
            let error = |message: &str, label: &str, remedy: String| {
                let message = format!("column {}{message}", k + 1);
                Err(FileError::at(span.clone(), message, label, remedy))
            };
            let Some(column) = known(text) else {
                let message = match *text {
                    "" => " has no name".to_owned(),
                    name => format!(": `{name}` is not a known column"),
                };
                let remedy = match right_case(text, |name| known(name).is_some()) {
                    Some(right) => format!("write {right}: upper and lower case matter"),
                    None => self.layout.clone(),
                };
                return error(&message, "unknown column", remedy);
            };
            if columns.contains(&column) {
                let remedy = "keep one of the two columns".to_owned();
                return error(
                    &format!(": `{text}` is listed twice"),
                    "the second one",
                    remedy,
                );
            }
            columns.push(column);
        }
        Ok(columns)
    }

    /// The error for a header without a required column.
    pub fn missing(&self, column: impl std::fmt::Display) -> FileError {
        let message = format!("the column `{column}` is missing");
        self.wrong_header(message)
    }

    /// Checks the first columns of a header whose order is fixed.
    ///
    /// # Errors
    /// [`FileError`] with the names that are expected.
    pub fn begins_with(&self, names: &[&str]) -> Result<(), FileError> {
        match self.names.starts_with(names) {
            true => Ok(()),
            false => {
                let message = format!("the header does not begin with `{}`", names.join(","));
                Err(self.wrong_header(message))
            }
        }
    }

    /// An error about the whole header, with its expected layout.
    pub fn wrong_header(&self, message: impl Into<String>) -> FileError {
        let span = self.header.span.clone();
        FileError::at(span, message, "the header", self.layout.clone())
    }

    fn split(&self, line: &CsvLine<'t>) -> Result<CsvRow<'t>, FileError> {
        if self.has_heading && line.text.trim_start().starts_with('#') {
            return Err(FileError::here(
                line.span(),
                "there is a line with # below the header",
                "move it to the top: the lines with # come first",
            ));
        }
        let cell = |(k, part): (usize, &'t str)| Cell {
            text: unquoted(part),
            span: match part {
                "" => line.span(),
                part => line.place(part),
            },
            name: self.names.get(k).copied().unwrap_or_default(),
        };
        let cells = match self.is_spaced {
            true => line.text.split_whitespace().enumerate().map(cell).collect(),
            false => {
                line.has_commas()?;
                let parts = line.text.split(',').map(str::trim);
                parts.enumerate().map(cell).collect()
            }
        };
        Ok(CsvRow {
            line: line.number,
            span: line.span(),
            cells,
            remedy: self.remedy,
        })
    }

    /// Checks that a row has as many cells as there are columns.
    fn complete(&self, row: CsvRow<'t>) -> Result<CsvRow<'t>, FileError> {
        let (count, width) = (row.cells.len(), self.width);
        let (span, label) = match count.cmp(&width) {
            Ordering::Equal => return Ok(row),
            Ordering::Less => (
                row.span.clone(),
                match self.names.get(count) {
                    Some(name) => format!("`{name}` is missing"),
                    None => "too few columns".to_owned(),
                },
            ),
            Ordering::Greater => (
                row.cells[width].span.start..row.span.end,
                "too many columns".to_owned(),
            ),
        };
        let message = match self.header.cells.len() {
            0 => format!("the row has {count} columns, not {width}"),
            _ => format!("the row has {count} columns, the header has {width}"),
        };
        Err(FileError::at(span, message, label, self.remedy))
    }
}

impl<'t> Iterator for CsvTable<'t> {
    type Item = Result<CsvRow<'t>, FileError>;

    /// The next row. A header without rows is an error.
    fn next(&mut self) -> Option<Self::Item> {
        let Some(line) = self.lines.next() else {
            let is_bare = !self.has_rows && !self.header.cells.is_empty();
            self.has_rows = true;
            return is_bare.then(|| Err(self.wrong_header("there are no rows below the header")));
        };
        self.has_rows = true;
        let row = self.split(&line).and_then(|row| {
            if self.width == 0 {
                self.width = row.cells.len();
            }
            self.complete(row)
        });
        Some(row)
    }
}

/// Parses the leading lines that begin with `#`, without these marks, as TOML; also returns where they end.
///
/// # Errors
/// [`FileError`] with the given remedy: wrong syntax, an unknown key, a value of another type.
pub fn heading<T: DeserializeOwned>(text: &str, remedy: &str) -> Result<(T, usize), FileError> {
    let mut bare = String::new();
    for line in text.split_inclusive('\n') {
        let content = line.trim_start_matches(|c: char| c == '\u{feff}' || c.is_whitespace());
        let Some(entry) = content
            .strip_prefix('#')
            .or(content.is_empty().then_some(""))
        else {
            break;
        };
        // Keep the number of bytes, so that places in the file remain valid.
        bare.extend(repeat_n(' ', line.len() - entry.len()));
        bare += entry;
    }
    match toml::from_str(&bare) {
        Ok(heading) => Ok((heading, bare.len())),
        Err(error) => Err(FileError {
            remedy: remedy.to_owned(),
            ..FileError::syntax(&error, &bare)
        }),
    }
}

/// The line of a row; lines count from 1, rows from 1 after the header.
#[must_use]
pub fn line_of(text: &str, row: usize) -> Option<usize> {
    Some(lines(text, 0).nth(row)?.number)
}

/// The place of a column, given by its name, in a line of a file with a header; an empty range if there is none.
#[must_use]
pub fn place(text: &str, line: usize, column: &str) -> Range<usize> {
    let find = || {
        let mut table = CsvTable::open(text, 0, "", "").ok()?;
        let column = table.names.iter().position(|name| *name == column)?;
        let row = table.find_map(|row| row.ok().filter(|row| row.line == line))?;
        Some(row.cells[column].span.clone())
    };
    find().unwrap_or_default()
}

fn unquoted(cell: &str) -> &str {
    let inner = cell.strip_prefix('"').and_then(|c| c.strip_suffix('"'));
    inner.map_or(cell, str::trim)
}
