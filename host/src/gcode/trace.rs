//! The corrected path of a move, at points close enough to see how it bends.

use super::arc::Arc;
use super::axes::{COUNT, PerLetter, is_rotary};
use super::cut::Limits;
use super::tables::{Tables, Ways};
use super::tip::Tip;

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
}

/// What turns commanded positions into corrected ones.
pub struct Field<'a> {
    /// The compensation.
    pub tables: &'a Tables<'a>,
    /// Tool-centre-point control, while it is on.
    pub tip: Option<&'a Tip<'a>>,
    /// Length of the tool (mm): an input of the compensation, or of the poses; `None`: that of the machine.
    pub length: Option<f64>,
    /// True if corrections are taken away instead.
    pub undo: bool,
}

/// Why a position cannot be corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lost {
    /// An axis is outside its travel: letter, position, limits.
    Outside(usize, f64, [f64; 2]),
    /// No axis positions put the tip there.
    NoPose,
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
    pub fn axes(&self, command: &PerLetter) -> Result<PerLetter, Lost> {
        match self.tip {
            None => Ok(*command),
            Some(tip) => tip.axes(command, self.length).ok_or(Lost::NoPose),
        }
    }

    /// The corrected command at a commanded position.
    pub fn node(&self, t: f64, command: &PerLetter, ways: &Ways) -> Result<Node, Lost> {
        let q = self.axes(command)?;
        if let Some((axis, limits)) = self.tables.outside(&q)
            && !self.undo
        {
            return Err(Lost::Outside(axis, q[axis], limits));
        }
        let length = self.length.unwrap_or_default();
        let corrected = if self.undo {
            self.tables.undone(&q, &ways.travel, length)
        } else {
            let dq = self.tables.at(&q, &ways.travel, length);
            std::array::from_fn(|i| q[i] + dq[i])
        };
        let to = match self.tip {
            None => corrected,
            Some(tip) => tip.world(&corrected, self.length),
        };
        Ok(Node {
            t,
            q,
            to,
            moved: corrected,
        })
    }

    /// Whether the axes can go to a node that is written.
    pub fn reaches(&self, node: &Node) -> Result<(), Lost> {
        match self.tables.outside(&node.moved) {
            Some((axis, limits)) => Err(Lost::Outside(axis, node.moved[axis], limits)),
            None => Ok(()),
        }
    }

    /// How many parts a path needs so that no interval of the tables is passed over.
    fn parts(&self, path: &Path) -> usize {
        let by = path.by();
        let spacing = &self.tables.spacing;
        let mut parts = 0.0_f64;
        for i in 0..COUNT {
            let mut way = by[i].abs();
            if let Path::Arc(arc) = path
                && arc.axes[..2].contains(&i)
            {
                let [r0, r1] = arc.radii();
                way = arc.sweep.abs() * r0.max(r1);
            }
            if self.tip.is_some() {
                // The axes follow in curves: a part for every degree of the rotary ones, at least.
                way = if is_rotary(i) {
                    way.max(way / 1.0 * spacing[i].min(1.0))
                } else {
                    way
                };
                parts += way
                    / if is_rotary(i) {
                        spacing[i].min(1.0)
                    } else {
                        spacing[i].min(50.0)
                    };
            } else {
                parts = parts.max(way / spacing[i]);
            }
        }
        if let Path::Arc(arc) = path {
            parts = parts.max(arc.sweep.abs() * 6.0);
        }
        parts.ceil().clamp(0.0, MOST_PARTS) as usize
    }

    /// The nodes of a path, from t = 0 to 1, so close that corrections between them are straight to a part of
    /// `limits`, and where runs end: at the numbers in `breaks` an axis turns round, so that the node there is at
    /// the same place as the one before it, with other corrections.
    pub fn trace(
        &self,
        path: &Path,
        limits: &Limits,
        ways: &mut Ways,
        finer: usize,
        nodes: &mut Vec<Node>,
        breaks: &mut Vec<usize>,
    ) -> Result<(), Lost> {
        nodes.clear();
        breaks.clear();
        let parts = self.parts(path).max(finer).max(4);
        let turns = match path {
            Path::Arc(arc) if self.tables.directional != 0 => arc.turns_round(),
            _ => Vec::new(),
        };
        let mut turns = turns.into_iter().peekable();
        let first = self.node(0.0, &path.at(0.0), ways)?;
        nodes.push(first);
        for part in 1..=parts {
            let t = part as f64 / parts as f64;
            while let Some(turn) = turns.next_if(|turn| *turn < t) {
                self.go_on(path, turn, limits, HALVINGS, ways, nodes, breaks)?;
            }
            self.go_on(path, t, limits, HALVINGS, ways, nodes, breaks)?;
        }
        Ok(())
    }

    /// Nodes up to a part of the way: as many as it takes.
    #[expect(clippy::too_many_arguments, reason = "where it is, and what it fills")]
    fn go_on(
        &self,
        path: &Path,
        t: f64,
        limits: &Limits,
        halvings: u32,
        ways: &mut Ways,
        nodes: &mut Vec<Node>,
        breaks: &mut Vec<usize>,
    ) -> Result<(), Lost> {
        if halvings > 0
            && let Some(last) = nodes.last()
        {
            let middle = 0.5 * (last.t + t);
            // In the directions that axes have at the end: where one turns round is not for nodes to find.
            let mut ahead = ways.clone();
            ahead.come_to(self.tables, &self.axes(&path.at(t))?);
            let added = |t: f64| {
                let command = path.at(t);
                let node = self.node(t, &command, &ahead)?;
                Ok(std::array::from_fn::<f64, COUNT, _>(|i| {
                    node.to[i] - command[i]
                }))
            };
            let (start, between, end) = (added(last.t)?, added(middle)?, added(t)?);
            let off = std::array::from_fn(|i| between[i] - 0.5 * (start[i] + end[i]));
            if limits.of(&off) > BETWEEN {
                for t in [middle, t] {
                    self.go_on(path, t, limits, halvings - 1, ways, nodes, breaks)?;
                }
                return Ok(());
            }
        }
        self.add(path, t, ways, nodes, breaks)
    }

    fn add(
        &self,
        path: &Path,
        t: f64,
        ways: &mut Ways,
        nodes: &mut Vec<Node>,
        breaks: &mut Vec<usize>,
    ) -> Result<(), Lost> {
        let command = path.at(t);
        if self.tables.directional != 0 {
            let before = ways.travel;
            ways.come_to(self.tables, &self.axes(&command)?);
            if before != ways.travel
                && let Some(last) = nodes.last().copied()
            {
                let turned = self.node(last.t, &path.at(last.t), ways)?;
                if turned.to != last.to {
                    breaks.push(nodes.len());
                    nodes.push(turned);
                }
            }
        }
        let node = self.node(t, &command, ways)?;
        nodes.push(node);
        Ok(())
    }
}

/// How far corrections may be from the straight line in the middle between nodes, in parts of what is allowed: at a
/// point of a linear table they are twice as far off at most.
const BETWEEN: f64 = 0.1;
/// A part of a move is halved so often at most: at a step of the tables no number is enough.
const HALVINGS: u32 = 8;
/// Most parts of one move; more would be a move of hundreds of metres.
const MOST_PARTS: f64 = 1e6;
