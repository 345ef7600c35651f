//! Lines of a text with their places, and numbers in them.

use std::ops::Range;
use trueaxis_model::source::FileError;

/// A line without its end.
#[derive(Clone, Debug)]
pub struct Line<'t> {
    /// Its text.
    pub text: &'t str,
    /// Its place.
    pub span: Range<usize>,
}

impl Line<'_> {
    /// An error about it.
    pub fn bad(&self, message: impl Into<String>, remedy: &str) -> FileError {
        FileError::at(self.span.clone(), message, "here", remedy)
    }

    /// Numbers between commas.
    ///
    /// # Errors
    /// [`FileError`] for a word that is not a finite number of a plausible size.
    pub fn numbers(&self) -> Result<Vec<f64>, FileError> {
        let words = self.text.split(',').map(str::trim);
        words.map(|word| self.number(word)).collect()
    }

    /// A word of this line as a number.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn number(&self, word: &str) -> Result<f64, FileError> {
        let number = word.parse::<f64>().ok().filter(|v| v.abs() <= 1e6);
        number.ok_or_else(|| {
            self.bad(
                format!("`{word}` is not a number"),
                "write millimetres with a decimal point, separated by commas",
            )
        })
    }

    /// A word of this line as a number of points along an axis.
    ///
    /// # Errors
    /// [`FileError`]
    pub fn count(&self, word: &str) -> Result<usize, FileError> {
        let count = word.parse().ok().filter(|n| (2..=1000).contains(n));
        count.ok_or_else(|| {
            self.bad(
                format!("`{word}` is not a number of points along an axis"),
                "write 2 to 1000",
            )
        })
    }
}

/// All lines of a text.
pub fn lines(text: &str) -> Vec<Line<'_>> {
    let mut start = 0;
    let lines = text.split_inclusive('\n').map(|whole| {
        let line = whole.trim_end();
        let span = start..start + line.len();
        start += whole.len();
        Line { text: line, span }
    });
    lines.collect()
}
