//! Arcs: shifted where an arc keeps the corrected path, otherwise chords.

use super::Corrector;
use super::given::Moving;
use super::piece::{Piece, Shape, Timing};
use crate::gcode::arc::Arc;
use crate::gcode::axes::PerLetter;
use crate::gcode::cut;
use crate::gcode::fault::Fault;
use crate::gcode::limits::Limits;
use crate::gcode::moves::Rate;
use crate::gcode::trace::Path;

/// What is farther from an arc, in parts of the radius, is another figure, and the end of one its beginning.
const LARGEST: f64 = 0.1;

/// So much of a sagitta is seen at nodes, of which a chord has four, if it is largest between two of them: 1 - 1/16.
const SEEN: f64 = 0.9375;

/// An arc under cutter compensation that is farther off is another one: in parts of the radius, and mm more.
const OTHER: [f64; 2] = [0.1, 0.01];

impl Corrector<'_> {
    /// G2, G3.
    pub(super) fn arc(
        &mut self,
        arc: &Arc,
        rate: Rate,
        moving: &Moving,
    ) -> Result<Vec<Piece>, Fault> {
        let path = Path::Arc(*arc);
        let last = self.trace(&path, 0, moving)?;
        self.corrected(&last);
        let field = self.field();
        let mut nodes = self.traced.nodes[1..].iter();
        let reaches = nodes.try_for_each(|node| field.reaches(node));
        reaches.map_err(|lost| moving.lost(lost))?;
        let timing = self.timing(rate, &path);
        let [r0, r1] = arc.radii();
        let farthest = LARGEST * r0.min(r1);
        let limits = self.limits().within(farthest);
        if self.is_offset() {
            return self.in_one(arc, &limits, timing, moving);
        }
        let join = self.join(&self.traced.nodes[0], &limits, timing);
        let joined = |mut pieces: Vec<Piece>| {
            join.into_iter().for_each(|join| pieces.insert(0, join));
            pieces
        };
        if !self.nominal.tip {
            let from = join.map_or(self.written.position.at, |join| join.to);
            if let Some(pieces) = self.arc_runs(arc, from, &limits, timing) {
                self.report.arcs[0] += 1;
                return Ok(joined(pieces));
            }
        }
        // Chords: nodes as close as a quarter of one.
        let sagitta = self.options.chord.min(farthest);
        let seen = SEEN * sagitta;
        let chord = 2.0 * (1.0 - seen / r0.max(r1)).acos();
        let finer = (4.0 * arc.sweep.abs() / chord).ceil() as usize;
        // From the directions at its start again.
        self.ways = self.start_ways.clone();
        self.trace(&path, finer, moving)?;
        let limits = limits.plus(seen);
        let pieces = self.runs(&field, Shape::Feed, &limits, timing);
        let pieces = pieces.map_err(|lost| moving.lost(lost))?;
        self.report.arcs[1] += 1;
        Ok(joined(pieces))
    }

    /// An arc that must stay one: under cutter compensation, whatever that costs.
    fn in_one(
        &mut self,
        arc: &Arc,
        limits: &Limits,
        timing: Timing,
        moving: &Moving,
    ) -> Result<Vec<Piece>, Fault> {
        let from = self.written.position.at;
        let nodes = &self.traced.nodes;
        let whole = &nodes[..];
        let shifted = match self.nominal.tip {
            true => None,
            false => cut::fitted(arc, &from, whole),
        };
        let cannot = || {
            Fault::new(
                moving.span.clone(),
                "an arc under cutter compensation that cannot stay one",
                "write the path out without G41 and G42",
            )
        };
        let shifted = shifted.ok_or_else(cannot)?;
        let off = cut::off_arc(arc, &shifted, whole, limits) * limits.linear;
        // Ends of nearly a full turn say little of its centre.
        if off > OTHER[0] * arc.radii()[0] + OTHER[1] {
            return Err(cannot());
        }
        self.report.under_cutter += 1;
        self.report.under_cutter_off = self.report.under_cutter_off.max(off);
        self.report.arcs[0] += 1;
        Ok(vec![Piece::of(Shape::Arc(shifted), shifted.to, timing)])
    }

    /// Arcs along the nodes; `None` if the path is not kept by arcs.
    fn arc_runs(
        &mut self,
        arc: &Arc,
        mut from: PerLetter,
        limits: &Limits,
        timing: Timing,
    ) -> Option<Vec<Piece>> {
        let mut pieces = Vec::new();
        let before = self.report.take_ups;
        let mut last_t = 0.0;
        for (number, run) in self.runs_of().into_iter().enumerate() {
            if number > 0 {
                let to = self.traced.nodes[run.start].to;
                self.take_up(to, Shape::Feed, timing, &mut pieces);
                if self.options.backlash.is_apart() {
                    from = to;
                }
            }
            if run.len() < 2 {
                continue;
            }
            let nodes = &self.traced.nodes[run];
            let Some(shifted) = cut::arc(arc, &from, nodes, limits) else {
                self.report.take_ups = before;
                return None;
            };
            from = shifted.to;
            let t = nodes[nodes.len() - 1].t;
            let timing = timing.shared(t - last_t);
            pieces.push(Piece::of(Shape::Arc(shifted), shifted.to, timing));
            last_t = t;
        }
        Some(pieces)
    }
}
