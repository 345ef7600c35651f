//! The pieces that a corrected motion is written as.

use crate::gcode::arc::Arc;
use crate::gcode::axes::PerLetter;
use crate::gcode::moves::Rate;

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

/// How long a piece is to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Timing {
    /// As it comes.
    None,
    /// A part of the time of a motion.
    Part {
        /// What the program says.
        rate: Rate,
        /// What the whole motion takes (minutes, or revolutions).
        minutes: f64,
        /// The part of it.
        share: f64,
        /// True if rotary axes move.
        turns: bool,
    },
    /// A step at a reversal, with this F.
    TakeUp,
}

/// A single move that is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// How.
    pub shape: Shape,
    /// Where it ends, in words' coordinates.
    pub to: PerLetter,
    /// How long it is to take.
    pub timing: Timing,
    /// The F of the motion, under which a take-up runs.
    pub feed: Option<Rate>,
}

impl Piece {
    /// A motion, or a part of it.
    pub fn of(shape: Shape, to: PerLetter, timing: Timing) -> Self {
        let feed = match timing {
            Timing::Part { rate, .. } => Some(rate),
            _ => None,
        };
        Self {
            shape,
            to,
            timing,
            feed,
        }
    }
}

impl Timing {
    /// A part of this time.
    pub fn shared(self, part: f64) -> Self {
        match self {
            Self::Part {
                rate,
                minutes,
                share,
                turns,
            } => Self::Part {
                rate,
                minutes,
                share: share * part,
                turns,
            },
            other => other,
        }
    }
}
