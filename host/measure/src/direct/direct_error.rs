//! Why runs do not determine errors.

/// Why there is no result; files are given by index.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DirectError {
    /// Readings contain more motions than there are readings.
    #[error("{} cannot be distinguished by these readings", motions.join(", "))]
    Mixed {
        /// The files.
        files: Vec<usize>,
        /// The motions that show.
        motions: Vec<String>,
    },
    /// One quantity was measured several times.
    #[error("{} was measured more than once", motions.join(", "))]
    Twice {
        /// The files.
        files: Vec<usize>,
        /// The motions that show.
        motions: Vec<String>,
    },
    /// Motions that must be solved for together were measured at different targets.
    #[error("the targets or directions of travel are not the same")]
    Different {
        /// The files.
        files: [usize; 2],
    },
    /// The linear axes cannot follow a ball.
    #[error("the linear axes cannot follow a ball")]
    NotFollowed {
        /// The file.
        file: usize,
    },
    /// A square whose readings no location explains.
    #[error("no location of these axes is their squareness")]
    NoLocation {
        /// The file.
        file: usize,
    },
    /// The readings are not those of small errors.
    #[error("no small errors show these readings")]
    NotConverged,
}

impl DirectError {
    /// The files (by index) that the error is about.
    #[must_use]
    pub fn files(&self) -> Vec<usize> {
        match self {
            Self::Mixed { files, .. } | Self::Twice { files, .. } => files.clone(),
            Self::Different { files } => files.to_vec(),
            Self::NotFollowed { file } | Self::NoLocation { file } => vec![*file],
            Self::NotConverged => Vec::new(),
        }
    }

    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Mixed { .. } => {
                "give the runs that read in other directions in the same command: their frames or the turning axis mix the readings"
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
