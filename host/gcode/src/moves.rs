//! Motions, in positions of the machine or, under tool-centre-point control, of the tip.

use super::arc::Arc;
use super::axes::{PerLetter, Position};
use super::cycle::Cycle;
pub use super::rate::Rate;

/// A straight move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Straight {
    /// From here; axes may be unknown before a rapid.
    pub from: Position,
    /// To here.
    pub to: PerLetter,
    /// True if words are machine coordinates: G53.
    pub machine: bool,
    /// Axes (bits) that are to arrive at their corrected places: all, but for a rapid those alone that the program has
    /// commanded.
    pub due: u16,
    /// True if the move waits for the spindle (G33, G33.1) and cannot be cut.
    pub with_spindle: bool,
    /// True if it ends where it began: G33.1.
    pub comes_back: bool,
}

impl Straight {
    /// True if only axes other than these move.
    #[must_use]
    pub fn is_outside(&self, axes: &[usize; 3]) -> bool {
        axes.iter()
            .all(|axis| self.from.at[*axis] == self.to[*axis])
    }
}

/// A motion that is corrected.
#[derive(Clone, Debug, PartialEq)]
pub enum Move {
    /// G0, G1, G33.
    Straight(Straight, Rate),
    /// G2, G3.
    Arc(Arc, Rate),
    /// A canned cycle.
    Cycle(Box<Cycle>),
}
