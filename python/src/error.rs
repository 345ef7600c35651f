//! What is raised: a message, the place in a file, and what to do instead.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::Path;
use trueaxis_model::source::FileError;

pyo3::create_exception!(
    trueaxis,
    Error,
    PyValueError,
    "Bad input. `message` says what is wrong, `remedy` what to do; `file` and `line` where, or None."
);

/// An error without a place.
pub fn raise(message: impl Into<String>, remedy: impl Into<String>) -> PyErr {
    placed(message.into(), remedy.into(), None, None)
}

fn placed(message: String, remedy: String, file: Option<String>, line: Option<usize>) -> PyErr {
    let place = match (&file, line) {
        (Some(file), Some(line)) => format!("{file}, line {line}: "),
        (Some(file), None) => format!("{file}: "),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    };
    let error = Error::new_err(format!("{place}{message}\n  {remedy}"));
    Python::attach(|py| {
        let value = error.value(py);
        let set = value
            .setattr("message", message)
            .and_then(|()| value.setattr("remedy", remedy))
            .and_then(|()| value.setattr("file", file))
            .and_then(|()| value.setattr("line", line));
        match set {
            Ok(()) => error,
            Err(other) => other,
        }
    })
}

/// A text with the name of its file, if it has one.
pub struct Text {
    pub file: Option<String>,
    pub text: String,
}

impl Text {
    /// Reads a file.
    pub fn read(path: &Path) -> PyResult<Self> {
        // The exception of Python for files, with its `errno`.
        let text = std::fs::read_to_string(path)?;
        let file = Some(path.display().to_string());
        Ok(Self { file, text })
    }

    /// An error in it, or in another file that it names.
    pub fn bad(&self, error: FileError) -> PyErr {
        let (file, text) = match &error.within {
            Some(within) => (Some(within.name.clone()), &within.text),
            None => (self.file.clone(), &self.text),
        };
        let line = error.line(text);
        placed(error.message, error.remedy, file, line)
    }
}
