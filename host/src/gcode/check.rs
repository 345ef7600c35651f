//! What a corrected program does, read anew and beside the program that it was made from.
//!
//! Nothing of the writer is used: both programs are interpreted line by line. Motions of the corrected one belong to
//! the motion of the program at whose corrected end they arrive.

mod spread;

use super::axes::{COUNT, PerLetter, is_rotary};
use super::correct::{Backlash, Options};
use super::moves::Rate;
use super::program::{Event, Program, Segment};
use super::state::Rules;
use super::stream::StreamError;
use super::tables::{Tables, Ways};
use super::tip::Tip;
use super::trace::{Field, Path};
use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Htm, Kinematics};
use crate::machine::{Machine, PerAxis};
use serde::Serialize;
pub use spread::{Spread, Statistics};
use std::f64::consts::FRAC_PI_2;
use std::io::BufRead;

/// The real machine: without it, what the tool does is not known.
pub struct Exact<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors.
    pub errors: &'a ErrorModel,
}

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
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Found {
    /// Lines of both programs.
    pub lines: [u64; 2],
    /// Motions of both programs.
    pub motions: [u64; 2],
    /// The largest distance from the corrected path (µm), but for rapids whose start is not known; and its line.
    pub off_um: f64,
    /// Its line in the program.
    pub off_line: u64,
    /// The largest angle of a rotary axis from the corrected path (µrad).
    pub off_urad: f64,
    /// Minutes of all feed moves, before and after.
    pub minutes: [f64; 2],
    /// Motions whose time differs by more than 1 %.
    pub times_differ: u64,
    /// The first of them.
    pub first_time_line: u64,
    /// Errors of the tool on feed moves, if the machine and its errors are known.
    pub tool_path: Option<ToolPath>,
}

/// Why two programs do not belong together.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The program itself.
    #[error("the program: {0}")]
    Program(StreamError),
    /// The corrected one is no program.
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
    /// More motions than belong to the program.
    #[error("the corrected program goes on in line {0} where the program has ended")]
    More(u64),
    /// A position that cannot be evaluated.
    #[error("line {0} of the program leads where the compensation cannot follow")]
    Outside(u64),
}

/// How near it must arrive: half of the last digit that is written, of all axes together (mm, degrees).
const NEAR: [f64; 2] = [1.5e-4, 2e-5];
/// How far along the path a step at a reversal may seem to go (mm): what the last digits of words do.
const NOWHERE: f64 = 2e-3;
/// How far behind a reversal axes are looked at, until one has turned round (mm, degrees): ever farther, for an axis may
/// follow slowly, or turn round again.
const BEYOND: f64 = 0.01;
const FARTHER: f64 = 1.3;
/// A step at a reversal, or onto the corrected path, is shorter (mm and degrees).
const STEP: f64 = 0.2;
/// Samples of a segment, at most.
const SAMPLES: usize = 200;

/// Both programs beside each other.
struct Check<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    exact: Option<(&'a Exact<'a>, Kinematics<'a>)>,
    options: Options,
    ways: Ways,
    all: [trueaxis::Travel; COUNT],
    found: Found,
    spreads: [Spread; 4],
    /// Where the corrected program is.
    at: PerLetter,
    /// False until it has arrived at a corrected position.
    joined: bool,
    /// The part of the way up to which directions are known from a step at a reversal.
    turned_until: f64,
    /// True behind a cycle, whose end has the correction of its bottom.
    over_hole: bool,
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
) -> Result<Found, CheckError> {
    let mut before = Program::new(program, rules, tables, tip);
    let mut after = Program::new(corrected, rules, tables, tip);
    let start = super::state::State::new(rules).position;
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
        ways: Ways::new(tables, &start, &rules.setup.travel),
        all: rules.setup.travel,
        found: Found::default(),
        spreads: std::array::from_fn(|_| Spread::default()),
        at: start.at,
        joined: false,
        turned_until: -1.0,
        over_hole: false,
    };
    while let Some(event) = before.next_event().map_err(CheckError::Program)? {
        match event {
            Event::Jumped(to) => {
                for axis in super::interpret::bits(tables.axes) {
                    if !to.knows(axis) {
                        check.ways.forget(axis);
                    }
                }
                match after.next_event().map_err(CheckError::Corrected)? {
                    Some(Event::Jumped(at)) => {
                        check.at = at.at;
                        check.joined = false;
                    }
                    _ => {
                        return Err(CheckError::Lost {
                            line: before.lines(),
                            axis: '?',
                            off: 0.0,
                        });
                    }
                }
            }
            Event::Moved(segment) => check.segment(&segment, &mut after)?,
        }
    }
    check.pass_tiny(&mut after)?;
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
        let field = Field {
            tables: self.tables,
            tip: self.tip.filter(|_| segment.tip),
            length: segment.length.filter(|_| self.tables.takes_length),
            undo: false,
        };
        let lost = |_| CheckError::Outside(segment.line);
        // Directions before the motion, and at its end.
        let ways = self.ways.clone();
        self.follow(&field, segment).map_err(lost)?;
        let end = field.node(1.0, &segment.to(), &self.ways).map_err(lost)?.to;
        let by = segment.path.by();
        let stands = matches!(segment.path, Path::Line(..))
            && (0..COUNT).all(|i| by[i].abs() < NEAR[usize::from(is_rotary(i))]);
        let mut minutes = 0.0;
        let mut travel = ways;
        self.turned_until = -1.0;
        let mut last_t = 0.0;
        let mut in_cycle = false;
        let mut is_there = stands && near(&self.at, &end).is_none();
        // Where it ends a full turn has been before.
        let turns = matches!(segment.path, Path::Arc(_)) && segment.whole && self.joined;
        let turns = turns && near(&segment.path.at(0.0), &segment.to()).is_none();
        while !is_there {
            let event = after.next_event().map_err(CheckError::Corrected)?;
            let Some(Event::Moved(written)) = event else {
                let (axis, off) = near(&self.at, &end).unwrap_or((0, 0.0));
                return Err(CheckError::Lost {
                    line: segment.line,
                    axis: super::axes::name(axis),
                    off,
                });
            };
            self.found.motions[1] += 1;
            let is_take_up = self
                .samples(&field, segment, &written, &mut travel, &mut last_t)
                .map_err(lost)?;
            let took = written.minutes(self.rules.dialect);
            self.found.minutes[1] += took;
            self.at = written.to();
            in_cycle = written.in_cycle;
            is_there = arrives(segment, &written, &self.at, &end, &self.options)
                && !(turns && last_t < 0.5);
            if is_there || !is_take_up {
                minutes += took;
            }
        }
        self.over_hole = in_cycle;
        self.pass_tiny(after)?;
        self.joined = true;
        if segment.rate != Rate::Rapid {
            let planned = segment.minutes(self.rules.dialect);
            self.found.minutes[0] += planned;
            // A motion that is shorter than the last digit that is written has no time of its own.
            if (minutes - planned).abs() > 0.01 * planned && !stands {
                if self.found.times_differ == 0 {
                    self.found.first_time_line = segment.line;
                }
                self.found.times_differ += 1;
            }
        }
        Ok(())
    }

    /// Passes what is written only because words are rounded: it goes no farther than their last digits.
    fn pass_tiny<R: BufRead>(&mut self, after: &mut Program<'_, R>) -> Result<(), CheckError> {
        while let Some(Event::Moved(next)) = after.peek().map_err(CheckError::Corrected)? {
            let tiny = matches!(next.path, Path::Line(..))
                && near(&next.path.at(0.0), &next.to()).is_none();
            if !tiny {
                break;
            }
            after.next_event().map_err(CheckError::Corrected)?;
            self.found.motions[1] += 1;
            self.found.minutes[1] += next.minutes(self.rules.dialect);
            self.at = next.to();
        }
        Ok(())
    }

    /// Takes the directions of travel along.
    fn follow(&mut self, field: &Field<'_>, segment: &Segment) -> Result<(), super::trace::Lost> {
        let before = self.ways.clone();
        let steps = match segment.path {
            Path::Line(..) if field.tip.is_none() => 1,
            _ => 64,
        };
        let mut parts: Vec<f64> = (1..=steps).map(|k| k as f64 / steps as f64).collect();
        if let Path::Arc(arc) = segment.path {
            // Where an axis of the plane turns round: at every quarter.
            let [i, j, _] = arc.axes;
            let start = (arc.from[j] - arc.centre[1]).atan2(arc.from[i] - arc.centre[0]);
            let quarters = (arc.sweep.abs() / FRAC_PI_2) as i32 + 4;
            let turns =
                (-quarters..=quarters).map(|k| (f64::from(k) * FRAC_PI_2 - start) / arc.sweep);
            parts.extend(turns.filter(|t| *t > 0.0 && *t < 1.0));
            parts.sort_by(f64::total_cmp);
        }
        for t in parts {
            let q = field.axes(&segment.path.at(t))?;
            self.ways.come_to(self.tables, &q);
        }
        if self.options.backlash == Backlash::Leave && before.missing(self.tables).is_none() {
            self.ways = before;
        }
        Ok(())
    }

    /// Looks along a motion that was written; true if it is a step at a reversal, or onto the corrected path.
    fn samples(
        &mut self,
        field: &Field<'_>,
        segment: &Segment,
        written: &Segment,
        travel: &mut Ways,
        last_t: &mut f64,
    ) -> Result<bool, super::trace::Lost> {
        let length = (0..3).map(|i| written.path.by()[i].abs()).sum::<f64>()
            + (3..6).map(|i| written.path.by()[i].abs()).sum::<f64>();
        let arc = match written.path {
            Path::Arc(arc) => arc.length(),
            Path::Line(..) => 0.0,
        };
        if !self.joined {
            // From where the machine stands, uncorrected, to the corrected path.
            return Ok(length + arc < STEP);
        }
        if !segment.whole || (self.over_hole && !written.in_cycle) {
            return Ok(false);
        }
        let count = ((length + arc).ceil() as usize * 2).clamp(4, SAMPLES);
        let whole = match segment.path {
            Path::Arc(arc) => arc.length(),
            Path::Line(..) => segment.path.by().iter().map(|d| d.abs()).sum(),
        };
        let leave = self.options.backlash == Backlash::Leave;
        if self.tables.directional != 0 && !leave && length < STEP {
            // A step at a reversal goes nowhere on the path, if the axes go the other way from there on. Those
            // that follow slowly turn round later, maybe with a step of their own.
            let from = self.part(field, segment, &written.path.at(0.0), travel, *last_t)?;
            let mut turned = travel.clone();
            let (mut beyond, mut ahead) = (BEYOND, from);
            while ahead < 1.0 {
                ahead = (from + beyond / whole).min(1.0);
                beyond *= FARTHER;
                let before = turned.travel;
                turned.come_to(self.tables, &field.axes(&segment.path.at(ahead))?);
                if turned.travel == before {
                    continue;
                }
                let end = written.path.at(1.0);
                let to = self.part(field, segment, &end, &turned, *last_t)?;
                let there = field.node(to, &segment.path.at(to), &turned)?;
                if (to - from).abs() * whole <= 0.5 * length + NOWHERE
                    && near(&end, &there.to).is_none()
                {
                    *travel = turned;
                    self.turned_until = ahead;
                    return Ok(true);
                }
            }
        }
        for k in 0..=count {
            let at = written.path.at(k as f64 / count as f64);
            let t = self.part(field, segment, &at, travel, *last_t)?;
            *last_t = t.max(*last_t);
            let command = segment.path.at(t);
            if !leave && t > self.turned_until {
                let q = field.axes(&command)?;
                travel.come_to(self.tables, &q);
            }
            let node = field.node(t, &command, travel)?;
            let (mut linear, mut rotary) = (0.0, 0.0_f64);
            for (i, (at, to)) in at.iter().zip(&node.to).enumerate() {
                let off = at - to;
                if is_rotary(i) {
                    rotary += off.to_radians().powi(2);
                } else {
                    linear += off * off;
                }
            }
            if written.in_cycle && segment.rate == Rate::Rapid {
                continue;
            }
            let um = linear.sqrt() * 1e3;
            let blended = self.options.backlash == Backlash::Blend && self.tables.directional != 0;
            if um > self.found.off_um && !segment.cutter && !blended {
                self.found.off_um = um;
                self.found.off_line = segment.line;
            }
            if !segment.cutter && !blended {
                self.found.off_urad = self.found.off_urad.max(rotary.sqrt() * 1e6);
            }
            if segment.rate != Rate::Rapid {
                self.head(field, segment, t)?;
                self.tool(field, segment.line, &node.q, &at, travel)?;
            }
        }
        Ok(false)
    }

    /// Which way every axis goes at a part of the way.
    fn head(
        &mut self,
        field: &Field<'_>,
        segment: &Segment,
        t: f64,
    ) -> Result<(), super::trace::Lost> {
        let (from, to) = if t < 0.999 {
            (t, t + 0.001)
        } else {
            (t - 0.001, t)
        };
        let [from, to] = [from, to].map(|t| field.axes(&segment.path.at(t)));
        let (from, to) = (from?, to?);
        for i in 0..COUNT {
            let by = to[i] - from[i];
            if by > 1e-9 {
                self.all[i] = trueaxis::Travel::Positive;
            } else if by < -1e-9 {
                self.all[i] = trueaxis::Travel::Negative;
            }
        }
        Ok(())
    }

    /// The part of the way at which a written position belongs: the nearest, where the tolerances of linear and of
    /// rotary axes count alike. (With a degree for a millimetre, half a micrometre along a short path would seem to be
    /// microradians.)
    fn part(
        &self,
        field: &Field<'_>,
        segment: &Segment,
        at: &PerLetter,
        ways: &Ways,
        last_t: f64,
    ) -> Result<f64, super::trace::Lost> {
        let back = Field {
            undo: true,
            ..*field
        };
        let q = back.node(0.0, at, ways)?.to;
        let degree = self.options.tolerance / self.options.direction.to_degrees();
        let counts: PerLetter = std::array::from_fn(|i| match is_rotary(i) {
            true => degree * degree,
            false => 1.0,
        });
        let t = match &segment.path {
            Path::Line(from, to) => {
                let (mut dot, mut square) = (0.0, 0.0);
                for i in 0..COUNT {
                    dot += counts[i] * (q[i] - from[i]) * (to[i] - from[i]);
                    square += counts[i] * (to[i] - from[i]).powi(2);
                }
                if square > 0.0 { dot / square } else { 1.0 }
            }
            Path::Arc(arc) => {
                let [i, j, _] = arc.axes;
                let angle = |p: &PerLetter| (p[j] - arc.centre[1]).atan2(p[i] - arc.centre[0]);
                let turn = std::f64::consts::TAU / arc.sweep.abs();
                let mut t = (angle(&q) - angle(&arc.from)) / arc.sweep;
                // The turn at which it is next to where it was.
                t += ((last_t - t) / turn).round() * turn;
                if t < last_t - 0.5 * turn.min(1.0) {
                    t += turn;
                }
                t
            }
        };
        // From there to the nearest point of the path: across a steep helix the angle tells little.
        let mut t = t.clamp(0.0, 1.0);
        if let Path::Arc(_) = segment.path {
            for _ in 0..4 {
                let (low, high) = ((t - 1e-6).max(0.0), (t + 1e-6).min(1.0));
                let (a, b, here) = (
                    segment.path.at(low),
                    segment.path.at(high),
                    segment.path.at(t),
                );
                let (mut dot, mut square) = (0.0, 0.0);
                for i in 0..COUNT {
                    let way = (b[i] - a[i]) / (high - low);
                    dot += counts[i] * (q[i] - here[i]) * way;
                    square += counts[i] * way * way;
                }
                t = (t + dot / square).clamp(0.0, 1.0);
            }
        }
        Ok(t)
    }

    /// Errors of the tool where it should be at `q`, uncorrected and at what is written.
    fn tool(
        &mut self,
        field: &Field<'_>,
        line: u64,
        q: &PerLetter,
        at: &PerLetter,
        travel: &Ways,
    ) -> Result<(), super::trace::Lost> {
        let Some((exact, kinematics)) = &self.exact else {
            return Ok(());
        };
        let machine = exact.machine;
        let moved = field.axes(at)?;
        let position = |q: &PerLetter| -> PerAxis {
            let mut position = [0.0; COUNT];
            for (place, axis) in machine.axes.iter().enumerate() {
                let letter = super::axes::index(axis.letter.char() as u8).unwrap_or_default();
                position[place] = axis.within_turn(q[letter]);
            }
            machine.to_kinematic(&position[..machine.axes.len()])
        };
        let mut situation = Situation::default();
        for (place, axis) in machine.axes.iter().enumerate() {
            let letter = super::axes::index(axis.letter.char() as u8).unwrap_or_default();
            // Where tables tell directions apart, both have turned when the hysteresis is passed.
            let way = match self.tables.directional & (1 << letter) {
                0 => self.all[letter],
                _ => travel.travel[letter],
            };
            situation.sign[place] = match way {
                trueaxis::Travel::Positive => 1.0,
                trueaxis::Travel::Negative => -1.0,
                trueaxis::Travel::Unknown => 0.0,
            };
        }
        situation.length = field.length;
        let nominal = kinematics.nominal(&position(q), situation.length);
        let actual = |q: &PerLetter| kinematics.actual(&position(q), &situation, &Switches::ALL);
        let error = |pose: &Htm| {
            let tip = (pose.t - nominal.t).norm() * 1e3;
            let (a, b) = (machine.direction(pose), machine.direction(&nominal));
            let off: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
            (tip, off.sqrt() * 1e6)
        };
        let (before, after) = (error(&actual(q)), error(&actual(&moved)));
        let path = self.found.tool_path.get_or_insert_default();
        if after.0 > self.spreads[1].largest() {
            path.worst_line = line;
        }
        for (spread, value) in self
            .spreads
            .iter_mut()
            .zip([before.0, after.0, before.1, after.1])
        {
            spread.add(value);
        }
        Ok(())
    }
}

/// Whether a written motion ends where one of the program does. A cycle that stays one has the correction of its
/// bottom everywhere: within the tolerance while it feeds, and over the hole as it comes.
fn arrives(
    segment: &Segment,
    written: &Segment,
    at: &PerLetter,
    end: &PerLetter,
    options: &Options,
) -> bool {
    if !(segment.in_cycle && written.in_cycle) {
        return near(at, end).is_none();
    }
    let allowed = match segment.rate {
        Rate::Rapid => OVER_HOLE,
        _ => options.tolerance + 2.0 * NEAR[0],
    };
    (segment.rate == Rate::Rapid) == (written.rate == Rate::Rapid)
        && (0..COUNT).all(|i| (at[i] - end[i]).abs() <= allowed)
}

/// How far a rapid within a cycle may end from its own correction (mm): what corrections may differ over a hole.
const OVER_HOLE: f64 = 0.5;

/// `None` if it is near enough; otherwise the axis that is farthest off, and by how much.
fn near(at: &PerLetter, end: &PerLetter) -> Option<(usize, f64)> {
    let off = (0..COUNT).map(|i| (i, (at[i] - end[i]).abs() / NEAR[usize::from(is_rotary(i))]));
    let (axis, off) = off.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (off > 1.0).then(|| (axis, off * NEAR[usize::from(is_rotary(axis))]))
}
