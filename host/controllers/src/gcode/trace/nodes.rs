//! Points of a corrected path, so close that corrections between them are straight.

use super::{Field, Lost, Node, Path};
use crate::gcode::axes::{COUNT, is_rotary};
use crate::gcode::interpret::bits;
use crate::gcode::limits::Limits;
use crate::gcode::travel_directions::TravelDirections;

/// A path with its corrections.
#[derive(Debug, Default)]
pub struct Traced {
    /// Points of it, from t = 0 to 1.
    pub nodes: Vec<Node>,
    /// Numbers of nodes at which an axis has turned round: the node there is at the same place as the one before it,
    /// with other corrections.
    pub breaks: Vec<usize>,
}

/// A path while it is traced.
struct Tracing<'t> {
    field: &'t Field<'t>,
    path: &'t Path,
    limits: &'t Limits,
    ways: &'t mut TravelDirections,
    traced: &'t mut Traced,
}

/// How far corrections may be from the straight line in the middle between nodes, in parts of what is allowed: at a
/// point of a linear table they are twice as far off at most.
const BETWEEN: f64 = 0.1;
/// A part of a move is halved so often at most: at a step of the tables no number is enough.
const HALVINGS: u32 = 8;
/// Most parts of one move, which are all kept until it is written: 20 MB. More would be hundreds of turns.
pub(crate) const MOST_PARTS: usize = 100_000;

impl Field<'_> {
    /// The nodes of a path, so close that corrections between them are straight to a part of `limits`; the vectors
    /// are used again. `finer` is how many there are at least, and `ways` the directions at its start, then at its end.
    ///
    /// Returns the last node.
    ///
    /// # Errors
    /// A position that cannot be corrected.
    pub fn trace(
        &self,
        path: &Path,
        limits: &Limits,
        ways: &mut TravelDirections,
        finer: usize,
        traced: &mut Traced,
    ) -> Result<Node, Lost> {
        traced.nodes.clear();
        traced.breaks.clear();
        let parts = self.parts(path).max(finer).max(4);
        if parts > MOST_PARTS {
            // An end outside the travel is told first: it is why a move is so long.
            self.node(1.0, &path.at(1.0), ways)?;
            return Err(Lost::TooLong);
        }
        let turns = match path {
            Path::Arc(arc) if self.looks_for_turns() => arc.turns_round(),
            _ => Vec::new(),
        };
        let mut turns = turns.into_iter().peekable();
        let mut last = self.node(0.0, &path.at(0.0), ways)?;
        traced.nodes.push(last);
        let mut tracing = Tracing {
            field: self,
            path,
            limits,
            ways,
            traced,
        };
        for part in 1..=parts {
            let t = part as f64 / parts as f64;
            while let Some(turn) = turns.next_if(|turn| *turn < t) {
                tracing.go_on(turn, HALVINGS)?;
            }
            last = tracing.go_on(t, HALVINGS)?;
        }
        Ok(last)
    }

    /// True if corrections may step along a path, where an axis turns round.
    fn looks_for_turns(&self) -> bool {
        self.tables.directional != 0 && !self.keeps_directions
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
                let most = if is_rotary(i) { 1.0 } else { 50.0 };
                parts += way / spacing[i].min(most);
            } else {
                parts = parts.max(way / spacing[i]);
            }
        }
        if let Path::Arc(arc) = path {
            parts = parts.max(arc.sweep.abs() * 6.0);
        }
        parts.ceil() as usize
    }
}

impl Tracing<'_> {
    /// Nodes up to a part of the way: as many as it takes.
    fn go_on(&mut self, t: f64, halvings: u32) -> Result<Node, Lost> {
        if halvings > 0
            && let Some(last) = self.traced.nodes.last()
        {
            let middle = 0.5 * (last.t + t);
            // In the directions that axes have at the end: where one turns round is not for nodes to find.
            let mut ahead = self.ways.clone();
            if self.field.looks_for_turns() {
                ahead.come_to(self.field.tables, &self.field.axes(&self.path.at(t))?);
            }
            let added = |t: f64| {
                let command = self.path.at(t);
                let node = self.field.node(t, &command, &ahead)?;
                Ok(std::array::from_fn::<f64, COUNT, _>(|i| {
                    node.to[i] - command[i]
                }))
            };
            let (start, between, end) = (added(last.t)?, added(middle)?, added(t)?);
            let off = std::array::from_fn(|i| between[i] - 0.5 * (start[i] + end[i]));
            if self.limits.of(&off) > BETWEEN || self.turns_between(last.t, t)? {
                self.go_on(middle, halvings - 1)?;
                return self.go_on(t, halvings - 1);
            }
        }
        self.add(t)
    }

    /// True if an axis that follows the tip may turn round between two places, and come back by more than is looked
    /// past: a parabola turns round there if its ends differ by less than 4 times what its middle is off.
    fn turns_between(&self, from: f64, to: f64) -> Result<bool, Lost> {
        if self.field.tip.is_none() || !self.field.looks_for_turns() {
            return Ok(false);
        }
        let axes = |t: f64| self.field.axes(&self.path.at(t));
        let (from, middle, to) = (axes(from)?, axes(0.5 * (from + to))?, axes(to)?);
        let tables = self.field.tables;
        Ok(bits(tables.directional).any(|i| {
            let off = (middle[i] - 0.5 * (from[i] + to[i])).abs();
            let may_turn = (to[i] - from[i]).abs() < 6.0 * off;
            may_turn && off > 0.1 * tables.hysteresis[i].max(1e-3)
        }))
    }

    fn add(&mut self, t: f64) -> Result<Node, Lost> {
        if self.traced.nodes.len() > MOST_PARTS {
            return Err(Lost::TooLong);
        }
        let (field, path) = (self.field, self.path);
        let command = path.at(t);
        if field.looks_for_turns() {
            let before = self.ways.travel;
            self.ways.come_to(field.tables, &field.axes(&command)?);
            if before != self.ways.travel
                && let Some(last) = self.traced.nodes.last().copied()
            {
                let turned = field.node(last.t, &path.at(last.t), self.ways)?;
                if turned.to != last.to {
                    self.traced.breaks.push(self.traced.nodes.len());
                    self.traced.nodes.push(turned);
                }
            }
        }
        let node = field.node(t, &command, self.ways)?;
        self.traced.nodes.push(node);
        Ok(node)
    }
}
