//! The pieces that a corrected motion is written as.

use crate::arc::Arc;
use crate::axes::PerLetter;
use crate::moves::Rate;

/// What a piece is written with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// G0.
    Rapid,
    /// G1.
    Feed,
    /// G2, G3.
    Arc(Arc),
}

/// What a motion takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// What the program says.
    pub rate: Rate,
    /// What the whole motion takes (minutes, or revolutions); 0 where that is not told: rapids, threads.
    pub minutes: f64,
    /// True if rotary axes move.
    pub turns: bool,
}

/// A single move that is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// How.
    pub shape: Shape,
    /// Where it ends, in words' coordinates.
    pub to: PerLetter,
    /// The part of the way at which it ends: 1 at the end of the motion.
    pub until: f64,
    /// Part of the time of the motion; `None`: a step onto the corrected path, which takes what it takes.
    pub share: Option<f64>,
}

impl Piece {
    /// All of a motion.
    pub fn whole(shape: Shape, to: PerLetter) -> Self {
        Self {
            shape,
            to,
            until: 1.0,
            share: Some(1.0),
        }
    }

    /// A step onto the corrected path, at a part of the way.
    pub fn step(to: PerLetter, until: f64) -> Self {
        Self {
            shape: Shape::Feed,
            to,
            until,
            share: None,
        }
    }
}
