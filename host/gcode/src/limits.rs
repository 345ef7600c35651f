//! How far what is written may be from the corrected path.

use super::axes::{PerLetter, is_rotary};

/// How far what is written may be from the corrected path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// mm.
    pub linear: f64,
    /// Degrees.
    pub rotary: f64,
}

/// What is left for the rounding of words, and for what happens between nodes.
const RESERVE: f64 = 0.7;
/// What words of three axes with four decimals are off, each by half of the last digit (mm).
const ROUNDING: f64 = 0.087e-3;
/// How far from a rotary axis the tip is thought to be, at most, where axes are commanded (mm).
pub(crate) const LEVER: f64 = 500.0;

/// What a difference of axis positions makes at the tool at most (mm).
#[must_use]
pub(crate) fn displacement(by: &PerLetter) -> f64 {
    let parts = by.iter().enumerate();
    let squares = parts.map(|(i, by)| match is_rotary(i) {
        true => (by.to_radians() * LEVER).powi(2),
        false => by * by,
    });
    squares.sum::<f64>().sqrt()
}

impl Limits {
    /// From a tolerance (mm) and one of the tool's direction (rad). `lever`: words are axis positions, so that a
    /// rotary axis moves the tip too.
    #[must_use]
    pub fn new(tolerance: f64, direction: f64, rotary: bool, lever: bool) -> Self {
        let half = if rotary && lever { 0.5 } else { 1.0 };
        let turn = if lever {
            direction.min(half * tolerance / LEVER)
        } else {
            direction
        };
        Self {
            linear: RESERVE * half * tolerance,
            rotary: RESERVE * turn.to_degrees(),
        }
    }

    /// Of arcs, whose distances are looked at node by node: all that rounding leaves of a tolerance (mm).
    #[must_use]
    pub fn of_arcs(self, tolerance: f64) -> Self {
        Self {
            linear: self.linear.max(tolerance - ROUNDING),
            ..self
        }
    }

    /// With no more than this (mm).
    #[must_use]
    pub fn within(self, linear: f64) -> Self {
        Self {
            linear: self.linear.min(linear),
            ..self
        }
    }

    /// With so much more (mm).
    #[must_use]
    pub fn plus(self, linear: f64) -> Self {
        Self {
            linear: self.linear + linear,
            ..self
        }
    }

    /// A difference of positions, in parts of what is allowed.
    #[must_use]
    pub fn of(&self, difference: &PerLetter) -> f64 {
        let norm = |rotary: bool| {
            let squares = difference.iter().enumerate();
            let squares = squares.filter(|(i, _)| is_rotary(*i) == rotary);
            squares.map(|(_, d)| d * d).sum::<f64>().sqrt()
        };
        self.of_lengths([norm(false), norm(true)])
    }

    /// Like `of`, of the lengths of its linear part (mm) and of its rotary part (degrees).
    #[must_use]
    pub(crate) fn of_lengths(&self, [linear, rotary]: [f64; 2]) -> f64 {
        (linear / self.linear).max(rotary / self.rotary)
    }
}
