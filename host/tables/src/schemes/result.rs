//! The result of a scheme.

use trueaxis::Draft;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::DrawError;

/// Tables and terms, with what the scheme knows about them.
#[derive(Clone, Debug)]
pub struct SchemeResult {
    /// The compensation, ready to be encoded except for the bounds of its axes.
    pub draft: Draft,
    /// Largest difference from the kinematic correction at random positions before interpolation, in units of the
    /// tolerance; only from schemes that measure it.
    pub structure_error: Option<f64>,
    /// The tolerance (mm, as in the options) that the tables meet according to the scheme's own measurements: the
    /// requested one, or `None`.
    pub meets: Option<f64>,
    /// True if more tables, terms or bytes would be needed than the target holds.
    pub is_full: bool,
    /// Notes for the user on how it was found, one sentence each.
    pub notes: Vec<String>,
}

/// Why a scheme has no result.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SchemeError {
    /// The kinematic correction does not converge somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// Positions for measurements cannot be drawn.
    #[error(transparent)]
    Draw(DrawError),
    /// More tables than a blob can number.
    #[error("{tables} tables are needed, a compensation file has at most 255")]
    TooManyTables {
        /// The number needed.
        tables: usize,
    },
    /// The scheme requires a machine with other axes.
    #[error("{scheme} needs {needs}: this machine has {linear} linear and {rotary} rotary axes")]
    Axes {
        /// Name of the scheme.
        scheme: String,
        /// The axes it requires.
        needs: &'static str,
        /// Linear axes of the machine.
        linear: usize,
        /// Rotary axes of the machine.
        rotary: usize,
    },
    /// No grid up to the largest is large enough.
    #[error(
        "with {most} nodes along each axis the threshold of {threshold_um} µm is not met: one more changes the remaining error by {change_um:.3} µm"
    )]
    Threshold {
        /// The requested threshold (µm).
        threshold_um: f64,
        /// Number of nodes along each axis of the largest grid.
        most: usize,
        /// Change of the root mean square of the remaining error there (µm).
        change_um: f64,
    },
    /// The correction of this machine is not a sum of products of functions of one axis each.
    #[error(
        "fik knows no closed form for this machine: a rotary axis lies between its linear axes, or it has three rotary axes and --policy direction"
    )]
    NoClosedForm,
    /// More adjustable weights than a blob can hold.
    #[error("{needed} adjustable terms are needed, a compensation has at most {held}")]
    TooManyWeights {
        /// The number needed.
        needed: usize,
        /// The number a blob can hold.
        held: usize,
    },
    /// The machine has no such error, so it has no weight.
    #[error("this machine has no error parameter {name}")]
    NoSuchError {
        /// Name.
        name: String,
    },
    /// More tables were requested than the target holds.
    #[error("{asked} tables are asked for, the target has room for {held}")]
    MoreThanTarget {
        /// The number requested.
        asked: usize,
        /// The number the target holds.
        held: usize,
    },
    /// The zero position does not have one value per axis.
    #[error("the zero position has {given} values, the machine has {axes} axes")]
    ZeroPosition {
        /// Number of values given.
        given: usize,
        /// Number of axes.
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
    /// Rejects machines that do not have three linear and two rotary axes, in the name of a scheme.
    ///
    /// # Errors
    /// [`SchemeError::Axes`].
    pub(crate) fn unless_five_axes(machine: &Machine, scheme: &str) -> Result<(), Self> {
        match Self::axes(machine, scheme, "three linear and two rotary axes") {
            Self::Axes {
                linear: 3,
                rotary: 2,
                ..
            } => Ok(()),
            other => Err(other),
        }
    }

    /// The error for a machine whose axes are not those that a scheme needs.
    pub fn axes(machine: &Machine, scheme: &str, needs: &'static str) -> Self {
        let axes = machine.axes.iter();
        let rotary = axes.filter(|axis| axis.letter.is_rotary()).count();
        Self::Axes {
            scheme: scheme.to_owned(),
            needs,
            linear: machine.axes.len() - rotary,
            rotary,
        }
    }

    /// What to do about the error.
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
                "raise --tolerance, or --minimize cost where another was chosen; with --scheme fik write fewer errors"
            }
            Self::Axes { .. } => "use --scheme exact, which takes any machine",
            Self::Threshold { .. } => {
                "raise --threshold above that, or --max-nodes if the controller has room for more; if the error file has a [calibrated] range, --zone calibrated leaves out what bends where it ends"
            }
            Self::NoClosedForm => {
                "use --scheme exact, which takes any machine; with three rotary axes also --policy orientation"
            }
            Self::TooManyWeights { .. } => "name fewer errors with --adjust",
            Self::NoSuchError { .. } => "give names as in the error file, such as EB0A or EXX1",
            Self::MoreThanTarget { .. } => "ask for fewer, or give another --target",
            Self::ZeroPosition { .. } => "give one position for each axis",
        }
    }
}
