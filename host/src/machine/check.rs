//! What makes a machine one that can be corrected.

use super::{Machine, PerAxis};
use crate::errors::ErrorModel;
use crate::kinematics::Kinematics;

/// Why a machine cannot be corrected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineProblem {
    /// The linear axes leave a direction of space without motion.
    #[error(
        "the linear axes do not span space{at}: no correction could move the tool in every direction"
    )]
    LinearAxesDoNotSpan {
        /// ` at …`, or empty if they never do.
        at: String,
    },
    /// Two rotary axes turn about the same direction.
    #[error(
        "the rotary axes {first} and {second} are parallel{at}: a correction could not tell them apart"
    )]
    ParallelRotaryAxes {
        /// The first of them.
        first: char,
        /// The second.
        second: char,
        /// ` at …`, or empty if they always are.
        at: String,
    },
    /// Three rotary axes lose a direction somewhere in the travel.
    #[error("the three rotary axes become dependent{at}")]
    DependentRotaryAxes {
        /// ` at …`.
        at: String,
    },
}

impl MachineProblem {
    /// What to change in the description.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::LinearAxesDoNotSpan { .. } => {
                "describe at least three linear axes in different directions (lathes without a Y axis are not supported); check orientation_deg"
            }
            Self::ParallelRotaryAxes { .. } => {
                "check the letters and orientation_deg of the two axes, or leave out the one that repeats the other"
            }
            Self::DependentRotaryAxes { .. } => {
                "limit the travel of the middle rotary axis so that the position is left out"
            }
        }
    }
}

/// A problem and the axis (by index) it shows at.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineError {
    /// The axis, if one stands out.
    pub axis: Option<usize>,
    /// What is wrong.
    pub problem: MachineProblem,
}

/// Two rotary axes closer than this (rad, about a degree) count as parallel.
const PARALLEL: f64 = 0.02;
/// Linear axes with a rotary axis between them, and three rotary axes, become dependent at single
/// positions. The grid over the travel has steps of 15° at most, so within half a step of such a
/// position the volume of the directions is below this. Independent axes have 1.
const DEPENDENT: f64 = 0.13;

impl Machine {
    /// Checks that linear axes span space and rotary axes stay independent over the travel.
    ///
    /// # Errors
    /// [`MachineError`] names the axes and, if it is only somewhere in the travel, the place.
    pub fn check(&self) -> Result<(), MachineError> {
        let perfect = ErrorModel::perfect(self);
        let kinematics = Kinematics::new(self, &perfect);
        let rotary: Vec<usize> = (0..self.axes.len())
            .filter(|i| self.axes[*i].letter.is_rotary())
            .collect();
        // Directions depend on rotary positions only: a grid over them sees every case.
        let mut positions = vec![PerAxis::default()];
        for &i in &rotary {
            let [low, high] = self.axes[i].travel.map(f64::to_radians);
            positions = positions
                .iter()
                .flat_map(|p| {
                    (0..=24).map(move |k| {
                        let mut p = *p;
                        p[i] = low + (high - low) * f64::from(k) / 24.0;
                        p
                    })
                })
                .collect();
        }
        for q in std::iter::once(&PerAxis::default()).chain(&positions) {
            let at = if *q == PerAxis::default() {
                String::new()
            } else {
                let place: Vec<String> = rotary
                    .iter()
                    .map(|i| format!("{} = {:.1}°", self.axes[*i].letter, q[*i].to_degrees()))
                    .collect();
                format!(" at {}", place.join(", "))
            };
            let jacobian = kinematics.jacobian(q, None);
            if jacobian.linear_volume() < DEPENDENT {
                return Err(MachineError {
                    axis: None,
                    problem: MachineProblem::LinearAxesDoNotSpan { at },
                });
            }
            if let Some((i, j)) = jacobian.parallel_rotary_axes(PARALLEL) {
                return Err(MachineError {
                    axis: Some(j),
                    problem: MachineProblem::ParallelRotaryAxes {
                        first: self.axes[i].letter.char(),
                        second: self.axes[j].letter.char(),
                        at,
                    },
                });
            }
            if rotary.len() == 3 && jacobian.rotary_volume() < DEPENDENT {
                return Err(MachineError {
                    axis: None,
                    problem: MachineProblem::DependentRotaryAxes { at },
                });
            }
        }
        Ok(())
    }
}
