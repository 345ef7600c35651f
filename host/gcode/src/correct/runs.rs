//! Pieces along a corrected path, stretch by stretch between reversals.

use super::piece::{Piece, Shape};
use super::{Backlash, Corrector};
use crate::axes::{COUNT, PerLetter, is_rotary};
use crate::cut;
use crate::limits::Limits;
use crate::trace::{Field, Lost, Node, Path};

/// So far beside the corrected path a motion that feeds may begin, in parts of what is allowed: pieces take the rest.
const BESIDE: f64 = 0.3;
/// What rounding leaves of a place, in last digits of words: one of an axis that no word names, and a little more.
const ROUNDED: f64 = 1.1;
/// Over so much of a move the step at a reversal is blended (mm, or degrees).
const BLEND: f64 = 1.0;

/// True if the step at a reversal lies along the motion that reverses, which then needs no move of its own for it: across,
/// it stays within what a motion may begin beside its path.
fn takes_up(path: &Path, nodes: &[Node], off: &PerLetter, limits: &Limits) -> bool {
    let [first, next, ..] = nodes else {
        return false;
    };
    let by = path.by();
    let turns = (0..COUNT).any(|axis| is_rotary(axis) && (off[axis] != 0.0 || by[axis] != 0.0));
    let slope = path.slope(first.t);
    let square: f64 = slope.iter().map(|d| d * d).sum();
    let along = off.iter().zip(&slope).map(|(o, s)| o * s).sum::<f64>() / square;
    // It is over well before the first place where the path may be divided.
    let is_short = along.abs() < 0.5 * (next.t - first.t);
    !turns && is_short && limits.of(&cut::across(off, &slope, f64::INFINITY)) <= BESIDE
}

/// True if the step at a reversal is small enough to be made on the way: a straight move begins where the one before ended,
/// as far beside its path as anything on the way may be.
fn merges(path: &Path, off: &PerLetter, limits: &Limits) -> bool {
    matches!(path, Path::Line(..)) && limits.of(off) <= 1.0
}

/// The piece up to `end` that takes the step at a reversal with it, along an arc where one fits.
fn blended(path: &Path, at: &PerLetter, nodes: &[Node], end: Node) -> Piece {
    let arc = match path {
        Path::Arc(arc) => {
            let before = nodes.iter().filter(|node| node.t < end.t);
            let nodes: Vec<Node> = before.copied().chain([end]).collect();
            cut::fitted(arc, at, &nodes)
        }
        Path::Line(..) => None,
    };
    Piece {
        shape: arc.map_or(Shape::Feed, Shape::Arc),
        to: arc.map_or(end.to, |arc| arc.to),
        until: end.t,
        share: Some(end.t - nodes[0].t),
    }
}

impl Corrector<'_> {
    /// True if a place is so far from another one that a step leads there.
    pub(super) fn is_beside(&self, off: &PerLetter, limits: &Limits) -> bool {
        let last = self.options.resolutions();
        let mut pairs = off.iter().zip(last);
        pairs.any(|(off, last)| off.abs() > ROUNDED * last) && limits.of(off) > BESIDE
    }

    /// Pieces along the path that was traced, each stretch of it after the step onto it.
    ///
    /// # Errors
    /// A place where the axes cannot go.
    pub(super) fn runs(
        &mut self,
        field: &Field<'_>,
        path: &Path,
        limits: &Limits,
    ) -> Result<Vec<Piece>, Lost> {
        let traced = std::mem::take(&mut self.traced);
        let mut pieces = Vec::new();
        let mut at = self.written.position.at;
        let mut before = self.start_travel;
        for (number, (stretch, range)) in traced.runs.iter().enumerate() {
            let nodes = &traced.nodes[range.clone()];
            nodes.iter().try_for_each(|node| field.reaches(node))?;
            let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
                continue;
            };
            let mut nodes = nodes.to_vec();
            let off = std::array::from_fn(|i| first.to[i] - at[i]);
            if self.is_beside(&off, limits) {
                let reverses = stretch.travel != before && (self.joined || number > 0);
                if reverses && number == 0 && takes_up(path, &nodes, &off, limits) {
                    // The move begins where the one before ended, and goes the way of the step first.
                } else if reverses && number == 0 && merges(path, &off, limits) {
                    nodes[0].to = at;
                } else if reverses && self.options.backlash == Backlash::Blend {
                    self.report.take_ups += 1;
                    let t = stretch.from + BLEND / path.length();
                    let end = match t < stretch.to {
                        true => field.node(t, &path.at(t), &stretch.travel)?,
                        false => *last,
                    };
                    let piece = blended(path, &at, &nodes, end);
                    nodes.retain(|node| node.t > end.t);
                    nodes.insert(0, end);
                    at = piece.to;
                    pieces.push(piece);
                } else {
                    self.report.take_ups += u64::from(reverses);
                    pieces.push(Piece::step(first.to, first.t));
                    at = first.to;
                }
            }
            if nodes.len() > 1 {
                match path {
                    Path::Arc(arc) => {
                        let place = |t: f64| field.node(t, &arc.at(t), &stretch.travel);
                        at = self.arcs(arc, &place, &nodes, at, limits, &mut pieces)?;
                    }
                    Path::Line(..) => {
                        self.lines(&nodes, limits, &mut pieces);
                        at = last.to;
                    }
                }
            }
            before = stretch.travel;
        }
        self.traced = traced;
        Ok(pieces)
    }

    /// Straight pieces along nodes.
    pub(super) fn lines(&mut self, nodes: &[Node], limits: &Limits, pieces: &mut Vec<Piece>) {
        self.ends.clear();
        cut::straight(nodes, limits, &mut self.ends);
        let mut from = nodes[0].t;
        for end in &self.ends {
            let node = &nodes[*end];
            pieces.push(Piece {
                shape: Shape::Feed,
                to: node.to,
                until: node.t,
                share: Some(node.t - from),
            });
            from = node.t;
        }
    }
}
