//! What a corrected program does, read anew and beside the program that it was made from.
//!
//! Nothing that writes is used: both programs are interpreted line by line. What words mean (`interpret`) and what the
//! tables say at a place (`trace`) is the same for both. Motions of the corrected one belong to the motion of the
//! program at whose corrected end they arrive.

mod arriving;
mod part;
mod result;
mod samples;
mod spread;
mod tool;
mod travel;

use super::axes::{COUNT, PerLetter, name};
use super::correct::{Backlash, Options};
use super::interpret::bits;
use super::moves::Rate;
use super::program::{Event, Program, Segment};
use super::state::{Rules, State};
use super::tables::Tables;
use super::tip::Tip;
use super::trace::{Field, Path};
use super::travel_directions::TravelDirections;
use arriving::{ROUNDED, arrives, is_needless, is_tiny, near_in, off, over_hole, stands};
pub use result::{CheckError, CheckResult, ToolPath};
pub use spread::{Spread, Statistics};
use std::f64::consts::TAU;
use std::io::BufRead;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// The real machine: without it, what the tool does is not known.
pub struct Exact<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors.
    pub errors: &'a ErrorModel,
}

/// Both programs beside each other.
struct Check<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    exact: Option<(&'a Exact<'a>, Kinematics<'a>)>,
    options: Options,
    ways: TravelDirections,
    /// The same of all axes, whether tables tell directions apart or not.
    all: [trueaxis::Travel; COUNT],
    found: CheckResult,
    spreads: [Spread; 4],
    /// Where the corrected program is.
    at: PerLetter,
    /// The line of its last motion, if that was one of a cycle.
    cycle: Option<u64>,
    /// What the cycle of a line of the program takes.
    hole: Hole,
    /// False until it has arrived at a corrected position.
    joined: bool,
}

/// What the motions of a line of the program take that belong together if it is a cycle (minutes or revolutions):
/// before, after.
#[derive(Clone, Copy, Default)]
struct Hole {
    line: u64,
    /// True if some of them have no time of their own: over the hole both of their ends are corrected apart.
    is_one: bool,
    takes: [f64; 2],
}

/// A motion of the program, while what was written for it is looked at.
struct Along<'s> {
    field: Field<'s>,
    segment: &'s Segment,
    /// Directions of travel, as far as it has come.
    travel: TravelDirections,
    /// True if steps at reversals are blended into it.
    blends: bool,
    /// True if they may change.
    turns: bool,
    /// The part of the way that it has come.
    last_t: f64,
    /// The parts of the way at which an axis of an arc turns round.
    quarters: Vec<f64>,
    /// The part of the way up to which directions are known from a step at a reversal.
    turned_until: f64,
}

/// Compares a program with its correction.
///
/// # Errors
/// See [`CheckError`].
pub fn check(
    program: impl BufRead,
    corrected: impl BufRead,
    rules: &Rules,
    tables: &Tables<'_>,
    tip: Option<&Tip<'_>>,
    exact: Option<&Exact<'_>>,
    options: Options,
) -> Result<CheckResult, CheckError> {
    let mut before = Program::new(program, rules, tables, tip);
    let mut after = Program::new(corrected, rules, tables, tip);
    let start = State::new(rules).position;
    let kinematics = exact.map(|exact| {
        let kinematics = Kinematics::new(exact.machine, exact.errors);
        (exact, kinematics)
    });
    let mut check = Check {
        rules,
        tables,
        tip,
        exact: kinematics,
        options,
        ways: TravelDirections::new(tables, &start, &rules.setup.travel),
        all: rules.setup.travel,
        found: CheckResult::default(),
        spreads: std::array::from_fn(|_| Spread::default()),
        at: start.at,
        cycle: None,
        hole: Hole::default(),
        joined: false,
    };
    while let Some(event) = before.next_event().map_err(CheckError::Program)? {
        match event {
            Event::Jumped(to) => {
                for axis in bits(tables.axes) {
                    if !to.knows(axis) {
                        check.ways.forget(axis);
                    }
                }
                if let Some(q) = before.axes()
                    && check.axes_turn()
                {
                    check.ways.come_to(tables, &q);
                }
                check.leave_hole(&mut after)?;
                check.pass(&mut after, is_tiny)?;
                match after.next_event().map_err(CheckError::Corrected)? {
                    Some(Event::Jumped(at)) => {
                        check.at = at.at;
                        check.joined = false;
                    }
                    _ => return Err(CheckError::Missing(before.lines())),
                }
            }
            Event::Moved(segment) => check.segment(&segment, &mut after)?,
        }
    }
    check.leave_hole(&mut after)?;
    check.pass(&mut after, |more| is_tiny(more) || over_hole(more))?;
    if let Some(Event::Moved(more)) = after.next_event().map_err(CheckError::Corrected)? {
        return Err(CheckError::More(more.line));
    }
    let mut found = check.found;
    found.lines = [before.lines(), after.lines()];
    if let (Some(path), true) = (&mut found.tool_path, check.exact.is_some()) {
        let [a, b, c, d] = &check.spreads;
        path.before_um = a.statistics();
        path.after_um = b.statistics();
        path.before_urad = c.statistics();
        path.after_urad = d.statistics();
    }
    Ok(found)
}

impl Check<'_> {
    fn segment<R: BufRead>(
        &mut self,
        segment: &Segment,
        after: &mut Program<'_, R>,
    ) -> Result<(), CheckError> {
        self.found.motions[0] += 1;
        if !segment.in_cycle || segment.line != self.hole.line {
            self.leave_hole(after)?;
            self.hole.line = segment.line;
        }
        let field = Field {
            tables: self.tables,
            tip: self.tip.filter(|_| segment.tip),
            length: segment.field_length,
            undo: false,
            keeps_directions: false,
        };
        let lost = |_| CheckError::Outside(segment.line);
        // Directions before the motion, and at its end.
        let ways = self.ways.clone();
        let turns = self.axes_turn();
        let ((first, mut end), others) = self.ends(&field, segment).map_err(lost)?;
        self.ways = first;
        let stands = stands(segment);
        let mut minutes = 0.0;
        let mut along = Along {
            field,
            segment,
            blends: self.options.backlash == Backlash::Blend
                && self.tables.directional != 0
                // Axes of an arc, and those that follow the tip, turn round and back.
                && (matches!(segment.path, Path::Arc(_))
                    || segment.tip
                    || ways.travel != self.ways.travel),
            travel: ways,
            turns,
            last_t: 0.0,
            quarters: travel::quarters(&segment.path),
            turned_until: -1.0,
        };
        let all = self.joined || self.tables.axes & !segment.due == 0;
        // Over a hole, and behind one, the correction may make up for all of a short way.
        let may_be_left_out = stands
            || segment.rate == Rate::Rapid
                && (segment.in_cycle || !self.has_own(segment, after, &end)?);
        let is_near = may_be_left_out && near_in(segment.due, &self.at, &end).is_none();
        // Behind a cycle it has the correction of its bottom.
        let mut joined = all && (is_near || self.cycle.is_none());
        let stand = (&self.at, self.cycle.is_some());
        let mut is_there = is_near || is_needless(segment, after, stand, &end, &self.options)?;
        // Where it ends an arc has been before, a turn ago, or nearly.
        let last_turn = match &segment.path {
            Path::Arc(arc) if segment.whole && arc.sweep.abs() > 0.95 * TAU => {
                1.0 - 0.5 * TAU / arc.sweep.abs()
            }
            _ => 0.0,
        };
        while !is_there {
            let event = after.next_event().map_err(CheckError::Corrected)?;
            let Some(Event::Moved(written)) = event else {
                let line = segment.line;
                return Err(match near_in(segment.due, &self.at, &end) {
                    Some((axis, off)) => CheckError::Lost {
                        line,
                        axis: name(axis),
                        off,
                    },
                    None => CheckError::Missing(line),
                });
            };
            self.found.motions[1] += 1;
            let due = segment.due | written.due;
            if self.tables.axes & !due != 0 {
                // A rapid on which axes stay uncorrected that nobody has commanded.
                self.joined = false;
            }
            let is_take_up = self.samples(&mut along, &written).map_err(lost)?;
            let took = written.minutes(self.rules.dialect);
            self.found.takes(1, written.rate, took);
            self.hole.takes[1] += took;
            self.hole.is_one |= written.above && over_hole(&written);
            self.at = written.to();
            self.cycle = Some(written.line).filter(|_| written.in_cycle);
            joined = !written.in_cycle && self.tables.axes & !due == 0;
            let reached = |end: &PerLetter| {
                arrives(segment, &written, &self.at, end, &self.options)
                    && along.last_t >= last_turn
            };
            is_there = reached(&end);
            if let (false, Some((ways, other))) =
                (is_there, others.iter().find(|(_, end)| reached(end)))
            {
                (self.ways, end, is_there) = (ways.clone(), *other, true);
            }
            if is_there || !is_take_up {
                minutes += took;
            }
        }
        // What leads away from there is a step at the next reversal, as short, or a motion of its own.
        self.pass(after, |more| {
            let [from, to] = [0.0, 1.0].map(|t| off(segment.due, &more.path.at(t), &end));
            is_tiny(more) && (to <= from || to <= ROUNDED)
        })?;
        self.joined = joined;
        if segment.rate != Rate::Rapid {
            let planned = segment.minutes(self.rules.dialect);
            self.found.takes(0, segment.rate, planned);
            self.hole.takes[0] += planned;
            // A motion that is shorter than the last digit that is written has no time of its own. One over a hole that
            // is as short as corrections differ counts with the rest of its cycle.
            if over_hole(segment) {
                self.hole.is_one = true;
            } else if !stands {
                self.found.compare(segment.line, [planned, minutes]);
            }
        }
        Ok(())
    }

    /// Passes what the last cycle still does over its hole, where the program has no motion, and compares what all of it
    /// takes.
    fn leave_hole<R: BufRead>(&mut self, after: &mut Program<'_, R>) -> Result<(), CheckError> {
        let line = self.cycle;
        self.pass(after, |next| over_hole(next) && line == Some(next.line))?;
        let hole = std::mem::take(&mut self.hole);
        if hole.is_one {
            self.found.compare(hole.line, hole.takes);
        }
        Ok(())
    }

    /// True if the next motion that is written arrives where one of the program does.
    fn has_own<R: BufRead>(
        &self,
        segment: &Segment,
        after: &mut Program<'_, R>,
        end: &PerLetter,
    ) -> Result<bool, CheckError> {
        let next = after.peek().map_err(CheckError::Corrected)?;
        Ok(match next {
            Some(Event::Moved(next)) => arrives(segment, &next, &next.to(), end, &self.options),
            _ => false,
        })
    }

    /// Passes what is written and belongs to no motion of the program.
    fn pass<R: BufRead>(
        &mut self,
        after: &mut Program<'_, R>,
        is_none: impl Fn(&Segment) -> bool,
    ) -> Result<(), CheckError> {
        while let Some(Event::Moved(next)) = after.peek().map_err(CheckError::Corrected)? {
            if !is_none(&next) {
                break;
            }
            after.next_event().map_err(CheckError::Corrected)?;
            self.found.motions[1] += 1;
            let took = next.minutes(self.rules.dialect);
            self.found.takes(1, next.rate, took);
            self.hole.takes[1] += took;
            self.hole.is_one |= next.above && over_hole(&next);
            self.at = next.to();
            self.cycle = Some(next.line).filter(|_| next.in_cycle);
        }
        Ok(())
    }
}
