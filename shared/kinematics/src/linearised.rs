//! The linearised model: transport matrices from every error to the tool.

use crate::nominal::Frames;
use crate::{
    Branch, ErrorModel, Kinematics, Machine, Parameter, ParameterKind, PerAxis, Situation, Twist,
};
use nalgebra::Vector3;

/// The linearised errors at one position: the pose of every error frame relative to the tool.
///
/// A small error ξ = (t, r) in a frame with pose (R, p) in the tool frame appears at the tool tip as (R·t + p × (R·r),
/// R·r): the transport matrix. Errors of the workpiece branch appear with the opposite sign.
#[derive(Clone, Debug)]
pub struct Linearised<'a, P = &'static [f64]> {
    machine: &'a Machine,
    errors: &'a ErrorModel<P>,
    q: PerAxis,
    sign: PerAxis,
    /// Frames of each axis before its motion (then of the spindle), and after it, in the tool frame.
    before: Frames,
    after: Frames,
}

impl<'a, P> Linearised<'a, P> {
    /// The linearised model at a command `q` (mm, rad).
    #[must_use]
    pub fn new(kinematics: &Kinematics<'a, P>, q: &PerAxis, situation: &Situation) -> Self {
        let (before, after) = kinematics.error_frames(q, situation.length);
        Self {
            machine: kinematics.machine,
            errors: kinematics.errors,
            q: *q,
            sign: situation.sign,
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
            ParameterKind::Backlash => self.sign[index],
            kind => {
                let motion = self.errors.motions.get(index)?;
                let at = if motion[parameter.component].holds() {
                    let [low, high] = self.errors.calibrated[index];
                    self.q[index].max(low).min(high)
                } else {
                    self.q[index]
                };
                kind.basis(at)
            }
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
