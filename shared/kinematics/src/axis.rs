//! One axis of a machine.

use crate::Htm;
use core::fmt;
use nalgebra::ComplexField;

/// Which of the two branches of the chain an axis belongs to.
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

    /// Which axis of its frame it moves along or turns about: 0, 1, 2 for x, y, z.
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
    /// Its letter, which gives its kind and direction in its own frame.
    pub letter: Letter,
    /// The branch it belongs to.
    pub branch: Branch,
    /// Its frame in the foundation frame, all axes at zero (mm, rad).
    pub frame: Htm,
    /// Travel limits of the command (mm or deg).
    pub travel: [f64; 2],
    /// True if a rotary axis turns without end and its position wraps. Errors are functions of the
    /// position within the turn that `travel` gives: see [`Self::within_turn`].
    pub modulo: bool,
    /// True if a positive command moves the carriage the negative way.
    pub reversed: bool,
    /// The highest speed (mm/s or deg/s).
    pub max_speed: f64,
    /// How far the command must retreat before its direction counts as reversed (mm or deg).
    pub hysteresis: f64,
}

impl Axis {
    /// Top speeds unless told otherwise: 30 m/min (in mm/s) and 30 rpm (in deg/s).
    pub const MAX_SPEED_LINEAR: f64 = 500.0;
    /// See [`Self::MAX_SPEED_LINEAR`].
    pub const MAX_SPEED_ROTARY: f64 = 180.0;
    /// Direction hysteresis unless told otherwise (mm or deg): above the ripple of a standing
    /// command, below any real move.
    pub const HYSTERESIS: f64 = 0.001;

    /// An axis whose frame is that of the foundation, with a travel in mm or degrees; the fields
    /// say the rest.
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
            hysteresis: Self::HYSTERESIS,
        }
    }

    /// The same with another frame: origin (mm) and rotations (rad) about x, then y, then z, in the
    /// foundation frame with all axes at zero.
    #[must_use]
    pub fn at(mut self, xyz_abc: [f64; 6]) -> Self {
        self.frame = Htm::from_xyz_abc(xyz_abc);
        self
    }

    /// Command units (mm or deg) to kinematic units (mm or rad).
    #[must_use]
    pub fn to_kinematic(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_radians()
        } else {
            value
        }
    }

    /// Kinematic units (mm or rad) to command units (mm or deg).
    #[must_use]
    pub fn to_command(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_degrees()
        } else {
            value
        }
    }

    /// A position (mm or deg) of any turn of an endless axis as the same place within its travel;
    /// of other axes as it is.
    #[must_use]
    pub fn within_turn(&self, position: f64) -> f64 {
        let [low, high] = self.travel;
        if !self.modulo || (low..=high).contains(&position) {
            return position;
        }
        let turn = high - low;
        position - turn * ComplexField::floor((position - low) / turn)
    }

    /// `mm` or `deg`.
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
