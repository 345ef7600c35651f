//! Lines of a file and their places.

use crate::source::FileError;
use std::ops::Range;

/// A line without its line ending.
pub struct CsvLine<'t> {
    pub text: &'t str,
    /// First byte in the file.
    start: usize,
    /// Line number, counted from 1.
    pub number: usize,
}

impl CsvLine<'_> {
    pub fn span(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }

    /// The place of a part of the line in the file.
    pub fn place(&self, part: &str) -> Range<usize> {
        let start = self.start + part.as_ptr().addr() - self.text.as_ptr().addr();
        start..start + part.len()
    }

    /// Checks that columns are not separated by anything other than commas.
    pub fn has_commas(&self) -> Result<(), FileError> {
        let line = self.text.trim();
        let other = [(';', "semicolons"), ('\t', "tabs")];
        let found = (other.into_iter()).find_map(|(mark, name)| Some((line.find(mark)?, name)));
        let Some((at, name)) = found else {
            return Ok(());
        };
        Err(FileError::here(
            self.place(&line[at..=at]),
            format!("the columns are separated by {name}"),
            "separate the columns with commas, and write numbers with a decimal point: 12.5,-3",
        ))
    }
}

/// Lines that are not blank.
#[derive(Clone, Debug)]
pub struct TextLines<'t> {
    text: &'t str,
    next: usize,
    number: usize,
}

/// The lines from a given byte on.
pub fn lines(text: &str, start: usize) -> TextLines<'_> {
    TextLines {
        text,
        next: start,
        number: text[..start].matches('\n').count(),
    }
}

impl<'t> Iterator for TextLines<'t> {
    type Item = CsvLine<'t>;

    fn next(&mut self) -> Option<CsvLine<'t>> {
        loop {
            let mut start = self.next;
            let whole = self.text[start..].split_inclusive('\n').next()?;
            self.next += whole.len();
            self.number += 1;
            let mut text = whole.trim_end_matches(['\n', '\r']);
            if start == 0
                && let Some(rest) = text.strip_prefix('\u{feff}')
            {
                (text, start) = (rest, text.len() - rest.len());
            }
            if !text.trim().is_empty() {
                let number = self.number;
                return Some(CsvLine {
                    text,
                    start,
                    number,
                });
            }
        }
    }
}
