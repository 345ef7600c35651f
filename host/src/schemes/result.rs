//! What every scheme returns.

use crate::kinematics::NotConverged;
use crate::validate::DrawError;
use trueaxis::Draft;

/// Tables and terms, with what the scheme knows about them.
#[derive(Clone, Debug)]
pub struct Found {
    /// The compensation, ready to be encoded but for the bounds of its axes.
    pub draft: Draft,
    /// Largest difference to the kinematic correction at random places before interpolation, in
    /// units of the tolerance; for schemes that try their structure.
    pub structure_error: Option<f64>,
    /// The tolerance (mm, as in the options) that the scheme measured its tables to meet: the one
    /// asked for, a coarser one, or none.
    pub meets: Option<f64>,
    /// True if more tables, terms or bytes would be needed than the target holds.
    pub is_full: bool,
    /// What a user may want to know of how it was found, one sentence each.
    pub notes: Vec<String>,
}

/// Why a scheme has found nothing.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SchemeError {
    /// The kinematic correction itself fails somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// Positions to measure at cannot be drawn.
    #[error(transparent)]
    Draw(DrawError),
    /// More tables than a blob can number.
    #[error("{tables} tables are needed, a blob holds at most 255")]
    TooManyTables {
        /// How many.
        tables: usize,
    },
    /// The zero position has another number of values than the machine has axes.
    #[error("the zero position has {given} values, the machine has {axes} axes")]
    ZeroPosition {
        /// Values given.
        given: usize,
        /// Axes.
        axes: usize,
    },
}

impl From<DrawError> for SchemeError {
    fn from(error: DrawError) -> Self {
        match error {
            DrawError::NotConverged(error) => Self::NotConverged(error),
            rare @ DrawError::Rare { .. } => Self::Draw(rare),
        }
    }
}

impl SchemeError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotConverged(_) => {
                "check the units of the error parameters (mm and rad), and where they are known under [calibrated]"
            }
            Self::Draw(_) => {
                "widen [calibrated] in the error file: it is in mm or degrees of the command"
            }
            Self::TooManyTables { .. } => {
                "raise --tolerance, or --minimize cost where another was chosen"
            }
            Self::ZeroPosition { .. } => "give one position for each axis",
        }
    }
}
