//! A motion of the program, and what was written for it.

use super::{Backlash, Check, CheckError, lost, name};
use crate::axes::{COUNT, PerLetter, is_rotary};
use crate::cut::across;
use crate::moves::Rate;
use crate::program::Segment;
use crate::state::State;
use crate::trace::{Field, Lost, Node, Path, Stretch, Travels};
use crate::travel_directions::TravelDirections;
use std::f64::consts::TAU;

/// Samples of a piece, at most, if no turn of it has less.
const SAMPLES: usize = 200;
/// How far a place may be along the path from the one that it is held against (mm).
const ALONG: f64 = 1e-5;
/// Samples of a turn, at least.
const OF_A_TURN: f64 = 16.0;

/// A motion of the program while the lines that were written for it are looked at; a cycle that is written out has
/// several.
pub(super) struct Along<'s> {
    segments: &'s [Segment],
    /// Which of them it has come to, and how far along it.
    number: usize,
    part: f64,
    /// What corrects it.
    pub field: Field<'s>,
    /// Stretches between reversals of the motion.
    stretches: Vec<Stretch>,
    /// The directions before it.
    before: Travels,
    /// What the pieces of it take.
    minutes: f64,
}

/// A place of the corrected path, and how far from it a written one is.
struct HeldAgainst {
    node: Node,
    off: PerLetter,
}

/// A stretch of the corrected path that written places are held against.
struct PlannedStretch<'p, 's> {
    field: &'p Field<'s>,
    segment: &'p Segment,
    stretch: Stretch,
}

impl PlannedStretch<'_, '_> {
    /// At a part of the way.
    fn place(&self, t: f64, at: &PerLetter) -> Result<HeldAgainst, CheckError> {
        let segment = self.segment;
        let node = self
            .field
            .node(t, &segment.path.at(t), &self.stretch.travel);
        let node = node.map_err(|_| CheckError::Outside(segment.line))?;
        let off = std::array::from_fn(|i| at[i] - node.to[i]);
        Ok(HeldAgainst { node, off })
    }

    /// Beside the nearest place of the stretch; true if even that is not beside, but behind or before it.
    fn nearest(
        &self,
        place: HeldAgainst,
        at: &PerLetter,
    ) -> Result<(HeldAgainst, bool), CheckError> {
        let t = place.node.t;
        let slope = self.segment.path.slope(t);
        let square: f64 = slope.iter().map(|d| d * d).sum();
        let along = |off: &PerLetter| -> f64 { off.iter().zip(&slope).map(|(o, s)| o * s).sum() };
        let by = along(&place.off);
        let is_apart = |by: f64| by.abs() > ALONG * square.sqrt();
        if !is_apart(by) {
            return Ok((place, false));
        }
        let t = (t + by / square).clamp(self.stretch.from, self.stretch.to);
        let place = self.place(t, at)?;
        let is_beyond = is_apart(along(&place.off));
        Ok((place, is_beyond))
    }
}

impl<'s> Along<'s> {
    /// At the start of the first motion.
    pub fn new<'c: 's>(check: &mut Check<'c>, segments: &'s [Segment]) -> Result<Self, CheckError> {
        let mut along = Self {
            segments,
            number: 0,
            part: 0.0,
            field: check.field_of(&segments[0]),
            stretches: Vec::new(),
            before: check.ways.travel,
            minutes: 0.0,
        };
        along.enter(check)?;
        Ok(along)
    }

    /// The motion that it has come to.
    fn segment(&self) -> Option<&'s Segment> {
        self.segments.get(self.number)
    }

    fn enter<'c: 's>(&mut self, check: &mut Check<'c>) -> Result<(), CheckError> {
        self.part = 0.0;
        self.minutes = 0.0;
        let Some(segment) = self.segment() else {
            return Ok(());
        };
        self.before = check.ways.travel;
        self.field = check.field_of(segment);
        let stretches = match segment.whole {
            true => self.field.stretches(&segment.path, &mut check.ways),
            false => self.arrive(segment, &mut check.ways),
        };
        self.stretches = stretches.map_err(|_| CheckError::Outside(segment.line))?;
        Ok(())
    }

    /// From an unknown place.
    fn arrive(&self, segment: &Segment, ways: &mut TravelDirections) -> Result<Vec<Stretch>, Lost> {
        if self.field.turns {
            let q = self.field.axes(&segment.to())?;
            ways.come_to(self.field.tables, &self.field.middle(&q));
        }
        Ok(vec![Stretch {
            from: 0.0,
            to: 1.0,
            travel: ways.travel,
        }])
    }

    /// The stretch that begins at a part of the way, or goes on there.
    fn stretch_from(&self, t: f64) -> &Stretch {
        let begun = self.stretches.iter().rev();
        let mut begun = begun.filter(|stretch| stretch.from <= t);
        begun.next().unwrap_or(&self.stretches[0])
    }

    /// The corrected place where a part of the way ends.
    fn place(&self, t: f64) -> Result<Node, CheckError> {
        let segment = &self.segments[self.number.min(self.segments.len() - 1)];
        let ending = self.stretches.iter().rev();
        let mut ending = ending.filter(|stretch| stretch.from < t);
        let stretch = ending.next().unwrap_or(&self.stretches[0]);
        let travel = &stretch.travel;
        let node = self.field.node(t, &segment.path.at(t), travel);
        let mut node = node.map_err(|_| CheckError::Outside(segment.line))?;
        if segment.retracts {
            self.field.within_travel(&mut node);
        }
        Ok(node)
    }
}

impl<'c> Check<'c> {
    /// What corrects a motion.
    pub(super) fn field_of(&self, segment: &Segment) -> Field<'c> {
        Field {
            tables: self.tables,
            tip: self.tip.filter(|_| segment.tip),
            length: segment.field_length,
            turns: self.axes_turn(),
        }
    }

    /// A step: it leads to the corrected path where the motion stands.
    pub(super) fn step(
        &mut self,
        along: &mut Along<'_>,
        written: &Segment,
    ) -> Result<(), CheckError> {
        let Some(segment) = along.segment() else {
            return Err(CheckError::Unexplained(written.line));
        };
        if segment.rate == Rate::Rapid || written.rate == Rate::Rapid {
            return Err(CheckError::Unexplained(written.line));
        }
        let t = along.part;
        let travel = along.stretch_from(t).travel;
        let node = along.field.node(t, &segment.path.at(t), &travel);
        let node = node.map_err(|_| CheckError::Outside(segment.line))?;
        self.is_near(u16::MAX, segment, &written.to(), &node.to)?;
        self.plays(&along.field, &written.path);
        self.found
            .takes(1, written.rate, written.minutes(self.rules.dialect));
        Ok(())
    }

    /// What was written for the way up to a part of it.
    pub(super) fn piece<'s>(
        &mut self,
        along: &mut Along<'s>,
        from: &PerLetter,
        written: &Segment,
        until: f64,
    ) -> Result<(), CheckError>
    where
        'c: 's,
    {
        // Motions that are done where the one before ended have no lines.
        while until > (along.number + 1) as f64 {
            self.leave(along, from)?;
        }
        let Some(segment) = along.segment() else {
            return Err(CheckError::Unexplained(written.line));
        };
        let t = until - along.number as f64;
        let is_rapid = segment.rate == Rate::Rapid;
        if is_rapid != (written.rate == Rate::Rapid) || t.is_nan() || t <= along.part || t > 1.0 {
            return Err(CheckError::Unexplained(written.line));
        }
        let is_path = !is_rapid && segment.whole;
        if is_path {
            self.samples(along, segment, written, t)?;
        }
        if !is_path {
            self.plays(&along.field, &written.path);
        }
        let due = segment.due | written.due;
        let end = along.place(t)?;
        self.is_near(due, segment, &written.to(), &end.to)?;
        // Axes that nobody has commanded yet stay where they are.
        let (a, b) = (written.path.at(0.0), written.to());
        if let Some(axis) = (0..COUNT).find(|i| due & (1 << i) == 0 && a[*i] != b[*i]) {
            return self.is_near(1 << axis, segment, &b, &end.to);
        }
        let took = written.minutes(self.rules.dialect);
        self.found.takes(1, written.rate, took);
        along.minutes += took;
        along.part = t;
        if t >= 1.0 {
            self.leave(along, &written.to())?;
        }
        Ok(())
    }

    /// The end of one of the motions of a line.
    fn leave<'s>(&mut self, along: &mut Along<'s>, at: &PerLetter) -> Result<(), CheckError>
    where
        'c: 's,
    {
        let Some(segment) = along.segment() else {
            return Ok(());
        };
        if along.part < 1.0 {
            let end = along.place(1.0)?;
            self.is_near(segment.due, segment, at, &end.to)?;
        }
        let planned = segment.minutes(self.rules.dialect);
        self.found.takes(0, segment.rate, planned);
        // What was too short to be written has no time of its own.
        if along.minutes > 0.0 && planned > 0.0 {
            self.found.compare(segment.line, [planned, along.minutes]);
        }
        along.number += 1;
        along.enter(self)
    }

    /// The end of a line with a motion.
    pub(super) fn finish<'s>(
        &mut self,
        along: &mut Along<'s>,
        after: &State,
    ) -> Result<(), CheckError>
    where
        'c: 's,
    {
        while along.segment().is_some() {
            self.leave(along, &after.position.at)?;
        }
        Ok(())
    }

    /// Whether some axes (bits) are where they are to be.
    fn is_near(
        &self,
        due: u16,
        segment: &Segment,
        at: &PerLetter,
        end: &PerLetter,
    ) -> Result<(), CheckError> {
        match lost(due & self.tables.axes, at, end, &self.last_digits) {
            None => Ok(()),
            Some((axis, off)) => Err(CheckError::Lost {
                line: segment.line,
                axis: name(axis),
                off,
            }),
        }
    }

    /// Looks along what was written for the way up to a part of it.
    fn samples(
        &mut self,
        along: &Along<'_>,
        segment: &Segment,
        written: &Segment,
        until: f64,
    ) -> Result<(), CheckError> {
        let from = along.part;
        let stretch = *along.stretch_from(from);
        let begins = stretch.from == from && from == 0.0;
        let reverses = stretch.from == from && (!begins || stretch.travel != along.before);
        let is_blended = reverses && self.options.backlash == Backlash::Blend;
        let rotates = (0..COUNT).any(|i| is_rotary(i) && segment.path.by()[i] != 0.0);
        let radius = match written.path {
            Path::Arc(arc) => arc.radii()[0],
            Path::Line(..) => f64::INFINITY,
        };
        let is_chord =
            matches!(segment.path, Path::Arc(_)) && matches!(written.path, Path::Line(..));
        let chord = if is_chord { self.options.chord } else { 0.0 };
        let planned = PlannedStretch {
            field: &along.field,
            segment,
            stretch,
        };
        let starts = along.field.axes(&segment.path.at(from));
        let starts = starts.map_err(|_| CheckError::Outside(segment.line))?;
        let length = along.field.length.unwrap_or(0.0);
        self.play
            .learn(self.tables, &starts, &stretch.travel, length);
        let count = samples_of(&written.path);
        for k in 0..=count {
            let part = k as f64 / count as f64;
            let at = written.path.at(part);
            let mut place = planned.place(from + part * (until - from), &at)?;
            let mut takes_up = false;
            if !rotates && !is_blended {
                let is_before;
                (place, is_before) = planned.nearest(place, &at)?;
                // Where an axis turns round its play is taken up before the path begins.
                takes_up = begins && reverses && place.node.t == from && is_before;
                place.off = across(&place.off, &segment.path.slope(place.node.t), radius);
            }
            let [um, urad] = sizes(&place.off);
            if segment.cutter {
                // Corrected ends, and what lies between them as it comes: the report says how far off.
            } else if is_blended {
                self.found.blended_um = self.found.blended_um.max(um);
            } else {
                self.off(segment, um, urad, chord);
            }
            if takes_up {
                // The tool stands.
                continue;
            }
            self.head(along, segment, place.node.t)?;
            self.tool(&along.field, segment, &stretch.travel, &place.node.q, &at)?;
        }
        Ok(())
    }

    /// A place that is so far from the corrected path.
    fn off(&mut self, segment: &Segment, um: f64, urad: f64, chord: f64) {
        if um > self.found.off_um {
            self.found.off_um = um;
            self.found.off_line = segment.line;
        }
        let rounding = self.options.coarsest_rounding();
        let excess = um - (self.options.tolerance + chord + rounding) * 1e3;
        if excess > self.found.excess_um {
            self.found.excess_um = excess;
            self.found.excess_line = segment.line;
        }
        self.found.off_urad = self.found.off_urad.max(urad);
    }
}

/// At how many places a written path is looked at.
pub(super) fn samples_of(path: &Path) -> usize {
    let by = path.by();
    let straight: f64 = by[..6].iter().map(|d| d.abs()).sum();
    let (arc, turns) = match path {
        Path::Arc(arc) => (arc.length(), arc.sweep.abs() / TAU),
        Path::Line(..) => (0.0, 0.0),
    };
    let least = ((turns * OF_A_TURN).ceil() as usize).max(4);
    ((straight + arc).ceil() as usize * 2)
        .min(SAMPLES)
        .max(least)
}

/// How long a difference is over all linear (µm) and all rotary axes (µrad).
fn sizes(off: &PerLetter) -> [f64; 2] {
    let square = |rotary: bool| -> f64 {
        let of = off
            .iter()
            .enumerate()
            .filter(|(i, _)| is_rotary(*i) == rotary);
        of.map(|(_, d)| d * d).sum()
    };
    [
        square(false).sqrt() * 1e3,
        square(true).sqrt().to_radians() * 1e6,
    ]
}
