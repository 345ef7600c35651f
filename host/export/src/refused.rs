//! Why a file for a controller cannot be made.

use trueaxis_model::source::FileError;

/// Why nothing is exported.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{cause}")]
pub struct NotExported {
    /// What is wrong.
    pub cause: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl NotExported {
    pub(crate) fn new(cause: impl Into<String>, remedy: &'static str) -> Self {
        let cause = cause.into();
        Self { cause, remedy }
    }

    /// What was written is not read.
    pub(crate) fn unread(error: FileError) -> Self {
        Self::new(
            format!("the written file cannot be read back: {}", error.message),
            "this is a fault of trueaxis: please report it with the files",
        )
    }
}
