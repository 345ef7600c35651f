//! From a tolerance to what each axis, the tip and the tool direction may deviate.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::kinematics::{Jacobian, Kinematics, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::policy;
use trueaxis_model::validate::Command;

/// Number of random positions at which levers are computed.
const LEVER_PLACES: usize = 200;

/// Permitted deviation of tables from the kinematic correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// For each axis (mm, rad); structures are made for it. Under [`Policy::Direction`] a rotary axis may move the
    /// tip as far as a linear one, because their tables leave similar errors.
    pub axes: PerAxis,
    /// For the tip (mm) and the tool direction (rad), if these are what is measured.
    tool: Option<[f64; 2]>,
}

impl Tolerance {
    /// The tolerance if linear axes or the tip may deviate by `mm`.
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

/// The largest displacement (mm) of the tip per rad of a rotary axis, at random positions.
fn lever(kinematics: &Kinematics<'_>, axis: usize) -> f64 {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let ways = (0..LEVER_PLACES).map(|_| {
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
    // The axis turns about the tip if there is no lever.
    ways.fold(1.0, f64::max)
}
