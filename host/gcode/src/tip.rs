//! Tool-centre-point control: words are the tip in workpiece coordinates, and A, B, C themselves.
//!
//! World coordinates are those of LinuxCNC's kinematics and of G43.4: seen from the workpiece, and with all rotary
//! axes at zero the same as those of X, Y and Z. So world(q) = tip(q) − tip(0), where tip is that of the nominal
//! pose, and 0 the machine with all axes at zero.

use super::axes::{self, COUNT, PerLetter};
use super::codes::Code;
use super::fault::Fault;
use super::state::{Rules, State};
use super::words::{Block, Word};
use trueaxis_kinematics::Nominal;
use trueaxis_kinematics::nalgebra::{Matrix3, Vector3};
use trueaxis_model::machine::{Machine, PerAxis};

/// Between axis positions and world coordinates.
#[derive(Clone, Debug)]
pub struct Tip<'a> {
    machine: &'a Machine,
    nominal: Nominal<'a>,
    /// Letter of each axis of the machine.
    letters: Vec<usize>,
}

impl<'a> Tip<'a> {
    /// # Errors
    /// A machine whose workpiece coordinates are not those of its linear axes at zero.
    pub fn new(machine: &'a Machine) -> Result<Self, String> {
        let letters = machine.axes.iter();
        let letters: Vec<usize> = letters.map(|a| axes::of_machine(a.letter)).collect();
        let linear = letters.iter().filter(|l| !axes::is_rotary(**l));
        if linear.clone().count() != 3 || linear.clone().any(|l| *l > 2) {
            return Err("its linear axes are not X, Y and Z".to_owned());
        }
        let tip = Self {
            machine,
            nominal: Nominal::new(machine),
            letters,
        };
        for axis in 0..3 {
            let mut q = [0.0; COUNT];
            q[axis] = 1.0;
            let world = tip.world(&q, None);
            if (0..3).any(|i| (world[i] - q[i]).abs() > 1e-9) {
                return Err(format!(
                    "with rotary axes at zero a command of {} does not move the tool along {0} of the workpiece frame",
                    axes::name(axis)
                ));
            }
        }
        Ok(tip)
    }

    fn position(&self, q: &PerLetter) -> PerAxis {
        let mut at = PerAxis::default();
        for (place, (axis, letter)) in self.machine.axes.iter().zip(&self.letters).enumerate() {
            at[place] = axis.to_kinematic(q[*letter]);
        }
        at
    }

    fn tip(&self, q: &PerLetter, length: Option<f64>) -> Vector3<f64> {
        self.nominal.pose(&self.position(q), length).t
    }

    /// Before a line that switches tool-centre-point control on and moves: the place where the program stands becomes
    /// that of the tip. Returns true for such a line.
    ///
    /// # Errors
    /// Those of the modes of the line.
    pub(crate) fn enter(
        &self,
        state: &mut State,
        block: &Block,
        rules: &Rules,
        takes_length: bool,
    ) -> Result<bool, Fault> {
        let is_on = |word: &Word| word.code(rules.dialect) == Some(Code::TipOn);
        let moves = block.words.iter().any(|w| axes::index(w.letter).is_some());
        if state.tip || state.ended || !moves || !block.has_codes || !block.words.iter().any(is_on)
        {
            return Ok(false);
        }
        let mut with_tool = state.clone();
        with_tool.modes(block, rules)?;
        let length = with_tool.field_length(rules, takes_length);
        state.position.at = self.world(&state.position.at, length);
        Ok(true)
    }

    /// World coordinates of axis positions (mm, degrees), with a tool of this length (mm).
    #[must_use]
    pub fn world(&self, q: &PerLetter, length: Option<f64>) -> PerLetter {
        let tip = self.tip(q, length) - self.tip(&[0.0; COUNT], length);
        let mut world = *q;
        world[..3].copy_from_slice(tip.as_slice());
        world
    }

    /// Axis positions of world coordinates: linear axes follow from the rotary ones.
    #[must_use]
    pub fn axes(&self, world: &PerLetter, length: Option<f64>) -> Option<PerLetter> {
        let mut q = *world;
        q[..3].fill(0.0);
        let base = self.world(&q, length);
        let mut columns = Matrix3::zeros();
        for axis in 0..3 {
            let mut moved = q;
            moved[axis] = 1.0;
            let at = self.world(&moved, length);
            for row in 0..3 {
                columns[(row, axis)] = at[row] - base[row];
            }
        }
        let rest = Vector3::new(world[0] - base[0], world[1] - base[1], world[2] - base[2]);
        let linear = columns.try_inverse()? * rest;
        q[..3].copy_from_slice(linear.as_slice());
        Some(q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn world_coordinates_are_those_of_linuxcnc_s_xyzac_trt_and_lead_back() {
        let text = include_str!("../../../examples/linuxcnc-xyzac-trt/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let tip = Tip::new(&machine).unwrap();
        let mut q = [0.0; COUNT];
        q[..6].copy_from_slice(&[123.0, 77.0, -40.0, 33.0, 0.0, -71.0]);
        let world = tip.world(&q, None);
        // kinematicsForward of trtkins with what the machine file says of its pins:
        // rotation point (200, 150, −320), y-offset −5, z-offset 40, tool-offset 100.
        let (a, c) = (33_f64.to_radians(), (-71_f64).to_radians());
        let (x, y, z) = (q[0] - 200.0, q[1] - 150.0, q[2] + 320.0);
        let (dy, dz) = (-5.0, 40.0 + 100.0);
        let expected = [
            libm::cos(c) * x
                + libm::sin(c) * libm::cos(a) * (y - dy)
                + libm::sin(c) * libm::sin(a) * (z - dz)
                + libm::sin(c) * dy
                + 200.0,
            -libm::sin(c) * x
                + libm::cos(c) * libm::cos(a) * (y - dy)
                + libm::cos(c) * libm::sin(a) * (z - dz)
                + libm::cos(c) * dy
                + 150.0,
            -libm::sin(a) * (y - dy) + libm::cos(a) * (z - dz) + dz - 320.0,
        ];
        for (at, expected) in world.iter().zip(expected) {
            assert!((at - expected).abs() < 1e-9, "{world:?} {expected}");
        }
        let back = tip.axes(&world, None).unwrap();
        for (at, expected) in back.iter().zip(q) {
            assert!((at - expected).abs() < 1e-9);
        }
    }
}
