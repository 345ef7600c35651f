//! What a corrected program does, read anew beside the program that it was made from.
//!
//! The writer says which of its lines came from which line of the program ([`super::line_map`]). Here both are interpreted
//! again, line by line, and each motion is held against the corrected path that follows from the program and the tables:
//! where it ends, how far it is off on the way, how long it takes, and what holds after it. A line that the map does not
//! explain is an error.

mod along;
mod hole;
mod play;
mod result;
mod spread;
mod tool;

use super::axes::{COUNT, PerLetter, Position, name};
use super::correct::{Backlash, Options};
use super::interpret::{Step, bits};
use super::line_map::{LineMap, Role};
use super::moves::{Move, Rate};
use super::program::{Reading, Segment};
use super::state::{Rules, State};
use super::tables::Tables;
use super::tip::Tip;
use super::travel_directions::TravelDirections;
use along::Along;
use play::Play;
pub use result::{CheckError, CheckResult, ToolPath};
pub use spread::{Spread, Statistics};
use std::io::{BufRead, Read};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// The real machine: without it, what the tool does is not known.
pub struct Exact<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Errors of the real machine.
    pub errors: &'a ErrorModel,
}

/// A corrected program, and what its lines are.
pub struct Corrected<T, M> {
    /// Text of the corrected program.
    pub text: T,
    /// The map that its writer made.
    pub map: M,
}

/// How far from its place an axis may end, in last digits of its words: an axis without a word is one of them off, and a
/// half goes with each rounding.
const NEAR: f64 = 1.6;

struct Check<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    exact: Option<(&'a Exact<'a>, Kinematics<'a>)>,
    options: Options,
    /// The last digits of words.
    last_digits: PerLetter,
    ways: TravelDirections,
    /// Where the machine stands in its lost motion, by what is written.
    play: Play,
    /// The directions of all axes, whether tables tell them apart or not.
    all: [trueaxis::Travel; COUNT],
    /// Where the program was before the line.
    position: Position,
    found: CheckResult,
    spreads: [Spread; 4],
}

/// Compares a program with its correction.
///
/// # Errors
/// See [`CheckError`].
pub fn check(
    program: impl BufRead,
    corrected: Corrected<impl BufRead, impl Read>,
    rules: &Rules,
    tables: &Tables<'_>,
    tip: Option<&Tip<'_>>,
    exact: Option<&Exact<'_>>,
    options: Options,
) -> Result<CheckResult, CheckError> {
    let mut before = Reading::new(program, rules, tables, tip);
    let mut after = Reading::new(corrected.text, rules, tables, tip);
    let mut map = LineMap::new(corrected.map).map_err(CheckError::Map)?;
    let mut check = Check {
        rules,
        tables,
        tip,
        exact: exact.map(|exact| (exact, Kinematics::new(exact.machine, exact.errors))),
        options,
        last_digits: options.resolutions(),
        ways: TravelDirections::new(tables, &State::new(rules).position, &rules.setup.travel),
        play: Play::new(),
        all: rules.setup.travel,
        position: before.state.position,
        found: CheckResult::default(),
        spreads: std::array::from_fn(|_| Spread::default()),
    };
    let mut roles = Vec::new();
    while let Some(step) = before.next_step().map_err(CheckError::Program)? {
        map.group(&mut roles).map_err(CheckError::Map)?;
        check.line(&before, &step, &roles, &mut after)?;
        check.position = before.state.position;
    }
    if after.next_step().map_err(CheckError::Corrected)?.is_some() || !map.is_at_end() {
        return Err(CheckError::More(after.number()));
    }
    Ok(check.result([before.number(), after.number()]))
}

impl Check<'_> {
    /// All that was found, in so many lines of both programs.
    fn result(self, lines: [u64; 2]) -> CheckResult {
        let mut found = self.found;
        found.lines = lines;
        if let Some(path) = &mut found.tool_path {
            path.sum_up(&self.spreads);
        }
        found
    }

    /// A line of the program, and the lines that were written for it.
    fn line<R: BufRead, S: BufRead>(
        &mut self,
        before: &Reading<'_, R>,
        step: &Step,
        roles: &[Role],
        after: &mut Reading<'_, S>,
    ) -> Result<(), CheckError> {
        if roles.is_empty() {
            return Err(CheckError::Missing(before.number()));
        }
        match &step.motion {
            Some(motion) => self.motion(before, motion, roles, after)?,
            None => {
                let mut passed = None;
                for role in roles {
                    let written = read(before.number(), after)?;
                    if *role != Role::Plain || written.motion.is_some() {
                        return Err(CheckError::Unexplained(after.number()));
                    }
                    passed = passed.or(written.passed);
                }
                if passed != step.passed {
                    return Err(CheckError::Unexplained(after.number()));
                }
                self.passes(step, &before.state);
            }
        }
        let differs = differs(&before.state, &after.state);
        let differs = differs.or_else(|| self.reference(step, &before.state, &after.state));
        match differs {
            None => Ok(()),
            Some(what) => Err(CheckError::Modes {
                line: after.number(),
                what,
            }),
        }
    }

    /// What passes without correction takes directions along, where it is known where it leads.
    fn passes(&mut self, step: &Step, state: &State) {
        if step.passed.is_none() {
            return;
        }
        for axis in bits(self.tables.axes).filter(|axis| !state.position.knows(*axis)) {
            self.ways.forget(axis);
        }
        let moved = state.position != self.position;
        if moved && state.position.missing(self.tables.axes).is_none() && self.axes_turn() {
            self.ways.come_to(self.tables, &state.position.at);
        }
    }

    /// G92 and G10 L20: words mean the same places in both programs.
    fn reference(&self, step: &Step, before: &State, after: &State) -> Option<&'static str> {
        step.reference?;
        let [a, b] = [before, after].map(|state| state.offsets.program(&before.position.at));
        let last = self.last_digits;
        let known = bits(self.tables.axes & before.position.known);
        let mut off = known.map(|i| (a[i] - b[i]).abs() / last[i]);
        off.any(|off| off > NEAR).then_some("offsets")
    }

    /// A motion of the program, and the lines that were written for it.
    fn motion<R: BufRead, S: BufRead>(
        &mut self,
        before: &Reading<'_, R>,
        motion: &Move,
        roles: &[Role],
        after: &mut Reading<'_, S>,
    ) -> Result<(), CheckError> {
        let segments = before.segments(motion);
        self.found.motions[0] += 1;
        let mut along: Option<Along<'_>> = None;
        let mut holes = 0;
        for role in roles {
            let from = after.state.position.at;
            let written = read(before.number(), after)?;
            // Words that would have led nowhere are not written.
            let Some(written) = &written.motion else {
                continue;
            };
            self.found.motions[1] += 1;
            if along.is_none() && leads_to_cycle(motion, *role, written) {
                continue;
            }
            if let Move::Cycle(cycle) = written {
                let (Move::Cycle(planned), Role::Until(until)) = (motion, role) else {
                    return Err(CheckError::Unexplained(after.number()));
                };
                let until = *until as usize;
                self.holes(before, planned, cycle, [holes, until])?;
                // All holes of the line are in its segments, and may be written as several cycles.
                if holes == 0 {
                    self.takes(0, cycle.rate, &segments);
                }
                self.takes(1, cycle.rate, &after.segments(written));
                holes = until;
                continue;
            }
            let along = match &mut along {
                Some(along) => along,
                None => along.insert(Along::new(self, &segments)?),
            };
            let segment = after.segments(written)[0];
            match role {
                Role::Plain => return Err(CheckError::Unexplained(after.number())),
                Role::Step => self.step(along, &segment)?,
                Role::Until(until) => self.piece(along, &from, &segment, *until)?,
            }
        }
        if holes > 0 {
            return match motion {
                Move::Cycle(cycle) if holes == cycle.repeat as usize => Ok(()),
                _ => Err(CheckError::Missing(before.number())),
            };
        }
        let mut along = match along {
            Some(along) => along,
            None => Along::new(self, &segments)?,
        };
        self.finish(&mut along, &after.state)?;
        match motion {
            Move::Straight(straight, _) if straight.comes_back => self.comes_back(before, &along),
            _ => Ok(()),
        }
    }

    /// Counts the time of the motions of a cycle, before (0) or after (1).
    fn takes(&mut self, which: usize, rate: Rate, segments: &[Segment]) {
        let parts = segments.iter();
        let minutes = parts.map(|s| s.minutes(self.rules.dialect)).sum();
        self.found.takes(which, rate, minutes);
    }

    /// A thread ends where it began.
    fn comes_back<R: BufRead>(
        &mut self,
        before: &Reading<'_, R>,
        along: &Along<'_>,
    ) -> Result<(), CheckError> {
        if self.axes_turn() {
            let back = along.field.axes(&before.state.position.at);
            let back = back.map_err(|_| CheckError::Outside(before.number()))?;
            self.ways.come_to(self.tables, &along.field.middle(&back));
        }
        Ok(())
    }

    /// False where directions stay what they are, whichever way axes go: reversals are left out.
    fn axes_turn(&self) -> bool {
        self.options.backlash != Backlash::Leave || self.ways.missing(self.tables).is_some()
    }
}

/// True for a move before a cycle of axes that the cycle does not move.
fn leads_to_cycle(motion: &Move, role: Role, written: &Move) -> bool {
    match (motion, role, written) {
        (Move::Cycle(cycle), Role::Step, Move::Straight(straight, _)) => {
            straight.is_outside(&cycle.axes)
        }
        _ => false,
    }
}

/// The next line of the corrected program, which must be there.
fn read<R: BufRead>(line: u64, after: &mut Reading<'_, R>) -> Result<Step, CheckError> {
    let step = after.next_step().map_err(CheckError::Corrected)?;
    step.ok_or(CheckError::Missing(line))
}

/// What holds after a line of the program and not after what was written for it.
fn differs(before: &State, after: &State) -> Option<&'static str> {
    let pairs = [
        (before.units == after.units, "units"),
        (before.distance == after.distance, "G90 or G91"),
        (before.arc_distance == after.arc_distance, "G90.1 or G91.1"),
        (before.plane == after.plane, "the plane"),
        (before.feed_mode == after.feed_mode, "the mode of the feed"),
        (before.cutter == after.cutter, "cutter compensation"),
        (before.retract == after.retract, "G98 or G99"),
        (before.tip == after.tip, "tool-centre-point control"),
        (before.extruder.agrees(&after.extruder), "what is extruded"),
        (before.spindle == after.spindle, "the spindle"),
        (before.tool == after.tool, "the tool"),
        (before.next_tool == after.next_tool, "the next tool"),
        (before.length == after.length, "the length of the tool"),
        (before.offsets.tool == after.offsets.tool, "the tool offset"),
        (
            before.offsets.selected() == after.offsets.selected(),
            "the coordinate system",
        ),
        (
            before.position.known == after.position.known,
            "what positions are known",
        ),
        (before.ended == after.ended, "the end of the program"),
    ];
    pairs
        .into_iter()
        .find(|(same, _)| !same)
        .map(|(_, what)| what)
}

/// The axis that is farthest from its place, and by how much (mm, degrees), if that is too far.
fn lost(due: u16, at: &PerLetter, end: &PerLetter, last: &PerLetter) -> Option<(usize, f64)> {
    let off = bits(due).map(|i| (i, (at[i] - end[i]).abs()));
    off.filter(|(i, off)| *off > NEAR * last[*i])
        .max_by(|a, b| a.1.total_cmp(&b.1))
}
