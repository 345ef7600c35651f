//! A line of the program, as it is given.

use crate::axes::{self, is_rotary};
use crate::fault::Fault;
use crate::interpret::Step;
use crate::trace::{Lost, MOST_PARTS};
use crate::words::{Block, Word};
use std::ops::Range;

/// A line: its bytes, its words, and what it does.
#[derive(Clone, Copy)]
pub(super) struct Given<'l> {
    /// Without its end.
    pub line: &'l [u8],
    /// How it ends.
    pub eol: &'l [u8],
    pub block: &'l Block,
    pub step: &'l Step,
}

/// What every correction of a motion needs besides its path.
pub(super) struct Moving {
    /// The bytes to be pointed at.
    pub span: Range<usize>,
    /// Length of the tool (mm), if it is known.
    pub length: Option<f64>,
}

impl Moving {
    /// What to say of a position that cannot be corrected.
    pub fn lost(&self, lost: Lost) -> Fault {
        let span = self.span.clone();
        let outside = |corrected: &str, axis: usize, at: f64, [low, high]: [f64; 2]| {
            let (name, unit) = (axes::name(axis), if is_rotary(axis) { "deg" } else { "mm" });
            format!(
                "{name} would be at {at:.4} {unit}{corrected}, outside its travel of {low} to {high} {unit}"
            )
        };
        match lost {
            Lost::Outside(axis, at, limits) => Fault::new(
                span,
                outside("", axis, at, limits),
                "check the offsets in the setup and the position of the part",
            ),
            Lost::Beyond(axis, at, limits) => Fault::new(
                span,
                outside(" with its correction", axis, at, limits),
                format!(
                    "stay away from the end by the correction; if {} can go there, give the machine file a `range` \
                     that reaches a little farther and compile again",
                    axes::name(axis)
                ),
            ),
            Lost::NoPose => Fault::no_pose(span),
            Lost::TooLong => Fault::new(
                span,
                format!(
                    "a move so long that its correction would be looked at in more than {MOST_PARTS} places"
                ),
                "write it as several moves",
            ),
            Lost::NoLength => Fault::new(
                span,
                "the compensation depends on the tool length, which is unknown here",
                "give the setup the tool in the spindle, [start] tool = 1, and its length, [tool.1] length = …",
            ),
        }
    }

    /// A direction that must be known.
    pub(crate) fn direction_unknown(&self, axis: usize) -> Fault {
        let letter = axes::name(axis);
        Fault::new(
            self.span.clone(),
            format!(
                "the compensation depends on the direction in which {letter} moved last, which is unknown here"
            ),
            format!("give it in the setup: [start] travel = {{ {letter} = \"+\" }}, or \"-\""),
        )
    }
}

/// The bytes of a line to be pointed at: its words.
pub(in crate::correct) fn span_of(block: &Block) -> Range<usize> {
    let is_axis = |w: &&Word| axes::index(w.letter).is_some();
    let first = block.words.iter().find(is_axis);
    first
        .or(block.words.first())
        .map_or(0..block.end, Word::span)
}
