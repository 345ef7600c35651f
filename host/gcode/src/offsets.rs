//! From words of a program to positions of the machine and back.

use super::axes::{COUNT, PerLetter};
use std::collections::BTreeMap;

/// A work coordinate system.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct System {
    /// Origin (mm, degrees).
    pub origin: PerLetter,
    /// Rotation in XY (degrees).
    pub rotation: f64,
}

/// Number of a system: 1 to 9 for G54 to G59.3, 100 + P for G54.1 P.
pub type Number = u16;

/// The name of a system, as it is written in a program and in a setup.
#[must_use]
pub(crate) fn system_name(number: Number) -> String {
    match number {
        1..=6 => format!("G{}", 53 + number),
        7..=9 => format!("G59.{}", number - 6),
        _ => format!("G54.1 P{}", number - 100),
    }
}

/// All that stands between a word and a position of the machine:
/// machine = Rz(rotation) · (word + g92) + origin + tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Offsets {
    /// Those that are known.
    pub systems: BTreeMap<Number, System>,
    selected: Number,
    active: Option<System>,
    /// G92 or G52 (mm, degrees), added to words.
    pub g92: PerLetter,
    /// What G92.3 brings back: the offsets of the last G92, if they are known.
    pub g92_stored: Option<PerLetter>,
    /// True while [`Self::g92`] is that of G52, which Fanuc's controllers keep apart.
    pub local: bool,
    /// Tool offset (mm), added to positions.
    pub tool: PerLetter,
    /// Cosine and sine of the rotation.
    turn: [f64; 2],
}

impl Offsets {
    /// With one system selected.
    #[must_use]
    pub fn new(systems: BTreeMap<Number, System>, selected: Number) -> Self {
        let mut offsets = Self {
            systems,
            selected,
            active: None,
            g92: [0.0; COUNT],
            g92_stored: None,
            local: false,
            tool: [0.0; COUNT],
            turn: [1.0, 0.0],
        };
        offsets.select(selected);
        offsets
    }

    /// Makes a system the one that holds.
    pub(crate) fn select(&mut self, number: Number) {
        self.selected = number;
        self.active = self.systems.get(&number).copied();
        let degrees = self.active.map_or(0.0, |s| s.rotation);
        let (sine, cosine) = libm::sincos(degrees.to_radians());
        self.turn = if degrees == 0.0 {
            [1.0, 0.0]
        } else {
            [cosine, sine]
        };
    }

    /// Gives a system other values.
    pub fn set(&mut self, number: Number, system: System) {
        self.systems.insert(number, system);
        self.select(self.selected);
    }

    /// The number of the system that holds.
    #[must_use]
    pub(crate) fn selected(&self) -> Number {
        self.selected
    }

    /// The system that holds, if its values are known.
    #[must_use]
    pub fn active(&self) -> Option<&System> {
        self.active.as_ref()
    }

    /// True if X and Y of a program are not those of the machine.
    #[must_use]
    pub fn is_turned(&self) -> bool {
        self.turn[1] != 0.0 || self.turn[0] != 1.0
    }

    /// 0 where it is not known: whoever reads words by it asks for [`Self::active`] before.
    fn origin(&self, axis: usize) -> f64 {
        self.active.map_or(0.0, |s| s.origin[axis])
    }

    /// A difference in X and Y of the program as one of the machine.
    #[must_use]
    pub fn turned(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.turn;
        [c * x - s * y, s * x + c * y]
    }

    /// A difference in X and Y of the machine as one of the program.
    #[must_use]
    pub(crate) fn turned_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.turn;
        [c * x + s * y, c * y - s * x]
    }

    /// Program coordinates (mm, degrees) of a position of the machine.
    #[must_use]
    pub fn program(&self, machine: &PerLetter) -> PerLetter {
        let mut at: PerLetter = std::array::from_fn(|i| machine[i] - self.tool[i] - self.origin(i));
        if self.is_turned() {
            [at[0], at[1]] = self.turned_back([at[0], at[1]]);
        }
        std::array::from_fn(|i| at[i] - self.g92[i])
    }

    /// The position of the machine that program coordinates (mm, degrees) mean.
    #[must_use]
    pub fn machine(&self, program: &PerLetter) -> PerLetter {
        let mut at: PerLetter = std::array::from_fn(|i| program[i] + self.g92[i]);
        if self.is_turned() {
            [at[0], at[1]] = self.turned([at[0], at[1]]);
        }
        std::array::from_fn(|i| at[i] + self.origin(i) + self.tool[i])
    }

    /// Like `machine`, of one axis, where it does not depend on others.
    #[must_use]
    pub(crate) fn machine_axis(&self, axis: usize, program: f64) -> f64 {
        program + self.g92[axis] + self.origin(axis) + self.tool[axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_become_positions_and_positions_words() {
        let mut system = System {
            rotation: 30.0,
            ..System::default()
        };
        system.origin[..3].copy_from_slice(&[-250.0, -180.0, -320.0]);
        let mut offsets = Offsets::new(BTreeMap::from([(2, system)]), 1);
        assert!(offsets.active().is_none());
        offsets.select(2);
        offsets.tool[2] = 112.4;
        offsets.g92[0] = 10.0;
        let mut program = [0.0; COUNT];
        program[..4].copy_from_slice(&[90.0, 0.0, 5.0, 45.0]);
        let machine = offsets.machine(&program);
        let expected = [-250.0 + 100.0 * 0.75_f64.sqrt(), -130.0, -202.6, 45.0];
        for (at, expected) in machine.iter().zip(expected) {
            assert!((at - expected).abs() < 1e-12);
        }
        let back = offsets.program(&machine);
        for (at, expected) in back.iter().zip(program) {
            assert!((at - expected).abs() < 1e-12);
        }
    }
}
