//! Straight moves: their corrected ends, and cuts where the correction bends them.

use super::Corrector;
use super::given::Moving;
use super::piece::{Piece, Shape, Timing};
use crate::gcode::axes::PerLetter;
use crate::gcode::cut::{self, Limits};
use crate::gcode::fault::Fault;
use crate::gcode::moves::{Rate, Straight};
use crate::gcode::trace::{Node, Path};

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
        let path = Path::Line(straight.from.at, to);
        if straight.from.missing(self.tables.axes).is_some() || self.options.undo {
            // Where it comes from is not known, only where it ends.
            let q = self.field().axes(&to);
            let q = q.map_err(|lost| moving.lost(lost))?;
            self.ways.come_to(self.tables, &q);
            if let Some(axis) = self.ways.missing(self.tables) {
                return Err(moving.direction_unknown(axis));
            }
            let node = self.end(&to, moving)?;
            return Ok(vec![Piece::of(shape, node.to, self.timing(rate, &path))]);
        }
        if straight.from.at == to {
            // Nothing moves, and no axis turns.
            let node = self.end(&to, moving)?;
            return Ok(vec![Piece::of(shape, node.to, Timing::None)]);
        }
        let last = self.trace(&path, 0, moving)?;
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
        if self.nominal.cutter && !self.options.cut_under_cutter {
            self.note_cutter(&limits);
            return Ok(vec![Piece::of(shape, last.to, timing)]);
        }
        let pieces = self.runs(&field, shape, &limits, timing);
        let pieces = pieces.map_err(|lost| moving.lost(lost))?;
        let cuts = pieces.iter().filter(|p| p.timing != Timing::TakeUp);
        self.report.cut += u64::from(cuts.count() > 1);
        Ok(pieces)
    }

    /// The corrected end of a motion, by the directions that hold.
    fn end(&mut self, to: &PerLetter, moving: &Moving) -> Result<Node, Fault> {
        let field = self.field();
        let node = field.node(1.0, to, &self.ways);
        let node = node.map_err(|lost| moving.lost(lost))?;
        field.reaches(&node).map_err(|lost| moving.lost(lost))?;
        self.corrected(&node);
        Ok(node)
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
