//! The linearised model: transport matrices from every error to the tool.

use super::{Htm, Kinematics, Twist};
use crate::errors::{Parameter, ParameterKind, Situation};
use crate::machine::{Branch, Machine, PerAxis};
use nalgebra::Vector3;

/// Where errors act, at one position: the pose of every error frame, seen from the tool.
///
/// A small error ξ = (t, r) in a frame whose pose in the tool frame is (R, p) shows at the tool
/// tip as (R·t + p × (R·r), R·r): the transport matrix. Errors of the workpiece branch show
/// with the opposite sign.
#[derive(Clone, Debug)]
pub struct Linearised<'a> {
    machine: &'a Machine,
    q: PerAxis,
    sign: PerAxis,
    calibrated: Vec<[f64; 2]>,
    holds: Vec<[bool; 6]>,
    /// Frames of each axis before its motion (then of the spindle), and after it, in the tool frame.
    before: Vec<Htm>,
    after: Vec<Htm>,
}

impl<'a> Linearised<'a> {
    /// The linearised model at a command `q` (mm, rad).
    #[must_use]
    pub fn new(kinematics: &Kinematics<'a>, q: &PerAxis, situation: &Situation) -> Self {
        let machine = kinematics.machine;
        let n = machine.axes.len();
        let (before, after) = kinematics.error_frames(q, situation.length);
        Self {
            machine,
            q: *q,
            sign: situation.sign,
            calibrated: kinematics.errors.calibrated.clone(),
            holds: (0..n)
                .map(|i| std::array::from_fn(|c| kinematics.errors.motions[i][c].holds()))
                .collect(),
            before,
            after,
        }
    }

    /// The volumetric error (tool frame, mm and rad) per unit of one parameter: a column of the
    /// Jacobian of geometric errors, Eqs. 50, 53–58 of the source document.
    ///
    /// `None` if the machine has no such axis.
    #[must_use]
    pub fn column(&self, parameter: Parameter) -> Option<Twist> {
        let index = match parameter.axis {
            'S' => self.machine.axes.len(),
            letter => self.machine.index(letter)?,
        };
        let tool =
            index == self.machine.axes.len() || self.machine.axes[index].branch == Branch::Tool;
        let factor = match parameter.kind {
            ParameterKind::Inter => 1.0,
            ParameterKind::Degree(k) => {
                let [low, high] = self.calibrated[index];
                let held = self.q[index].max(low).min(high);
                let at = if self.holds[index][parameter.component] {
                    held
                } else {
                    self.q[index]
                };
                at.powi(i32::from(k))
            }
            ParameterKind::Backlash => self.sign[index],
        };
        let frame = if parameter.kind == ParameterKind::Inter {
            &self.before[index]
        } else {
            &self.after[index]
        };
        let axis: Vector3<f64> = frame.r.column(parameter.component % 3).into_owned();
        let sign = if tool { factor } else { -factor };
        Some(if parameter.is_angular() {
            Twist {
                t: frame.t.cross(&axis) * sign,
                r: axis * sign,
            }
        } else {
            Twist {
                t: axis * sign,
                r: Vector3::zeros(),
            }
        })
    }
}
