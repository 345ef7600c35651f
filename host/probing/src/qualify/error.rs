//! Why touches qualify nothing.

/// Why touches qualify nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct QualifyError {
    what: String,
    /// What to do about it.
    pub remedy: &'static str,
}

impl QualifyError {
    pub(super) fn new(what: impl Into<String>, remedy: &'static str) -> Self {
        let what = what.into();
        Self { what, remedy }
    }

    pub(super) fn too_few(touches: usize, unknowns: usize) -> Self {
        Self::new(
            format!("{touches} touches are too few for {unknowns} unknowns"),
            "touch the ball more often: --around 12",
        )
    }

    pub(super) fn no_sphere() -> Self {
        Self::new(
            "the touches do not show where the ball is: they are in a plane, or on one side of it",
            "touch it at two latitudes and at the pole: --around 12",
        )
    }
}
