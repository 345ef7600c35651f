//! Canned cycles: corrected words where that is right, single moves where it is not.

use super::Corrector;
use super::piece::{Piece, Shape, Timing, lost_at, span_of};
use super::write::{Change, is_machine};
use crate::gcode::axes::{COUNT, PerLetter};
use crate::gcode::codes::{self, Code};
use crate::gcode::cycle::{Cycle, Part};
use crate::gcode::fault::Fault;
use crate::gcode::interpret::{Step, bits};
use crate::gcode::modal::{Distance, FeedMode, Motion};
use crate::gcode::moves::Rate;
use crate::gcode::number;
use crate::gcode::trace::{Field, Lost, Node, Path};
use crate::gcode::words::Block;

/// Heights at which a hole is looked at.
const HEIGHTS: usize = 9;

impl Corrector<'_> {
    #[allow(clippy::too_many_arguments)]
    pub(super) fn cycle(
        &mut self,
        block: &Block,
        step: &Step,
        cycle: &Cycle,
        length: Option<f64>,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let span = span_of(block);
        let single = cycle.repeat == 1 && self.written_out != Some(cycle.code);
        let straight = self.tables.directional & (1 << cycle.axes[2]) == 0
            && !self.nominal.offsets.is_turned()
            && self.nominal.distance == Some(Distance::Absolute);
        let stays = single
            && straight
            && self
                .is_constant(cycle, length)
                .map_err(|l| lost_at(span.clone(), l))?;
        let in_series = self.written.cycle.is_some() || self.written_out.is_none();
        if stays && in_series {
            self.written_out = None;
            self.report.cycles[0] += 1;
            return self.shifted(block, cycle, length, line, eol, out);
        }
        let Some(parts) = cycle.parts() else {
            return Err(Fault::new(
                span,
                format!(
                    "the correction changes over this hole, and G{} cannot be written out",
                    cycle.code / 10
                ),
                "give a larger --tolerance, or use the compensation in the controller",
            ));
        };
        self.written_out = Some(cycle.code);
        self.report.cycles[1] += 1;
        self.write_out(block, step, cycle, &parts, length, line, eol, out)
    }

    /// True if one correction across the hole, and one straight line along it, hold over its depth.
    fn is_constant(&self, cycle: &Cycle, length: Option<f64>) -> Result<bool, Lost> {
        let field = self.field(length);
        let limits = self.limits();
        let n = cycle.axes[2];
        let bottom = self.in_hole(&field, cycle, cycle.bottom)?;
        let top = self.in_hole(&field, cycle, cycle.r)?;
        for k in 0..HEIGHTS {
            let part = k as f64 / HEIGHTS as f64;
            let node = self.in_hole(&field, cycle, cycle.r + (cycle.bottom - cycle.r) * part)?;
            let mut off: PerLetter =
                std::array::from_fn(|i| (node.to[i] - node.q[i]) - (bottom.to[i] - bottom.q[i]));
            off[n] = node.to[n] - top.to[n] - part * (bottom.to[n] - top.to[n]);
            if limits.of(&off) > 1.0 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The corrected position in the first hole of a cycle.
    fn in_hole(&self, field: &Field<'_>, cycle: &Cycle, height: f64) -> Result<Node, Lost> {
        let mut hole = cycle.first;
        hole[cycle.axes[2]] = height;
        let mut ways = self.ways.clone();
        ways.come_to(self.tables, &hole);
        let node = field.node(1.0, &hole, &ways)?;
        field.reaches(&node)?;
        Ok(node)
    }

    /// The cycle with corrected words.
    fn shifted(
        &mut self,
        block: &Block,
        cycle: &Cycle,
        length: Option<f64>,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let span = span_of(block);
        let field = self.field(length);
        let n = cycle.axes[2];
        let mut hole = cycle.first;
        hole[n] = cycle.bottom;
        self.ways.come_to(self.tables, &hole);
        if let Some(axis) = self.ways.missing(self.tables) {
            return Err(super::direction_unknown(span, axis));
        }
        let node = self
            .in_hole(&field, cycle, cycle.bottom)
            .map_err(|l| lost_at(span.clone(), l))?;
        let top = self
            .in_hole(&field, cycle, cycle.r)
            .map_err(|l| lost_at(span.clone(), l))?;
        self.corrected(&node);
        // Rotary axes and others outside the plane go there in a line before.
        let outside = bits(self.tables.axes).filter(|axis| !cycle.axes.contains(axis));
        let unit = self.unit();
        let mut before = self.written.position.at;
        let mut moves = false;
        for axis in outside {
            let finest = 0.6
                * 10_f64
                    .powi(-(number::decimals(axis, crate::gcode::modal::Units::Millimetre) as i32));
            if (node.to[axis] - before[axis]).abs() >= finest {
                before[axis] = node.to[axis];
                moves = true;
            }
        }
        if moves {
            let piece = Piece::whole(Shape::Rapid, before, Timing::None);
            // A line before it ends the series for the controller: all words are written anew.
            self.write_rapid(block, &piece, eol, out)?;
        }
        let fresh_series = self.written.cycle.is_none_or(|c| c.code != cycle.code);
        let by = top.to[n] - top.q[n];
        let offsets = &self.written.offsets;
        let program = offsets.program(&node.to);
        let mut to = node.to;
        to[n] = cycle.r + by;
        let r = offsets.program(&to)[n] / unit;
        let point = self.rules.dialect == crate::gcode::dialect::Dialect::Fanuc;
        let mut edits = std::mem::take(&mut self.edits);
        edits.clear();
        let units = self
            .nominal
            .units
            .unwrap_or(crate::gcode::modal::Units::Millimetre);
        let letters = cycle.axes.map(|axis| crate::gcode::axes::LETTERS[axis]);
        let needed: Vec<(u8, f64, usize)> = (0..3)
            .map(|k| {
                (
                    letters[k],
                    program[cycle.axes[k]] / unit,
                    number::decimals(cycle.axes[k], units),
                )
            })
            .chain([(b'R', r, number::decimals(n, units))])
            .collect();
        let mut place = block.end;
        let mut has_motion = false;
        let mut done = [false; 4];
        let mut has = [false; 3];
        for word in &block.words {
            if word.letter == b'G'
                && let Some(Code::Motion(Motion::Cycle(_))) =
                    word.tenths().and_then(|t| codes::g(t, self.rules.dialect))
            {
                has_motion = true;
            }
            match word.letter {
                b'Q' => has[0] = true,
                b'P' => has[1] = true,
                b'F' => has[2] = true,
                _ => {}
            }
            if let Some(k) = needed
                .iter()
                .position(|(letter, ..)| *letter == word.letter)
            {
                done[k] = true;
                place = word.end;
                let (_, value, decimals) = needed[k];
                let decimals = decimals.max(word.decimals);
                edits.replace(word.number..word.end, |to| {
                    number::write(to, value, decimals, word.decimals.min(decimals), point)
                });
            }
        }
        let mut add = |letter: u8, value: f64, decimals: usize| {
            edits.replace(place..place, |to| {
                to.extend_from_slice(&[b' ', letter]);
                number::write(to, value, decimals, 0, point);
            });
        };
        for (k, (letter, value, decimals)) in needed.iter().enumerate() {
            if !done[k] {
                add(*letter, *value, *decimals);
            }
        }
        if fresh_series || moves {
            if let (false, Some(q)) = (has[0], cycle.q) {
                add(b'Q', q / unit, 6);
            }
            if let (false, Some(p)) = (has[1], cycle.p) {
                add(b'P', p, 6);
            }
        }
        if let Some(feed) = self.nominal.feed
            && !has[2]
            && self.written.feed != Some(feed)
        {
            add(b'F', feed, 6);
        }
        if !has_motion && self.written.motion != Some(Motion::Cycle(cycle.code)) {
            let word = Motion::Cycle(cycle.code).word();
            edits.replace(place..place, |to| {
                to.push(b' ');
                to.extend_from_slice(word.as_bytes());
            });
        }
        let from = out.len();
        edits.apply(line, out);
        self.edits = edits;
        self.follow(&out[from..], None)?;
        out.extend_from_slice(eol);
        let mut end = node.to;
        end[n] = self
            .written
            .cycle
            .map_or(cycle.r + by, |c| match cycle.retract {
                crate::gcode::modal::Retract::Initial => c.initial.max(cycle.r + by),
                crate::gcode::modal::Retract::Plane => cycle.r + by,
            });
        let leads = cycle
            .axes
            .iter()
            .all(|i| (self.written.position.at[*i] - end[*i]).abs() < 1e-3);
        if !leads {
            return Err(Fault::new(
                span,
                "what would be written is wrong",
                "this is a mistake of trueaxis: please report the line",
            ));
        }
        Ok(())
    }

    fn write_rapid(
        &mut self,
        block: &Block,
        piece: &Piece,
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let motion = self.nominal.motion;
        self.nominal.motion = Some(Motion::Rapid);
        let done = self.write_next(block, piece, false, eol, out);
        self.nominal.motion = motion;
        done
    }

    /// The cycle as single moves.
    #[allow(clippy::too_many_arguments)]
    fn write_out(
        &mut self,
        block: &Block,
        step: &Step,
        cycle: &Cycle,
        parts: &[Part],
        length: Option<f64>,
        line: &[u8],
        eol: &[u8],
        out: &mut Vec<u8>,
    ) -> Result<(), Fault> {
        let span = span_of(block);
        let rate = match (self.nominal.feed, self.nominal.feed_mode) {
            (Some(f), FeedMode::PerRevolution) => Rate::PerRevolution(f),
            (Some(f), _) => Rate::PerMinute(f),
            (None, _) => {
                return Err(Fault::new(
                    span,
                    "a feed that is not known",
                    "write F before it",
                ));
            }
        };
        let motion = self.nominal.motion;
        let eol = if eol.is_empty() { self.eol } else { eol };
        let mut at = cycle.from;
        let mut first = true;
        for part in parts {
            let mut pieces = Vec::new();
            match part {
                Part::Dwell(p) => {
                    let mut text = Vec::from(*b"G4 P");
                    number::write(&mut text, *p, 6, 0, false);
                    if block.deleted {
                        text.insert(0, b'/');
                    }
                    self.follow(&text, None)?;
                    out.extend_from_slice(&text);
                    out.extend_from_slice(eol);
                    self.report.lines[1] += 1;
                    continue;
                }
                Part::Rapid(to) | Part::Feed(to) => {
                    let (shape, rate) = match part {
                        Part::Rapid(_) => (Shape::Rapid, Rate::Rapid),
                        _ => (Shape::Feed, rate),
                    };
                    let path = Path::Line(at, *to);
                    self.traced(&path, 0, &span, length)?;
                    let last = self.nodes[self.nodes.len() - 1];
                    self.corrected(&last);
                    let timing = self.timing(rate, &path);
                    let limits = self.limits();
                    let field = self.field(length);
                    self.runs(&field, shape, &limits, timing, &mut pieces)
                        .map_err(|l| lost_at(span.clone(), l))?;
                    at = *to;
                }
            }
            for piece in &pieces {
                if first {
                    first = false;
                    // Motion words of the line become those of its first move.
                    self.nominal.motion = Some(Motion::Rapid);
                    let change = Change {
                        piece,
                        wanted: 0,
                        fresh: true,
                        without: b"RQPL",
                        without_after: step.after,
                    };
                    let done = self.write_first(
                        block,
                        &change,
                        is_machine(block, self.rules.dialect),
                        line,
                        out,
                    );
                    self.nominal.motion = motion;
                    done?;
                    out.extend_from_slice(eol);
                } else {
                    self.nominal.motion = Some(Motion::Rapid);
                    let done = self.write_next(block, piece, false, eol, out);
                    self.nominal.motion = motion;
                    done?;
                }
            }
        }
        if step.after {
            self.write_after(block, line, eol, out)?;
        }
        debug_assert!((0..COUNT).all(|i| (at[i] - cycle.to()[i]).abs() < 1e-9));
        Ok(())
    }
}
