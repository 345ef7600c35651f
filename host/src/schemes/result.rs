//! What every scheme returns.

use crate::kinematics::NotConverged;
use crate::machine::Machine;
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
    /// The scheme is made for machines with other axes.
    #[error("{scheme} needs {needs}: this machine has {linear} linear and {rotary} rotary axes")]
    Axes {
        /// Name of the scheme.
        scheme: String,
        /// Which axes it needs.
        needs: &'static str,
        /// Linear axes of the machine.
        linear: usize,
        /// Rotary axes of the machine.
        rotary: usize,
    },
    /// No grid up to the largest is large enough.
    #[error(
        "with {most} nodes along each axis the threshold of {threshold_um} µm is not met: one more changes the error that is left by {change_um:.3} µm"
    )]
    Threshold {
        /// What was asked for (µm).
        threshold_um: f64,
        /// Nodes along each axis of the largest grid.
        most: usize,
        /// By how much the root mean square of what is left still changes there (µm).
        change_um: f64,
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
    /// Refuses machines without three linear and two rotary axes, for a scheme of this name.
    ///
    /// # Errors
    /// [`SchemeError::Axes`].
    pub fn unless_five_axes(machine: &Machine, scheme: &str) -> Result<(), Self> {
        let axes = machine.axes.iter();
        let rotary = axes.filter(|axis| axis.letter.is_rotary()).count();
        let linear = machine.axes.len() - rotary;
        match (linear, rotary) {
            (3, 2) => Ok(()),
            _ => Err(Self::Axes {
                scheme: scheme.to_owned(),
                needs: "three linear and two rotary axes",
                linear,
                rotary,
            }),
        }
    }

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
            Self::Axes { .. } => "use --scheme exact, which takes any machine",
            Self::Threshold { .. } => {
                "raise --threshold above that, or --max-nodes if the controller holds more; if the error file has a [calibrated] range, --zone calibrated leaves out what bends where it ends"
            }
            Self::ZeroPosition { .. } => "give one position for each axis",
        }
    }
}
