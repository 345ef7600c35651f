//! Points of a corrected path, so close that corrections between them are straight.

use super::{Field, Lost, Node, Path, Stretch};
use crate::axes::{COUNT, is_rotary};
use crate::limits::Limits;
use std::ops::Range;

/// A path with its corrections.
#[derive(Debug, Default)]
pub struct Traced {
    /// Points of it, from t = 0 to 1; where an axis reverses there are two at the same place.
    pub nodes: Vec<Node>,
    /// The stretches between reversals, with their nodes.
    pub runs: Vec<(Stretch, Range<usize>)>,
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
    /// are used again.
    ///
    /// # Errors
    /// A position that cannot be corrected.
    pub fn trace(
        &self,
        path: &Path,
        limits: &Limits,
        stretches: &[Stretch],
        traced: &mut Traced,
    ) -> Result<(), Lost> {
        traced.nodes.clear();
        traced.runs.clear();
        let parts = self.parts(path).max(4);
        if parts > MOST_PARTS {
            // An end outside the travel is told first: it is why a move is so long.
            self.node(1.0, &path.at(1.0), &stretches[0].travel)?;
            return Err(Lost::TooLong);
        }
        for stretch in stretches {
            let first = traced.nodes.len();
            let mut last = self.node(stretch.from, &path.at(stretch.from), &stretch.travel)?;
            traced.nodes.push(last);
            let length = stretch.to - stretch.from;
            let count = (parts as f64 * length).ceil().max(1.0) as usize;
            for part in 1..=count {
                let t = match part == count {
                    true => stretch.to,
                    false => stretch.from + length * part as f64 / count as f64,
                };
                last = self.go_on(path, limits, stretch, [last.t, t], HALVINGS, traced)?;
            }
            traced.runs.push((*stretch, first..traced.nodes.len()));
        }
        Ok(())
    }

    /// How many parts a path needs so that no interval of the tables is passed over.
    pub(super) fn parts(&self, path: &Path) -> usize {
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

    /// Nodes up to a part of the way: as many as it takes.
    fn go_on(
        &self,
        path: &Path,
        limits: &Limits,
        stretch: &Stretch,
        [from, t]: [f64; 2],
        halvings: u32,
        traced: &mut Traced,
    ) -> Result<Node, Lost> {
        let node = |t: f64| self.node(t, &path.at(t), &stretch.travel);
        let end = node(t)?;
        if halvings > 0 {
            let middle = 0.5 * (from + t);
            let added = |node: &Node| {
                let command = path.at(node.t);
                std::array::from_fn::<f64, COUNT, _>(|i| node.to[i] - command[i])
            };
            let (start, between, end) = (added(&node(from)?), added(&node(middle)?), added(&end));
            let off = std::array::from_fn(|i| between[i] - 0.5 * (start[i] + end[i]));
            if limits.of(&off) > BETWEEN {
                self.go_on(path, limits, stretch, [from, middle], halvings - 1, traced)?;
                return self.go_on(path, limits, stretch, [middle, t], halvings - 1, traced);
            }
        }
        if traced.nodes.len() > MOST_PARTS {
            return Err(Lost::TooLong);
        }
        traced.nodes.push(end);
        Ok(end)
    }
}
