//! Options that apply to every scheme.

use super::SchemeError;
use crate::target::Target;
use trueaxis::SampleFormat;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};

/// Options of the tables, whatever the scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What the rotary axes correct.
    pub policy: Policy,
    /// Permitted deviation of the tables from the kinematic correction: mm for linear axes, the same number in
    /// milliradians for rotary axes (0.05 µm and 0.05 µrad: 5e-5).
    pub tolerance: f64,
    /// Points of every table that is not a straight line; chosen by the tolerance if `None`.
    pub points: Option<usize>,
    /// How samples are stored.
    pub format: SampleFormat,
    /// Position (mm, deg, one per axis) whose correction is subtracted everywhere.
    pub zero_at: Option<Vec<f64>>,
    /// The controller's capacity. A scheme may leave out what does not fit; whether the result fits is checked
    /// afterwards.
    pub target: Target,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            policy: Policy::default(),
            tolerance: 5e-5,
            points: None,
            format: SampleFormat::F32,
            zero_at: None,
            target: Target::default(),
        }
    }
}

impl Options {
    /// The correction (mm, rad) at the zero position, which is subtracted from the tables everywhere; zero if no
    /// position is set. It is that of the machine's own tool, unknown directions and reference temperature.
    ///
    /// # Errors
    /// [`SchemeError::ZeroPosition`], or an error if the kinematic correction fails there.
    pub fn zero(&self, machine: &Machine, errors: &ErrorModel) -> Result<PerAxis, SchemeError> {
        let Some(position) = &self.zero_at else {
            return Ok(PerAxis::default());
        };
        if position.len() != machine.axes.len() {
            return Err(SchemeError::ZeroPosition {
                given: position.len(),
                axes: machine.axes.len(),
            });
        }
        let q = machine.to_kinematic(position);
        let kinematics = Kinematics::new(machine, errors).with_policy(self.policy);
        let correction = kinematics.correction(&q, &Situation::default(), &Switches::ALL)?;
        Ok(correction.dq)
    }
}
