//! Straight pieces along a corrected path, between the places where axes turn round.

use super::Corrector;
use super::piece::{Piece, Shape, Timing};
use crate::gcode::axes::PerLetter;
use crate::gcode::cut;
use crate::gcode::limits::Limits;
use crate::gcode::trace::{Field, Lost};
use std::ops::Range;

impl Corrector<'_> {
    /// The runs between reversals, as ranges of the nodes.
    pub(super) fn runs_of(&self) -> Vec<Range<usize>> {
        let (nodes, breaks) = (&self.traced.nodes, &self.traced.breaks);
        let mut from = 0;
        let mut runs = Vec::with_capacity(breaks.len() + 1);
        for end in breaks.iter().copied().chain([nodes.len()]) {
            runs.push(from..end);
            from = end;
        }
        runs
    }

    /// The step where a direction changes, if it is a move of its own.
    pub(super) fn take_up(
        &mut self,
        to: PerLetter,
        shape: Shape,
        timing: Timing,
        pieces: &mut Vec<Piece>,
    ) {
        if !self.options.backlash.is_apart() || self.is_offset() {
            return;
        }
        let shape = match shape {
            Shape::Rapid => Shape::Rapid,
            _ => Shape::Feed,
        };
        let feed = Piece::of(shape, to, timing).feed;
        pieces.push(Piece {
            shape,
            to,
            timing: Timing::TakeUp,
            feed,
        });
        self.report.take_ups += 1;
    }

    /// Straight pieces along the nodes.
    ///
    /// # Errors
    /// An end where the axes cannot go.
    pub(super) fn runs(
        &mut self,
        field: &Field<'_>,
        shape: Shape,
        limits: &Limits,
        timing: Timing,
    ) -> Result<Vec<Piece>, Lost> {
        let mut pieces = Vec::new();
        let mut last_t = 0.0;
        for (number, run) in self.runs_of().into_iter().enumerate() {
            if number > 0 {
                let to = self.traced.nodes[run.start].to;
                self.take_up(to, shape, timing, &mut pieces);
            }
            if run.len() < 2 {
                continue;
            }
            let nodes = &self.traced.nodes[run];
            self.ends.clear();
            cut::straight(nodes, limits, &mut self.ends);
            for end in &self.ends {
                let node = &nodes[*end];
                field.reaches(node)?;
                let share = node.t - last_t;
                last_t = node.t;
                pieces.push(Piece::of(shape, node.to, timing.shared(share)));
            }
        }
        Ok(pieces)
    }
}
