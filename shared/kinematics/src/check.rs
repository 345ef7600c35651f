//! Checks whether a machine can be corrected.

use crate::{Letter, MAX_AXES, Machine, Nominal, PerAxis};
use core::fmt;

/// Where a problem occurs: the positions of the rotary axes, or everywhere. Displayed as ` at A = 90.0°` or as an empty
/// string.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RotaryPositions {
    /// Rotary axes with their positions (degrees).
    pub rotary: [Option<(Letter, f64)>; MAX_AXES],
}

impl fmt::Display for RotaryPositions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (letter, degrees)) in self.rotary.iter().flatten().enumerate() {
            let before = if k == 0 { " at" } else { "," };
            write!(f, "{before} {letter} = {degrees:.1}°")?;
        }
        Ok(())
    }
}

/// Why a machine cannot be corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MachineProblem {
    /// Fewer than three or more than six axes.
    NumberOfAxes {
        /// Number of axes.
        axes: usize,
    },
    /// Two axes have the same letter.
    RepeatedAxis {
        /// The repeated letter.
        letter: char,
    },
    /// The linear axes cannot move in some direction.
    LinearAxesDoNotSpan {
        /// Where this happens.
        at: RotaryPositions,
    },
    /// Two rotary axes turn about the same direction.
    ParallelRotaryAxes {
        /// Letter of the first axis.
        first: char,
        /// Letter of the second axis.
        second: char,
        /// Where this happens.
        at: RotaryPositions,
    },
    /// The directions of three rotary axes become dependent somewhere in the travel.
    DependentRotaryAxes {
        /// Where this happens.
        at: RotaryPositions,
    },
}

impl fmt::Display for MachineProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NumberOfAxes { axes } => {
                write!(f, "the machine has {axes} axes, not three to six")
            }
            Self::RepeatedAxis { letter } => write!(f, "axis {letter} is described twice"),
            Self::LinearAxesDoNotSpan { at } => write!(
                f,
                "the linear axes do not span space{at}: no correction could move the tool in every direction"
            ),
            Self::ParallelRotaryAxes { first, second, at } => write!(
                f,
                "the rotary axes {first} and {second} are parallel{at}: a correction could not distinguish them"
            ),
            Self::DependentRotaryAxes { at } => {
                write!(f, "the three rotary axes become dependent{at}")
            }
        }
    }
}

impl MachineProblem {
    /// How to change the description of the machine.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NumberOfAxes { .. } => "describe three to six axes",
            Self::RepeatedAxis { .. } => "give each axis its own letter (X Y Z U V W, A B C), once",
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

/// A problem and the index of the affected axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineError {
    /// The affected axis, if a single one is responsible.
    pub axis: Option<usize>,
    /// What is wrong.
    pub problem: MachineProblem,
}

impl fmt::Display for MachineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.problem.fmt(f)
    }
}

impl core::error::Error for MachineError {}

/// Two rotary axes closer than this (rad, about a degree) count as parallel.
const PARALLEL: f64 = 0.02;
/// Linear axes with a rotary axis between them, and three rotary axes, become dependent at isolated positions. The grid
/// over the travel has steps of at most 15°, so within half a step of such a position the volume of the directions is
/// below this (sin 7.5° is 0.1305). Independent axes have 1.
const DEPENDENT: f64 = 0.131;
/// Grid positions per rotary axis.
const STEPS: usize = 25;

impl Machine {
    /// Checks that the linear axes span space and the rotary axes stay independent over the travel.
    ///
    /// # Errors
    /// [`MachineError`] names the axes and, if the problem is local, its position.
    pub fn check(&self) -> Result<(), MachineError> {
        let kinematics = Nominal::new(self);
        let problem = |axis, problem| Err(MachineError { axis, problem });
        // At zero, then over a grid: directions depend on rotary positions only, so a grid over them covers every case.
        let rotary = self.axes.iter().filter(|a| a.letter.is_rotary()).count();
        let all = core::iter::once(None).chain((0..STEPS.pow(rotary as u32)).map(Some));
        for position in all {
            let (q, at) = position.map_or_else(Default::default, |number| self.on_grid(number));
            let jacobian = kinematics.jacobian(&q, None);
            if jacobian.linear_volume() < DEPENDENT {
                return problem(None, MachineProblem::LinearAxesDoNotSpan { at });
            }
            if let Some((i, j)) = jacobian.parallel_rotary_axes(PARALLEL) {
                let (first, second) = (self.axes[i].letter.char(), self.axes[j].letter.char());
                return problem(
                    Some(j),
                    MachineProblem::ParallelRotaryAxes { first, second, at },
                );
            }
            if rotary == 3 && jacobian.rotary_volume() < DEPENDENT {
                return problem(None, MachineProblem::DependentRotaryAxes { at });
            }
        }
        Ok(())
    }

    /// A position of the grid over the travels of the rotary axes, the last axis varying fastest. The name is empty if
    /// all axes are at zero.
    fn on_grid(&self, mut number: usize) -> (PerAxis, RotaryPositions) {
        let mut q = PerAxis::default();
        let mut at = RotaryPositions::default();
        for (i, axis) in self.axes.iter().enumerate().rev() {
            if axis.letter.is_rotary() {
                let [low, high] = axis.travel.map(f64::to_radians);
                q[i] = low + (high - low) * (number % STEPS) as f64 / (STEPS - 1) as f64;
                at.rotary[i] = Some((axis.letter, q[i].to_degrees()));
                number /= STEPS;
            }
        }
        if q == PerAxis::default() {
            at = RotaryPositions::default();
        }
        (q, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Branch};
    use std::string::ToString;

    fn axes(letters: &[Letter]) -> std::vec::Vec<Axis> {
        let axis = |l: &Letter| Axis::new(*l, Branch::Tool, [-90.0, 90.0]);
        letters.iter().map(axis).collect()
    }

    fn refused(letters: &[Letter]) -> std::string::String {
        let machine = Machine::new(&axes(letters)).and_then(|m| m.check());
        machine.unwrap_err().to_string()
    }

    #[test]
    fn machines_that_cannot_be_corrected_are_refused_with_the_reason() {
        use Letter as L;
        assert_eq!(
            refused(&[L::X, L::Y]),
            "the machine has 2 axes, not three to six"
        );
        let seven = [L::X, L::Y, L::Z, L::A, L::B, L::C, L::U];
        assert_eq!(refused(&seven), "the machine has 7 axes, not three to six");
        assert_eq!(refused(&[L::X, L::Y, L::X]), "axis X is described twice");
        assert!(refused(&[L::X, L::U, L::Z]).starts_with("the linear axes do not span space:"));
        // Z turns into the plane of X and Y.
        let turned = refused(&[L::X, L::Y, L::B, L::Z]);
        assert!(
            turned.contains("do not span space at B = -90.0°"),
            "{turned}"
        );
        // C becomes parallel to A.
        let parallel = refused(&[L::X, L::Y, L::Z, L::A, L::B, L::C]);
        assert!(
            parallel.contains("A and C are parallel at A = -90.0°, B = -90.0°, C = -90.0°"),
            "{parallel}"
        );
    }

    #[test]
    fn parallel_axes_do_not_hide_a_direction_that_is_lost() {
        use Letter as L;
        // C turns Y into the direction of X and U, halfway between two grid positions.
        let mut axes = axes(&[L::C, L::Y, L::U, L::X, L::Z]);
        axes[0].travel = [-172.5, 187.5];
        axes[0].branch = Branch::Workpiece;
        axes[1].branch = Branch::Workpiece;
        let found = Machine::new(&axes).and_then(|m| m.check()).unwrap_err();
        let text = found.to_string();
        assert!(text.contains("do not span space at C = "), "{text}");
    }

    #[test]
    fn a_mill_of_five_axes_can_be_corrected() {
        use Letter as L;
        let machine = Machine::new(&axes(&[L::X, L::Y, L::Z, L::C, L::A])).unwrap();
        assert_eq!(machine.check(), Ok(()));
    }
}
