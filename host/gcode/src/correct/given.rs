//! A line of the program, as it is given.

use crate::axes::{self, is_rotary};
use crate::fault::Fault;
use crate::interpret::Step;
use crate::trace::{Lost, MOST_PARTS};
use crate::words::Block;

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

impl From<Lost> for Fault {
    fn from(lost: Lost) -> Self {
        let outside = |corrected: &str, axis: usize, at: f64, [low, high]: [f64; 2]| {
            let (name, unit) = (axes::name(axis), if is_rotary(axis) { "deg" } else { "mm" });
            format!(
                "{name} would be at {at:.4} {unit}{corrected}, outside its travel of {low} to {high} {unit}"
            )
        };
        match lost {
            Lost::Outside(axis, at, limits) => Self::of_motion(
                outside("", axis, at, limits),
                "check the offsets in the setup and the position of the part",
            ),
            Lost::Beyond(axis, at, limits) => Self::of_motion(
                outside(" with its correction", axis, at, limits),
                format!(
                    "stay away from the end by the correction; if {} can go there, give the machine file a `range` \
                     that reaches a little farther and compile again",
                    axes::name(axis)
                ),
            ),
            Lost::NoPose => Self::of_motion(
                "no axis positions put the tip there",
                "check the place of the part, the tool length and the machine file",
            ),
            Lost::TooLong => Self::of_motion(
                format!(
                    "a move so long that its correction would be looked at in more than {MOST_PARTS} places"
                ),
                "write it as several moves",
            ),
            Lost::NoLength => Self::of_motion(
                "the compensation depends on the tool length, which is unknown here",
                "give the setup the tool in the spindle, [start] tool = 1, and its length, [tool.1] length = …",
            ),
            Lost::Direction(axis) => {
                let letter = axes::name(axis);
                Self::of_motion(
                    format!(
                        "the compensation depends on the direction in which {letter} moved last, which is unknown here"
                    ),
                    format!(
                        "give it in the setup: [start] travel = {{ {letter} = \"+\" }}, or \"-\""
                    ),
                )
            }
        }
    }
}
