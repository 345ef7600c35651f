//! Why runs give no errors.

/// Why there is no result; files by index.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DirectError {
    /// A reading has more motions than there are readings.
    #[error("{} cannot be distinguished by these readings", motions.join(", "))]
    Mixed {
        /// The files.
        files: Vec<usize>,
        /// The motions that show.
        motions: Vec<String>,
    },
    /// The same was measured several times.
    #[error("{} was measured more than once", motions.join(", "))]
    Twice {
        /// The files.
        files: Vec<usize>,
        /// The motions that show.
        motions: Vec<String>,
    },
    /// What must be looked for together was measured at different places.
    #[error("the targets or directions of travel are not the same")]
    Different {
        /// The files.
        files: [usize; 2],
    },
    /// Linear axes cannot follow a ball.
    #[error("the linear axes cannot follow a ball")]
    NotFollowed {
        /// The file.
        file: usize,
    },
    /// A square that no location explains.
    #[error("no location of these axes is their squareness")]
    NoLocation {
        /// The file.
        file: usize,
    },
    /// The readings belong to no small errors.
    #[error("no small errors show these readings")]
    NotConverged,
}

impl DirectError {
    /// The files (by index) it is about.
    #[must_use]
    pub fn files(&self) -> Vec<usize> {
        match self {
            Self::Mixed { files, .. } | Self::Twice { files, .. } => files.clone(),
            Self::Different { files } => files.to_vec(),
            Self::NotFollowed { file } | Self::NoLocation { file } => vec![*file],
            Self::NotConverged => Vec::new(),
        }
    }

    /// What to do.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Mixed { .. } => {
                "give the runs that read in other directions in the same command: their frames or the turning axis mix what the instrument shows"
            }
            Self::Twice { .. } => {
                "give one file of each; repeated runs are columns of one file, or import them one after the other with --update"
            }
            Self::Different { .. } => {
                "measure them at the same targets and in the same directions, for they are looked for together"
            }
            Self::NotFollowed { .. } => {
                "the ball is kept on the indicator by linear axes, which this machine lacks"
            }
            Self::NoLocation { .. } => {
                "a square has lines along two linear axes that are across each other"
            }
            Self::NotConverged => {
                "look whether unit and signs are right, and whether the machine file describes this machine (trueaxis pose)"
            }
        }
    }
}
