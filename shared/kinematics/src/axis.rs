//! One axis of a machine.

use crate::Htm;
use core::fmt;
use nalgebra::ComplexField;

/// The branch of the chain to which an axis belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// From the foundation to the workpiece.
    Workpiece,
    /// From the foundation to the tool.
    Tool,
}

/// An axis letter: X Y Z U V W are linear, A B C rotary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Letter(char);

macro_rules! letters {
    ($($letter:ident $char:literal)*) => {
        $(
            #[doc = concat!("The axis ", stringify!($letter), ".")]
            pub const $letter: Self = Self($char);
        )*
    };
}

impl Letter {
    letters! { X 'X' Y 'Y' Z 'Z' U 'U' V 'V' W 'W' A 'A' B 'B' C 'C' }

    /// The letter, if it names an axis.
    #[must_use]
    pub fn new(letter: char) -> Option<Self> {
        "XYZUVWABC".contains(letter).then_some(Self(letter))
    }

    /// The letter itself.
    #[must_use]
    pub fn char(self) -> char {
        self.0
    }

    /// True for A, B and C.
    #[must_use]
    pub fn is_rotary(self) -> bool {
        matches!(self.0, 'A' | 'B' | 'C')
    }

    /// Axis of its own frame along which it moves or about which it turns: 0, 1, 2 for x, y, z.
    #[must_use]
    pub fn component(self) -> usize {
        match self.0 {
            'X' | 'U' | 'A' => 0,
            'Y' | 'V' | 'B' => 1,
            _ => 2,
        }
    }
}

impl fmt::Display for Letter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// One axis of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Letter, which gives its kind and its direction in its own frame.
    pub letter: Letter,
    /// The branch it belongs to.
    pub branch: Branch,
    /// Frame in the foundation frame, all axes at zero (mm, rad).
    pub frame: Htm,
    /// Travel limits of the command (mm or deg).
    pub travel: [f64; 2],
    /// True if a rotary axis is endless and its position wraps. Errors are functions of the position within the turn
    /// given by `travel`: see [`Self::within_turn`].
    pub modulo: bool,
    /// True if a positive command moves the carriage in the negative direction.
    pub reversed: bool,
    /// Maximum speed (mm/s or deg/s).
    pub max_speed: f64,
    /// How far the command must come back before its direction counts as reversed (mm or deg).
    pub reversal_threshold: f64,
}

impl Axis {
    /// Default maximum speed of a linear axis: 30 m/min, in mm/s.
    pub const MAX_SPEED_LINEAR: f64 = 500.0;
    /// Default maximum speed of a rotary axis: 30 rpm, in deg/s.
    pub const MAX_SPEED_ROTARY: f64 = 180.0;
    /// Default direction reversal threshold (mm or deg): above the ripple of a command at rest, below any real move.
    pub const REVERSAL_THRESHOLD: f64 = 0.001;

    /// An axis whose frame is the foundation frame, with a travel in mm or degrees. Set the fields for anything else.
    #[must_use]
    pub fn new(letter: Letter, branch: Branch, travel: [f64; 2]) -> Self {
        Self {
            letter,
            branch,
            frame: Htm::identity(),
            travel,
            modulo: false,
            reversed: false,
            max_speed: if letter.is_rotary() {
                Self::MAX_SPEED_ROTARY
            } else {
                Self::MAX_SPEED_LINEAR
            },
            reversal_threshold: Self::REVERSAL_THRESHOLD,
        }
    }

    /// This axis with another frame: origin (mm) and rotations (rad) about x, then y, then z, in the foundation
    /// frame with all axes at zero.
    #[must_use]
    pub fn at(mut self, xyz_abc: [f64; 6]) -> Self {
        self.frame = Htm::from_xyz_abc(xyz_abc);
        self
    }

    /// Converts command units (mm or deg) to kinematic units (mm or rad).
    #[must_use]
    pub fn to_kinematic(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_radians()
        } else {
            value
        }
    }

    /// Converts kinematic units (mm or rad) to command units (mm or deg).
    #[must_use]
    pub fn to_command(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_degrees()
        } else {
            value
        }
    }

    /// Reduces a position (mm or deg) of an endless axis to the same place within its travel; positions of other axes
    /// are returned unchanged.
    #[must_use]
    pub fn within_turn(&self, position: f64) -> f64 {
        let [low, high] = self.travel;
        if !self.modulo || (low..=high).contains(&position) {
            return position;
        }
        let turn = high - low;
        position - turn * ComplexField::floor((position - low) / turn)
    }

    /// Unit of the command: `mm` or `deg`.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        if self.letter.is_rotary() { "deg" } else { "mm" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_turn_of_an_endless_axis_is_the_same_place() {
        let mut axis = Axis::new(Letter::C, Branch::Workpiece, [-180.0, 180.0]);
        assert_eq!(axis.within_turn(725.0), 725.0);
        axis.modulo = true;
        for (position, place) in [
            (725.0, 5.0),
            (-185.0, 175.0),
            (180.0, 180.0),
            (540.0, -180.0),
        ] {
            assert_eq!(axis.within_turn(position), place);
        }
    }
}
