//! The pieces that a corrected motion is written as.

use super::{Backlash, Corrector};
use crate::gcode::arc::Arc;
use crate::gcode::axes::{COUNT, PerLetter, is_rotary};
use crate::gcode::cut::{self, Limits};
use crate::gcode::dialect::Dialect;
use crate::gcode::fault::Fault;
use crate::gcode::modal::Units;
use crate::gcode::moves::Rate;
use crate::gcode::trace::{Field, Lost, Node, Path};
use crate::gcode::words::Block;
use std::ops::Range;

/// What a piece is written with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// G0.
    Rapid,
    /// G1.
    Feed,
    /// G2, G3.
    Arc(Arc),
}

/// How long a piece is to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Timing {
    /// As it comes.
    None,
    /// A part of the time of a motion.
    Part {
        /// What the program says.
        rate: Rate,
        /// What the whole motion takes (minutes, or revolutions).
        minutes: f64,
        /// The part of it.
        share: f64,
        /// True if rotary axes move.
        turns: bool,
    },
    /// A step at a reversal, with this F.
    TakeUp,
}

/// A single move that is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// How.
    pub shape: Shape,
    /// Where it ends, in words' coordinates.
    pub to: PerLetter,
    /// How long it is to take.
    pub timing: Timing,
    /// The F of the motion, under which a take-up runs.
    pub feed: Option<Rate>,
}

impl Piece {
    /// A motion in one piece.
    pub fn whole(shape: Shape, to: PerLetter, timing: Timing) -> Self {
        Self::of(shape, to, timing)
    }

    fn of(shape: Shape, to: PerLetter, timing: Timing) -> Self {
        let feed = match timing {
            Timing::Part { rate, .. } => Some(rate),
            _ => None,
        };
        Self {
            shape,
            to,
            timing,
            feed,
        }
    }
}

impl Timing {
    /// A part of this time.
    fn shared(self, part: f64) -> Self {
        match self {
            Self::Part {
                rate,
                minutes,
                share,
                turns,
            } => Self::Part {
                rate,
                minutes,
                share: share * part,
                turns,
            },
            other => other,
        }
    }
}

/// The bytes of a line to be pointed at: its words.
pub(super) fn span_of(block: &Block) -> Range<usize> {
    let first = block
        .words
        .iter()
        .find(|w| crate::gcode::axes::index(w.letter).is_some());
    first
        .or(block.words.first())
        .map_or(0..block.end, |w| w.start..w.end)
}

/// What to say of a position that cannot be corrected.
pub(super) fn lost_at(span: Range<usize>, lost: Lost) -> Fault {
    match lost {
        Lost::Outside(axis, at, [low, high]) => {
            let unit = if is_rotary(axis) { "deg" } else { "mm" };
            Fault::new(
                span,
                format!(
                    "{} would be at {at:.4} {unit}, outside its travel of {low} to {high} {unit}",
                    crate::gcode::axes::name(axis)
                ),
                "check the offsets in the setup and the position of the part",
            )
        }
        Lost::NoPose => Fault::new(
            span,
            "no axis positions put the tip there",
            "check the machine",
        ),
    }
}

/// A direction that must be known.
pub(super) fn direction_unknown(span: Range<usize>, axis: usize) -> Fault {
    let letter = crate::gcode::axes::name(axis);
    Fault::new(
        span,
        format!(
            "the compensation depends on the direction in which {letter} moved last, which is not known here"
        ),
        format!("give it in the setup: [start] travel = {{ {letter} = \"+\" }}, or \"-\""),
    )
}

impl Corrector<'_> {
    /// The unit of the program in mm.
    pub(super) fn unit(&self) -> f64 {
        self.nominal.units.map_or(1.0, Units::mm)
    }

    /// A difference of positions in units of the program.
    pub(super) fn in_program(&self, by: &PerLetter) -> PerLetter {
        let unit = self.unit();
        std::array::from_fn(|i| if is_rotary(i) { by[i] } else { by[i] / unit })
    }

    /// What a motion takes.
    pub(super) fn timing(&self, rate: Rate, path: &Path) -> Timing {
        let by = path.by();
        let straight = self.in_program(&by);
        let length = match path {
            Path::Line(..) => self.rules.dialect.length(&straight),
            Path::Arc(arc) => {
                let linear = arc.length() / self.unit();
                match self.rules.dialect {
                    Dialect::LinuxCnc => linear,
                    _ => linear.hypot(straight[3].hypot(straight[4]).hypot(straight[5])),
                }
            }
        };
        let minutes = match rate {
            Rate::Rapid => return Timing::None,
            Rate::PerMinute(f) | Rate::PerRevolution(f) => length / f,
            Rate::Inverse(f) => 1.0 / f,
        };
        Timing::Part {
            rate,
            minutes,
            share: 1.0,
            turns: (0..COUNT).any(|i| is_rotary(i) && by[i] != 0.0),
        }
    }

    /// Takes in how far a position was corrected.
    pub(super) fn corrected(&mut self, node: &Node) {
        let by = std::array::from_fn(|i| node.moved[i] - node.q[i]);
        self.report.corrected(&by, self.line);
    }

    /// The runs between reversals, as ranges of the nodes.
    fn runs_of(&self) -> Vec<Range<usize>> {
        let mut from = 0;
        let mut runs = Vec::with_capacity(self.breaks.len() + 1);
        for end in self.breaks.iter().copied().chain([self.nodes.len()]) {
            runs.push(from..end);
            from = end;
        }
        runs
    }

    fn take_up(&mut self, to: PerLetter, shape: Shape, timing: Timing, pieces: &mut Vec<Piece>) {
        if self.options.backlash != Backlash::Move || self.nominal.cutter {
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
        pieces: &mut Vec<Piece>,
    ) -> Result<(), Lost> {
        let runs = self.runs_of();
        let mut last_t = 0.0;
        for (number, run) in runs.into_iter().enumerate() {
            if number > 0 {
                let to = self.nodes[run.start].to;
                self.take_up(to, shape, timing, pieces);
            }
            if run.len() < 2 {
                continue;
            }
            let nodes = &self.nodes[run];
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
        Ok(())
    }

    /// Arcs along the nodes; false if the path is not kept by arcs.
    pub(super) fn arc_runs(
        &mut self,
        arc: &Arc,
        limits: &Limits,
        timing: Timing,
        pieces: &mut Vec<Piece>,
    ) -> bool {
        let before = self.report.take_ups;
        let mut from = self.written.position.at;
        let mut last_t = 0.0;
        for (number, run) in self.runs_of().into_iter().enumerate() {
            if number > 0 {
                let to = self.nodes[run.start].to;
                self.take_up(to, Shape::Feed, timing, pieces);
                if self.options.backlash == Backlash::Move {
                    from = to;
                }
            }
            if run.len() < 2 {
                continue;
            }
            let nodes = &self.nodes[run];
            let Some(shifted) = cut::arc(arc, &from, nodes, limits) else {
                self.report.take_ups = before;
                return false;
            };
            from = shifted.to;
            let t = nodes[nodes.len() - 1].t;
            pieces.push(Piece::of(
                Shape::Arc(shifted),
                shifted.to,
                timing.shared(t - last_t),
            ));
            last_t = t;
        }
        true
    }
}
