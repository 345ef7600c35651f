//! Errors that point into a file.

use std::ops::Range;

/// What is wrong with a file, where, and what to write instead.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[error("{message}")]
pub struct FileError {
    /// What is wrong.
    pub message: String,
    /// A few words to stand at the marked place.
    pub label: String,
    /// What to write instead.
    pub remedy: String,
    /// Byte range in the file.
    pub span: Option<Range<usize>>,
}

impl FileError {
    /// An error at a place.
    pub fn at(
        span: Range<usize>,
        message: impl Into<String>,
        label: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            message: message.into(),
            label: label.into(),
            remedy: remedy.into(),
            span: Some(span),
        }
    }

    /// An error of the file as a whole.
    pub fn whole(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            label: String::new(),
            remedy: remedy.into(),
            span: None,
        }
    }

    /// The line of the error, counted from 1.
    #[must_use]
    pub fn line(&self, text: &str) -> Option<usize> {
        let start = self.span.as_ref()?.start.min(text.len());
        Some(
            text.as_bytes()[..start]
                .iter()
                .filter(|b| **b == b'\n')
                .count()
                + 1,
        )
    }
}

impl From<toml::de::Error> for FileError {
    fn from(error: toml::de::Error) -> Self {
        Self {
            message: error.message().to_owned(),
            label: "here".to_owned(),
            remedy: "see the file formats in the manual: unknown keys and wrong types are refused"
                .to_owned(),
            span: error.span(),
        }
    }
}
