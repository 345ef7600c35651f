//! Why runs do not determine errors.

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct DirectError {
    /// The files (by index) that it is about.
    pub files: Vec<usize>,
    /// What is wrong.
    pub what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl DirectError {
    pub(crate) fn new(files: Vec<usize>, what: impl Into<String>, remedy: &'static str) -> Self {
        let what = what.into();
        Self {
            files,
            what,
            remedy,
        }
    }

    /// Readings contain more motions than there are readings.
    pub(crate) fn mixed(files: Vec<usize>, motions: &str) -> Self {
        let what = format!("{motions} cannot be distinguished by these readings");
        Self::new(
            files,
            what,
            "give the runs that read in other directions in the same command: their frames or the turning axis mix the readings",
        )
    }

    /// One quantity was measured several times.
    pub(crate) fn twice(files: Vec<usize>, motions: &str) -> Self {
        let what = format!("{motions} was measured more than once");
        Self::new(
            files,
            what,
            "give one file of each; repeated runs are columns of one file, or import them one after the other with --update",
        )
    }

    pub(crate) fn not_converged() -> Self {
        Self::new(
            Vec::new(),
            "no small errors show these readings",
            "look whether unit and signs are right, and whether the machine file describes this machine (trueaxis pose)",
        )
    }
}
