//! Straight moves: their corrected ends, and cuts where the correction bends them.

use super::given::Moving;
use super::piece::{Piece, Shape, Timing};
use super::{Backlash, Corrector};
use crate::gcode::axes::{NOTHING, PerLetter};
use crate::gcode::cut;
use crate::gcode::fault::Fault;
use crate::gcode::interpret::bits;
use crate::gcode::limits::Limits;
use crate::gcode::modal::Cutter;
use crate::gcode::moves::{Rate, Straight};
use crate::gcode::trace::{Node, Path};

/// What a bound of corrections may be, in parts of what is allowed: evaluation rounds in f32.
const SURELY: f64 = 0.9;

impl Corrector<'_> {
    /// G0, G1, G33.
    pub(super) fn straight(
        &mut self,
        straight: &Straight,
        rate: Rate,
        moving: &Moving,
    ) -> Result<Vec<Piece>, Fault> {
        let shape = match rate {
            Rate::Rapid if !straight.with_spindle => Shape::Rapid,
            _ => Shape::Feed,
        };
        let to = straight.to;
        let held = self.held(straight, rate);
        let path = Path::Line(straight.from.at, to);
        if straight.from.missing(self.tables.axes).is_some() {
            // Where it comes from is not known, only where it ends.
            let q = self.field().axes(&to);
            let q = q.map_err(|lost| moving.lost(lost))?;
            if self.axes_turn() {
                self.ways.come_to(self.tables, &q);
            }
            if let Some(axis) = self.ways.missing(self.tables) {
                return Err(moving.direction_unknown(axis));
            }
            let end = self.end(&to, held, moving)?;
            return Ok(vec![Piece::of(shape, end, self.timing(rate, &path))]);
        }
        let by: PerLetter = std::array::from_fn(|i| to[i] - straight.from.at[i]);
        if by.iter().all(|by| by.abs() < NOTHING) {
            // Nothing moves, and no axis turns.
            if self.joined {
                let stands = self.written.position.at;
                return Ok(vec![Piece::of(shape, stands, Timing::None)]);
            }
            let end = self.end(&to, held, moving)?;
            return Ok(vec![Piece::of(shape, end, Timing::None)]);
        }
        if self.goes_on_without_cut(straight) {
            let end = self.end(&to, held, moving)?;
            return Ok(vec![Piece::of(shape, end, self.timing(rate, &path))]);
        }
        let mut last = self.trace(&path, 0, moving)?;
        let mut nodes = std::mem::take(&mut self.traced.nodes);
        for node in nodes.iter_mut().chain([&mut last]) {
            self.hold(held, node);
        }
        self.traced.nodes = nodes;
        self.corrected(&last);
        let field = self.field();
        field.reaches(&last).map_err(|lost| moving.lost(lost))?;
        let timing = self.timing(rate, &path);
        let limits = self.limits();
        if straight.with_spindle {
            if !self.traced.breaks.is_empty() || !cut::is_straight(&self.traced.nodes, &limits) {
                return Err(Fault::new(
                    moving.span.clone(),
                    "a thread that would have to be cut into several moves",
                    "give a larger --tolerance, or use the compensation in the controller",
                ));
            }
            return Ok(vec![Piece::of(shape, last.to, Timing::None)]);
        }
        if self.is_offset() && !self.may_be_cut() {
            self.note_cutter(&limits);
            return Ok(vec![Piece::of(shape, last.to, timing)]);
        }
        let join = match shape {
            Shape::Feed => self.join(&self.traced.nodes[0], &limits, timing),
            _ => None,
        };
        let pieces = self.runs(&field, shape, &limits, timing);
        let mut pieces = pieces.map_err(|lost| moving.lost(lost))?;
        join.into_iter().for_each(|join| pieces.insert(0, join));
        let cuts = pieces.iter().filter(|p| p.timing != Timing::TakeUp);
        self.report.cut += u64::from(cuts.count() > 1);
        Ok(pieces)
    }

    /// True for a motion under cutter compensation, and for the one along which the path gets its offset or loses it.
    pub(super) fn is_offset(&self) -> bool {
        self.nominal.under != Cutter::Off
    }

    /// True if cuts change nothing but the correction: an offset that comes or goes would do so within the first piece.
    fn may_be_cut(&self) -> bool {
        self.options.cut_under_cutter && self.nominal.under != Cutter::Changes
    }

    /// True if a move certainly needs no cut, whatever corrections are along it; directions are those at its end then.
    fn goes_on_without_cut(&mut self, straight: &Straight) -> bool {
        let leave = self.options.backlash == Backlash::Leave && self.tables.directional != 0;
        let looks = leave || straight.with_spindle || self.is_offset() || self.nominal.tip;
        if looks || !self.joined {
            return false;
        }
        let by = std::array::from_fn(|i| (straight.to[i] - straight.from.at[i]).abs());
        self.bends_little(&by) && self.ways.goes_on(self.tables, &straight.to)
    }

    /// True if corrections along a move by so much (not negative) certainly keep the straight line between their ends.
    fn bends_little(&mut self, by: &PerLetter) -> bool {
        // A bound grows with the way of each axis: what is within a move that is known to be straight is straight.
        let is_within = by.iter().zip(&self.uncut).all(|(by, most)| by <= most);
        if is_within {
            return true;
        }
        let limits = self.limits();
        let keeps = |by: &PerLetter| limits.of_lengths(self.tables.bend.at_most(by)) <= SURELY;
        if !keeps(by) {
            return false;
        }
        let both = std::array::from_fn(|i| by[i].max(self.uncut[i]));
        if keeps(&both) {
            self.uncut = both;
        }
        true
    }

    /// Axes (bits) that stay where they are during a rapid, without a word: those that neither the program has commanded
    /// yet nor this one has. Nobody knows where they stand when it runs.
    pub(super) fn held(&self, straight: &Straight, rate: Rate) -> u16 {
        if !matches!(rate, Rate::Rapid) || straight.with_spindle {
            return 0;
        }
        let moved = match straight.machine {
            true => straight.due,
            false => self.nominal.together(straight.due | self.written.commanded),
        };
        self.tables.axes & !moved
    }

    /// Axes that are held stay where they are.
    pub(super) fn hold(&self, held: u16, node: &mut Node) {
        for axis in bits(held) {
            node.to[axis] = self.written.position.at[axis];
            if !self.nominal.tip {
                node.moved[axis] = node.to[axis];
            }
        }
    }

    /// The corrected end of a motion, by the directions that hold.
    fn end(&mut self, to: &PerLetter, held: u16, moving: &Moving) -> Result<PerLetter, Fault> {
        let field = self.field();
        let mut node = match field.node(1.0, to, &self.ways) {
            Ok(node) => node,
            Err(lost) => return Err(moving.lost(lost)),
        };
        self.hold(held, &mut node);
        field.reaches(&node).map_err(|lost| moving.lost(lost))?;
        self.corrected(&node);
        Ok(node.to)
    }

    /// End points under cutter compensation: what it costs that their moves are not cut.
    fn note_cutter(&mut self, limits: &Limits) {
        self.report.under_cutter += 1;
        let nodes = &self.traced.nodes;
        let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
            return;
        };
        let mut off = 0.0_f64;
        for node in nodes {
            let part: PerLetter = std::array::from_fn(|i| {
                node.to[i]
                    - node.q[i]
                    - (1.0 - node.t) * (first.to[i] - first.q[i])
                    - node.t * (last.to[i] - last.q[i])
            });
            off = off.max(limits.of(&part) * limits.linear);
        }
        self.report.under_cutter_off = self.report.under_cutter_off.max(off);
    }
}
