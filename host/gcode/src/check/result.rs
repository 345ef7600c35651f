//! What a check finds.

use super::spread::{Spread, Statistics};
use crate::correct::Options;
use crate::limits::LEVER;
use crate::rate::Rate;
use crate::stream::StreamError;
use serde::Serialize;

/// Before and after.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ToolPath {
    /// Of the tip (µm), of the program as it is.
    pub before_um: Statistics,
    /// Of the tip (µm), corrected.
    pub after_um: Statistics,
    /// Of the tool's direction (µrad), before.
    pub before_urad: Statistics,
    /// Of the tool's direction (µrad), corrected.
    pub after_urad: Statistics,
    /// The line of the program with the largest error of the tip after.
    pub worst_line: u64,
    /// The largest part of the error of the tip after (µm) because axes have gone back into their lost motion by less than
    /// what counts as a reversal; 0 without reversals.
    pub turned_um: f64,
}

impl ToolPath {
    /// Takes in the errors of all places, in the order of its fields.
    pub(super) fn sum_up(&mut self, spreads: &[Spread; 4]) {
        let [before_um, after_um, before_urad, after_urad] =
            spreads.each_ref().map(Spread::statistics);
        *self = Self {
            before_um,
            after_um,
            before_urad,
            after_urad,
            ..*self
        };
    }
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CheckResult {
    /// Lines of both programs.
    pub lines: [u64; 2],
    /// Motions of both programs.
    pub motions: [u64; 2],
    /// The largest distance from the corrected path (µm), but for rapids whose start is not known; and its line.
    pub off_um: f64,
    /// Line in the program.
    pub off_line: u64,
    /// How much farther (µm) than allowed the worst place is: than the tolerance, and on chords of an arc than their
    /// sagitta more; 0 if none is.
    pub excess_um: f64,
    /// Line in the program.
    pub excess_line: u64,
    /// The largest angle of a rotary axis from the corrected path (µrad).
    pub off_urad: f64,
    /// The largest distance (µm) of a place in a hole of a cycle that stays one from its corrected place; and its line.
    pub hole_um: f64,
    /// Line in the program.
    pub hole_line: u64,
    /// The largest distance (µm) on moves into which the step at a reversal is blended.
    pub blended_um: f64,
    /// Minutes of all feed moves, before and after, but for those per revolution.
    pub minutes: [f64; 2],
    /// Revolutions of the spindle during feed moves per revolution (G95), before and after.
    pub revolutions: [f64; 2],
    /// Motions whose time differs by more than 1 %.
    pub times_differ: u64,
    /// The first of them.
    pub first_time_line: u64,
    /// The largest difference (µm) of the tool's error by a tool length other than that of the machine file, for which
    /// a compensation without length input was made; and its line.
    pub length_um: f64,
    /// Line in the program.
    pub length_line: u64,
    /// Errors of the tool on feed moves, if the machine and its errors are known.
    pub tool_path: Option<ToolPath>,
}

impl CheckResult {
    /// Adds what a motion takes, before (0) or after (1).
    pub(super) fn takes(&mut self, which: usize, rate: Rate, time: f64) {
        match rate {
            Rate::PerRevolution(_) => self.revolutions[which] += time,
            _ => self.minutes[which] += time,
        }
    }

    /// All lines of the program that are named.
    pub(crate) fn places(&mut self) -> impl Iterator<Item = &mut u64> {
        let of_tool = self.tool_path.as_mut().map(|path| &mut path.worst_line);
        let lines = [
            &mut self.off_line,
            &mut self.hole_line,
            &mut self.length_line,
            &mut self.excess_line,
            &mut self.first_time_line,
        ];
        lines.into_iter().chain(of_tool)
    }

    /// Counts what does not take what it took before, within 1 %.
    pub(super) fn compare(&mut self, line: u64, [before, after]: [f64; 2]) {
        if (after - before).abs() > 0.01 * before {
            if self.times_differ == 0 {
                self.first_time_line = line;
            }
            self.times_differ += 1;
        }
    }

    /// True if the check holds: along the path, and in time.
    #[must_use]
    pub fn holds(&self, options: &Options) -> bool {
        let angles = options.angle_rounding();
        let rounding = options.coarsest_rounding() + LEVER * angles;
        let holes = options.hole_tolerance + options.tolerance + rounding;
        self.excess_um == 0.0
            && self.off_urad <= (options.direction + angles) * 1e6
            && self.times_differ == 0
            && self.hole_um <= holes * 1e3
    }
}

/// Why two programs do not belong together.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The program itself.
    #[error("the program: {0}")]
    Program(StreamError),
    /// The corrected program cannot be read.
    #[error("the corrected program: {0}")]
    Corrected(StreamError),
    /// A motion is missing.
    #[error(
        "line {line} of the program: the corrected program does not arrive at the corrected end ({axis} is off by {off:.5})"
    )]
    Lost {
        /// Line of the program.
        line: u64,
        /// The axis that is farthest off.
        axis: char,
        /// By so much (mm, deg).
        off: f64,
    },
    /// The corrected program ends, or jumps, too early.
    #[error("line {0} of the program: the corrected program has nothing for it")]
    Missing(u64),
    /// More lines than belong to the program.
    #[error(
        "the corrected program goes on in line {0} where the program has ended, or its map does"
    )]
    More(u64),
    /// The map cannot be read.
    #[error("the table of corrected lines cannot be read: {0}")]
    Map(std::io::Error),
    /// A line of the corrected program that does something else than the map says.
    #[error("line {0} of the corrected program does not have the intended effect")]
    Unexplained(u64),
    /// A mode that is another one.
    #[error("line {line} of the corrected program: {what} differs from the program")]
    Modes {
        /// Line of the corrected program.
        line: u64,
        /// What differs.
        what: &'static str,
    },
    /// A cycle that is not the one of the program, shifted.
    #[error("line {0} of the program: the hole is not where its correction leads")]
    Hole(u64),
    /// A position that cannot be evaluated.
    #[error("line {0} of the program leads where the compensation cannot follow")]
    Outside(u64),
}
