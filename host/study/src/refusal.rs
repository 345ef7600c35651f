//! Why there is no outcome.

use trueaxis_direct::DirectError;
use trueaxis_identify::{IdentifyError, Mistake, ModelError, ThermalError};
use trueaxis_model::errors::Parameter;

/// Why there is no outcome.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyRefusal {
    /// The measurements do not determine the parameters, or fit no machine.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Balls or stylus are not where they are stated to be.
    #[error("{}", .0.what)]
    Misplaced(Mistake),
    /// The machine does not have the parameters.
    #[error(transparent)]
    Model(ModelError),
    /// A parameter of the model belongs to a motion that is known as a table.
    #[error("{parameter} is part of {}, which is known as a table", &.parameter.to_string()[..3])]
    Tabulated {
        /// The parameter.
        parameter: Parameter,
    },
    /// The machine does not have the parameters that may change with temperature.
    #[error(transparent)]
    Thermal(ModelError),
    /// The temperatures cannot be used.
    #[error(transparent)]
    Temperatures(ThermalError),
    /// Runs do not determine error motions.
    #[error("{}{error}", if .files.is_empty() { String::new() } else { format!("{}: ", .files.join(", ")) })]
    Runs {
        /// Names of the files.
        files: Vec<String>,
        /// What is wrong with them.
        error: DirectError,
    },
    /// Tables of runs and everything else disagree.
    #[error(
        "the motions that the runs show and the other parameters do not settle within {rounds} rounds"
    )]
    Unsettled {
        /// How often both were computed.
        rounds: usize,
    },
    /// Rows to leave out are named wrongly, or there are none.
    #[error("{0}")]
    Without(String),
    /// The errors to compare with have more than parameters.
    #[error("tables and thermal changes cannot be compared by --before")]
    Incomparable,
    /// The errors to compare with have none of the parameters that are looked for.
    #[error("none of its parameters is looked for")]
    Uncompared,
}

/// The input that a refusal is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusedInput {
    /// All files of measurements.
    Measurements,
    /// The choice of parameters.
    Model,
    /// The choice of parameters that change with temperature.
    Thermal,
    /// The log of temperatures.
    Temperatures,
    /// The rows to leave out.
    Without,
    /// The errors to compare with.
    Before,
    /// Runs, which the words name.
    Runs,
}

impl StudyRefusal {
    /// The input to look at.
    #[must_use]
    pub fn about(&self) -> RefusedInput {
        match self {
            Self::Identify(_) | Self::Misplaced(_) => RefusedInput::Measurements,
            Self::Model(_) | Self::Tabulated { .. } => RefusedInput::Model,
            Self::Thermal(_) => RefusedInput::Thermal,
            Self::Temperatures(_) => RefusedInput::Temperatures,
            Self::Without(_) => RefusedInput::Without,
            Self::Incomparable | Self::Uncompared => RefusedInput::Before,
            Self::Runs { .. } | Self::Unsettled { .. } => RefusedInput::Runs,
        }
    }

    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Identify(error) => error.remedy().to_owned(),
            Self::Misplaced(mistake) => mistake.remedy.clone(),
            Self::Model(error) | Self::Thermal(error) => error.remedy.clone(),
            Self::Temperatures(error) => error.remedy.clone(),
            Self::Tabulated { .. } => {
                "leave it out of --model; or give its runs with --observations to fit it to them and to everything else".to_owned()
            }
            Self::Runs { error, .. } => format!(
                "{}; or give these files with --observations, and name parameters of these motions in --model",
                error.remedy
            ),
            Self::Unsettled { .. } => {
                "give the runs with --observations, to fit all together".to_owned()
            }
            Self::Without(_) => {
                "name rows as \"line 17\", \"ball 3\", \"C = 90\", \"S = 180\", \"setup bar\" or \"bar.csv line 12\"".to_owned()
            }
            Self::Incomparable => {
                "identify without --before, and look at the parameters side by side".to_owned()
            }
            Self::Uncompared => {
                "give --before what identify wrote with the same --model before the compensation was on".to_owned()
            }
        }
    }
}
