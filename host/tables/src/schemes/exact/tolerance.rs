//! What tables may deviate by: of each axis, and in what matters under the policy.

use crate::policy;
use crate::validate::Command;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::kinematics::{Jacobian, Kinematics, Policy};
use trueaxis_model::machine::PerAxis;

/// Random positions at which levers are looked at.
const PLACES: usize = 200;

/// What tables may deviate by from the kinematic correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Of each axis (mm, rad): what structures are made for. Under [`Policy::Direction`] a rotary axis
    /// may do at the tip what a linear one may, for their tables leave something alike.
    pub axes: PerAxis,
    /// Of the tip (mm) and of the tool's direction (rad), if these are what is measured.
    tool: Option<[f64; 2]>,
}

impl Tolerance {
    /// Of `mm` for linear axes or the tip.
    pub fn new(kinematics: &Kinematics<'_>, mm: f64) -> Self {
        let urad = policy::tolerance_urad(kinematics.policy, 1e3 * mm);
        let direction = 1e-6 * urad;
        let tool = matches!(kinematics.policy, Policy::Direction { .. });
        let machine = kinematics.machine;
        let mut axes = PerAxis::default();
        for (i, tolerance) in axes.iter_mut().enumerate() {
            let rotary = machine.axes.get(i).is_some_and(|a| a.letter.is_rotary());
            *tolerance = match (rotary, tool) {
                (false, _) => mm,
                (true, false) => direction,
                (true, true) => direction.min(mm / lever(kinematics, i)),
            };
        }
        Self {
            axes,
            tool: tool.then_some([mm, direction]),
        }
    }

    /// True if the tip and the tool's direction are measured, where deviations of axes that belong together
    /// cancel: tables then need far fewer points than each of them seems to.
    pub(crate) fn is_of_tool(&self) -> bool {
        self.tool.is_some()
    }

    /// A deviation (mm, rad, one per axis) in units of the tolerance; `jacobian` is that of the position.
    pub fn share(&self, deviation: &PerAxis, jacobian: &Jacobian) -> f64 {
        let Some([tip, direction]) = self.tool else {
            let shares = deviation.iter().zip(&self.axes).map(|(d, t)| d.abs() / t);
            return shares.fold(0.0, f64::max);
        };
        let [at_tip, across] = jacobian.moved(deviation);
        (at_tip / tip).max(across / direction)
    }
}

/// The largest way (mm) of the tip per rad of a rotary axis, at random positions.
fn lever(kinematics: &Kinematics<'_>, axis: usize) -> f64 {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let ways = (0..PLACES).map(|_| {
        let mut at = [0.0; trueaxis_model::machine::MAX_AXES];
        for (q, axis) in at.iter_mut().zip(&machine.axes) {
            let [low, high] = axis.travel;
            *q = if random.random::<bool>() { low } else { high };
            if axis.letter.is_rotary() {
                *q = low + (high - low) * random.random::<f64>();
            }
        }
        let mut command = Command::at(machine, &at);
        if let Some([_, longest]) = machine.length_range {
            command.auxiliaries[0] = longest as f32;
        }
        let (q, situation) = command.kinematic(machine);
        let [x, y, z, ..] = kinematics.jacobian(&q, situation.length).column(axis);
        (x * x + y * y + z * z).sqrt()
    });
    // No lever at all: the axis turns about the tip.
    ways.fold(1.0, f64::max)
}
