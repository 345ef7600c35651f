//! A motion that was written, beside the corrected path.

use super::arriving::{NEAR, is_before_cycle, near, over_hole};
use super::{Along, Check};
use crate::gcode::axes::{COUNT, PerLetter, is_rotary};
use crate::gcode::moves::Rate;
use crate::gcode::program::Segment;
use crate::gcode::trace::{Lost, Node, Path};
use crate::gcode::travel_directions::TravelDirections;
use std::f64::consts::TAU;

/// How far along the path a step at a reversal may seem to go (mm): what the last digits of words do.
const NOWHERE: f64 = 5e-4;
/// How far behind a reversal axes are looked at, until one has turned round (mm, degrees): ever farther, for an axis may
/// follow slowly, or turn round again.
const BEYOND: f64 = 0.01;
const FARTHER: f64 = 1.3;
/// So often is a part of the way halved until no more than one axis turns round in it.
const HALVINGS: u32 = 16;
/// A step at a reversal is shorter (mm and degrees).
const STEP: f64 = 2.0;
/// A step that goes no farther along the path, in parts of its length, is one.
const SURELY: f64 = 0.1;
/// How far a step may end beside its place, along the path, in parts of the tolerance.
const ALONG: f64 = 0.2;
/// The same in parts of the step.
const OF_STEP: f64 = 0.25;
/// Corrections are smaller (mm and degrees, of all axes together).
const LARGEST: f64 = 5.0;
/// Samples of a segment, at most, if no turn of it has less.
const SAMPLES: usize = 200;
/// Samples of a turn, at least: which turn a place belongs to is told by the one before.
const OF_A_TURN: f64 = 16.0;

impl Check<'_> {
    /// Looks along a motion that was written; true if it is a step at a reversal, or onto the corrected path.
    pub(super) fn samples(
        &mut self,
        along: &mut Along<'_>,
        written: &Segment,
    ) -> Result<bool, Lost> {
        let by = written.path.by();
        let length =
            (0..3).map(|i| by[i].abs()).sum::<f64>() + (3..6).map(|i| by[i].abs()).sum::<f64>();
        let arc = match written.path {
            Path::Arc(arc) => arc.length(),
            Path::Line(..) => 0.0,
        };
        if !along.segment.whole {
            return Ok(false);
        }
        if length < LARGEST && is_before_cycle(along.segment, written) {
            return Ok(true);
        }
        let is_rapid = along.segment.in_cycle && along.segment.rate == Rate::Rapid;
        if over_hole(written) && !is_rapid {
            // To the R of this hole from that of the one before, or to its place: nothing of the path.
            return Ok(true);
        }
        if !self.joined && !written.in_cycle {
            // From where the machine stands, uncorrected, to the corrected path, or to a corrected end.
            let is_step = matches!(written.path, Path::Line(..)) && length < LARGEST;
            let begin = along
                .field
                .node(0.0, &along.segment.path.at(0.0), &along.travel)?;
            if is_step && near(&written.to(), &begin.to).is_none() {
                self.joined = along.segment.rate != Rate::Rapid;
                return Ok(true);
            }
            if is_step && along.segment.in_cycle && written.rate == Rate::Rapid {
                // Axes that the cycle does not move, before it goes to the place of the hole.
                return Ok(true);
            }
            if along.segment.rate == Rate::Rapid {
                return Ok(false);
            }
            self.joined = true;
        }
        let is_short = matches!(written.path, Path::Line(..)) && length < STEP;
        if is_short && self.is_take_up(along, written, length)? {
            return Ok(true);
        }
        let turns = match written.path {
            Path::Arc(arc) => arc.sweep.abs() / TAU,
            Path::Line(..) => 0.0,
        };
        let least = ((turns * OF_A_TURN).ceil() as usize).max(4);
        let count = ((length + arc).ceil() as usize * 2).min(SAMPLES).max(least);
        for k in 0..=count {
            let at = written.path.at(k as f64 / count as f64);
            self.sample(along, written, &at)?;
        }
        Ok(false)
    }

    /// True if a short motion is a step at a reversal: it goes nowhere on the path, if the axes go the other way from
    /// there on. Those that follow slowly turn round later, maybe with a step of their own.
    fn is_take_up(
        &self,
        along: &mut Along<'_>,
        written: &Segment,
        length: f64,
    ) -> Result<bool, Lost> {
        if self.tables.directional == 0 || !along.turns || !self.options.backlash.is_apart() {
            return Ok(false);
        }
        let path = &along.segment.path;
        let whole = length_of(path);
        let from = self.part(along, &written.path.at(0.0), &along.travel)?;
        let mut turned = along.travel.clone();
        let (mut beyond, mut ahead, mut last) = (BEYOND, from, from);
        let mut first: Option<(f64, bool, TravelDirections, f64)> = None;
        while ahead < 1.0 {
            ahead = (from + beyond / whole).min(1.0);
            let before = turned.travel;
            let gone = self.turns_one(along, &turned, [last, ahead])?;
            (last, turned) = gone;
            if last < ahead {
                ahead = last;
            } else {
                beyond *= FARTHER;
            }
            // An axis that reversed twice travels in its first direction again, so there is no step.
            if turned.travel == before || turned.travel == along.travel.travel {
                continue;
            }
            let end = written.path.at(1.0);
            let to = self.part(along, &end, &turned)?;
            let there = along.field.node(to, &path.at(to), &turned)?;
            let gone = (to - from).abs() * whole;
            let is_exact = near(&end, &there.to).is_none();
            let is_there =
                is_exact || near(&end, &self.abreast(path, to, &there.to, &end, length)).is_none();
            if gone > 0.5 * length + NOWHERE || !is_there {
                continue;
            }
            match &first {
                // Beside its place only if none is at it.
                Some((_, true, ..)) if !is_exact => {}
                // Of those that turn later, too, all of the step may be one of theirs, none of it the way.
                Some((by, exact, ..)) if *exact == is_exact && gone > 0.1 * by => {}
                _ => first = Some((gone, is_exact, turned.clone(), ahead)),
            }
            if is_exact && gone <= SURELY * length {
                break;
            }
        }
        let Some((_, _, turned, ahead)) = first else {
            return Ok(false);
        };
        along.travel = turned;
        along.turned_until = ahead;
        Ok(true)
    }

    /// A corrected place, moved along the path to where it is next to another one, by parts of the tolerance and of the
    /// step at most: the part of the way at which that belongs is known to the last digits of words.
    fn abreast(
        &self,
        path: &Path,
        t: f64,
        there: &PerLetter,
        at: &PerLetter,
        length: f64,
    ) -> PerLetter {
        let (low, high) = ((t - 1e-6).max(0.0), (t + 1e-6).min(1.0));
        let (low, high) = (path.at(low), path.at(high));
        let (mut dot, mut square) = (0.0, 0.0);
        for i in 0..COUNT {
            let way = high[i] - low[i];
            dot += way * (at[i] - there[i]);
            square += way * way;
        }
        let by = if square > 0.0 { dot / square } else { 0.0 };
        if by.abs() * square.sqrt() > (ALONG * self.options.tolerance).min(OF_STEP * length) {
            return *there;
        }
        std::array::from_fn(|i| there[i] + by * (high[i] - low[i]))
    }

    /// Directions at a part of the way, or before it such that no more than one axis has turned round: steps of several
    /// may stand one behind the other.
    fn turns_one(
        &self,
        along: &Along<'_>,
        before: &TravelDirections,
        [last, mut ahead]: [f64; 2],
    ) -> Result<(f64, TravelDirections), Lost> {
        let mut halvings = 0;
        loop {
            let mut turned = before.clone();
            along.goes(self.tables, &mut turned, [last, ahead])?;
            let pairs = turned.travel.iter().zip(&before.travel);
            // Those that turn together have one step.
            if pairs.filter(|(now, before)| now != before).count() < 2 || halvings == HALVINGS {
                return Ok((ahead, turned));
            }
            ahead = 0.5 * (last + ahead);
            halvings += 1;
        }
    }

    /// True if an axis turns round at a part of the way, and not well before it: by the way, or by how far it has come
    /// back, for one that follows slowly.
    fn turns_here(
        &self,
        along: &Along<'_>,
        before: &TravelDirections,
        [came_from, t]: [f64; 2],
    ) -> Result<bool, Lost> {
        let path = &along.segment.path;
        let mut barely = before.clone().rounded_by(NEAR);
        barely.come_to(self.tables, &along.field.axes(&path.at(t))?);
        if barely.travel == before.travel {
            return Ok(true);
        }
        // Not before it came there: on a small circle an axis would turn round on the way back.
        let earlier = (t - BEYOND / length_of(path)).max(came_from);
        let mut ways = before.clone();
        ways.come_to(self.tables, &along.field.axes(&path.at(earlier))?);
        Ok(ways.travel == before.travel)
    }

    /// Looks at a place of a motion that was written.
    fn sample(
        &mut self,
        along: &mut Along<'_>,
        written: &Segment,
        at: &PerLetter,
    ) -> Result<(), Lost> {
        let t = self.part(along, at, &along.travel)?;
        let came_from = along.last_t;
        along.last_t = t.max(along.last_t);
        let command = along.segment.path.at(t);
        let before = along.travel.clone();
        if along.turns && t > along.turned_until {
            let mut ways = along.travel.clone();
            along.goes(self.tables, &mut ways, [came_from.min(t), t])?;
            along.travel = ways;
        }
        let mut node = along.field.node(t, &command, &along.travel)?;
        if along.travel.travel != before.travel
            && self.turns_here(along, &before, [came_from.min(t), t])?
        {
            // On which side of the step it is the last digit of a word tells.
            let unturned = along.field.node(t, &command, &before)?;
            let off = |node: &Node| -> f64 {
                let off = at.iter().zip(&node.to);
                off.map(|(at, to)| (at - to).powi(2)).sum()
            };
            if off(&unturned) < off(&node) {
                (along.travel, node) = (before, unturned);
            }
        }
        let segment = along.segment;
        if written.in_cycle && (segment.rate == Rate::Rapid || segment.above) {
            return Ok(());
        }
        let (mut linear, mut rotary) = (0.0, 0.0_f64);
        for (i, (at, to)) in at.iter().zip(&node.to).enumerate() {
            let off = at - to;
            if is_rotary(i) {
                rotary += off.to_radians().powi(2);
            } else {
                linear += off * off;
            }
        }
        let um = linear.sqrt() * 1e3;
        if segment.cutter {
            // Corrected ends, and what lies between them as it comes: the report says how far off.
        } else if along.blends {
            self.found.blended_um = self.found.blended_um.max(um);
        } else {
            if um > self.found.off_um {
                self.found.off_um = um;
                self.found.off_line = segment.line;
            }
            let is_chord =
                matches!(segment.path, Path::Arc(_)) && matches!(written.path, Path::Line(..));
            let chord = if is_chord { self.options.chord } else { 0.0 };
            let excess = um - (self.options.tolerance + chord) * 1e3;
            if excess > self.found.excess_um {
                self.found.excess_um = excess;
                self.found.excess_line = segment.line;
            }
            self.found.off_urad = self.found.off_urad.max(rotary.sqrt() * 1e6);
        }
        if segment.rate != Rate::Rapid {
            self.head(&along.field, segment, t)?;
            self.tool(along, &node.q, at)?;
        }
        Ok(())
    }
}

/// How long a path is (mm, and degrees as if they were).
fn length_of(path: &Path) -> f64 {
    match path {
        Path::Arc(arc) => arc.length(),
        Path::Line(..) => path.by().iter().map(|d| d.abs()).sum(),
    }
}
