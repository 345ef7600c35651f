//! The corrected path of a move, at points close enough to see how it bends.

mod directions;
mod nodes;

use super::arc::Arc;
use super::axes::PerLetter;
use super::tables::Tables;
use super::tip::Tip;
pub use directions::Stretch;
pub(crate) use nodes::MOST_PARTS;
pub use nodes::Traced;
use trueaxis::Travel;

/// A direction of travel per letter.
pub type Travels = [Travel; super::axes::COUNT];

/// The path that a move commands, in words' coordinates (mm, degrees).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Straight.
    Line(PerLetter, PerLetter),
    /// An arc or a helix.
    Arc(Arc),
}

impl Path {
    /// Where it is at a part t of the way.
    #[must_use]
    pub fn at(&self, t: f64) -> PerLetter {
        match self {
            Self::Line(from, to) => {
                if t >= 1.0 {
                    return *to;
                }
                std::array::from_fn(|i| from[i] + t * (to[i] - from[i]))
            }
            Self::Arc(arc) => arc.at(t),
        }
    }

    /// Difference of its ends.
    #[must_use]
    pub fn by(&self) -> PerLetter {
        let (from, to) = match self {
            Self::Line(from, to) => (from, to),
            Self::Arc(arc) => (&arc.from, &arc.to),
        };
        std::array::from_fn(|i| to[i] - from[i])
    }

    /// The way per part of it at t: its derivative.
    #[must_use]
    pub fn slope(&self, t: f64) -> PerLetter {
        match self {
            Self::Line(..) => self.by(),
            Self::Arc(arc) => arc.slope(t),
        }
    }

    /// How long it is: mm, and degrees as if they were mm.
    #[must_use]
    pub fn length(&self) -> f64 {
        match self {
            Self::Line(..) => self.by().iter().map(|d| d * d).sum::<f64>().sqrt(),
            Self::Arc(arc) => arc.length(),
        }
    }
}

/// What turns commanded positions into corrected ones.
pub struct Field<'a> {
    /// The compensation.
    pub tables: &'a Tables<'a>,
    /// Tool-centre-point control, while it is on.
    pub tip: Option<&'a Tip<'a>>,
    /// Length of the tool (mm): an input of the compensation, or of the poses; `None`: that of the machine.
    pub length: Option<f64>,
    /// True if directions of travel follow the axes; otherwise they stay what they are, whichever way axes go.
    pub turns: bool,
}

/// Why a position cannot be corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lost {
    /// An axis is outside its travel: letter, position, limits.
    Outside(usize, f64, [f64; 2]),
    /// Like `Outside`, of a corrected position, whose original one is within.
    Beyond(usize, f64, [f64; 2]),
    /// No axis positions put the tip there.
    NoPose,
    /// Tables depend on the direction in which an axis moved last, which is not known.
    Direction(usize),
    /// The compensation depends on the tool length, which is not known.
    NoLength,
    /// A move that passes too many intervals of the tables, or turns too often.
    TooLong,
}

/// A point of the corrected path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The part of the way, 0 to 1.
    pub t: f64,
    /// Axis positions without correction.
    pub q: PerLetter,
    /// The corrected command.
    pub to: PerLetter,
    /// Axis positions with the correction.
    pub moved: PerLetter,
}

impl Field<'_> {
    /// Axis positions of a command.
    ///
    /// # Errors
    /// A tip position that no axis positions reach.
    pub fn axes(&self, command: &PerLetter) -> Result<PerLetter, Lost> {
        match self.tip {
            None => Ok(*command),
            Some(tip) => tip.axes(command, self.length).ok_or(Lost::NoPose),
        }
    }

    /// Where the axes are commanded to at a position, whichever way they travel: what tells the way itself.
    pub(crate) fn middle(&self, q: &PerLetter) -> PerLetter {
        match self.length {
            _ if self.tables.directional == 0 => *q,
            None if self.tables.takes_length => *q,
            length => self.tables.middle(q, length.unwrap_or(0.0)),
        }
    }

    /// The corrected command at a commanded position.
    ///
    /// # Errors
    /// A position outside the travel, or without a pose.
    pub fn node(&self, t: f64, command: &PerLetter, travel: &Travels) -> Result<Node, Lost> {
        let q = self.axes(command)?;
        if let Some((axis, limits)) = self.tables.outside(&q) {
            return Err(Lost::Outside(axis, q[axis], limits));
        }
        let length = match self.length {
            Some(length) => length,
            None if self.tables.takes_length => return Err(Lost::NoLength),
            // No input, so that no value matters.
            None => 0.0,
        };
        let dq = self.tables.at(&q, travel, length);
        let moved = std::array::from_fn(|i| q[i] + dq[i]);
        let to = match self.tip {
            None => moved,
            Some(tip) => tip.world(&moved, self.length),
        };
        Ok(Node { t, q, to, moved })
    }

    /// Keeps a rapid to machine coordinates within the travel: at its end, where machines change tools, a correction
    /// would lead beyond it.
    pub fn within_travel(&self, node: &mut Node) {
        for axis in super::interpret::bits(self.tables.axes) {
            let at = self.tables.nearest(axis, node.moved[axis]);
            node.to[axis] += at - node.moved[axis];
            node.moved[axis] = at;
        }
    }

    /// Whether the axes can go to a node that is written.
    ///
    /// # Errors
    /// A corrected position outside the travel.
    pub fn reaches(&self, node: &Node) -> Result<(), Lost> {
        match self.tables.outside(&node.moved) {
            Some((axis, limits)) => Err(Lost::Beyond(axis, node.moved[axis], limits)),
            None => Ok(()),
        }
    }
}
