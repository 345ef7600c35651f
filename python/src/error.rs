//! What is raised and what is warned of: a message, the place in a file, and what to do instead.

use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use std::ffi::CString;
use std::io::ErrorKind;
use std::path::Path;
use trueaxis_model::source::FileError;

pyo3::create_exception!(
    trueaxis,
    Error,
    PyValueError,
    "Bad input. `message` says what is wrong, `remedy` what to do; `file` and `line` where, or None."
);

pyo3::create_exception!(
    trueaxis,
    TrueaxisWarning,
    PyUserWarning,
    "What to check before a result is trusted."
);

/// Warns at the line of the caller.
pub fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    // A NUL cannot be shown.
    let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<TrueaxisWarning>(), &message, 1)
}

/// An error without a place.
pub fn raise(message: impl Into<String>, remedy: impl Into<String>) -> PyErr {
    placed(message.into(), remedy.into(), None, None)
}

fn placed(message: String, remedy: String, file: Option<String>, line: Option<usize>) -> PyErr {
    let place = place(file.as_deref(), line);
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

fn place(file: Option<&str>, line: Option<usize>) -> String {
    match (file, line) {
        (Some(file), Some(line)) => format!("{file}, line {line}: "),
        (Some(file), None) => format!("{file}: "),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    }
}

/// The exception of Python for files, with its `errno` and `filename`: `FileNotFoundError` and its siblings.
pub fn os_error(path: &Path, error: std::io::Error) -> PyErr {
    let Some(code) = error.raw_os_error() else {
        return placed(
            error.to_string(),
            "check the file".into(),
            Some(path.display().to_string()),
            None,
        );
    };
    let message = error.to_string();
    let message = message.split(" (os error").next().unwrap_or_default();
    PyOSError::new_err((code, message.to_owned(), path.as_os_str().to_owned()))
}

/// Writes a file.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> PyResult<()> {
    std::fs::write(path, bytes).map_err(|error| os_error(path, error))
}

/// A text with the name of its file, if it has one.
pub struct NamedText {
    pub file: Option<String>,
    pub text: String,
}

impl NamedText {
    /// Reads a file.
    pub fn read(path: &Path) -> PyResult<Self> {
        let file = Some(path.display().to_string());
        match std::fs::read_to_string(path) {
            Ok(text) => Ok(Self { file, text }),
            Err(error) if error.kind() == ErrorKind::InvalidData => Err(placed(
                "this is not UTF-8 text".into(),
                "save the file as UTF-8 text".into(),
                file,
                None,
            )),
            Err(error) => Err(os_error(path, error)),
        }
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

    /// A doubt about it, with its place and remedy.
    pub fn said(&self, doubt: &FileError) -> String {
        let place = place(self.file.as_deref(), doubt.line(&self.text));
        format!("{place}{}\n  {}", doubt.message, doubt.remedy)
    }
}
