//! Canned cycles: holes along the normal of the plane.

use super::axes::{COUNT, PerLetter};
use super::modal::{Retract, Units};
use super::rate::Rate;

/// Words that stay from one cycle of a series to the next, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sticky {
    /// Which cycle, in tenths.
    pub code: u16,
    /// Where the normal axis was before the series (machine).
    pub initial: f64,
    /// In what the words of the series are.
    pub frame: Frame,
    /// True if R and the depth are increments.
    pub relative: bool,
    /// R and depth as written (mm).
    pub r: f64,
    /// The word of the normal axis.
    pub depth: f64,
    /// Q (mm).
    pub q: Option<f64>,
    /// P as written.
    pub p: Option<Wait>,
}

/// A time as it is written: seconds, or milliseconds, which a point may tell apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wait {
    /// Number.
    pub value: f64,
    /// True if it has a point.
    pub point: bool,
}

/// What numbers of a series mean along the normal of its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The axis of the normal.
    pub normal: usize,
    /// Units of words.
    pub units: Units,
    /// Position of the machine where its coordinate is 0.
    pub zero: f64,
}

/// A line of a cycle, in positions of the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Cycle {
    /// Which, in tenths.
    pub code: u16,
    /// First and second axis of the plane, and its normal.
    pub axes: [usize; 3],
    /// Where the axes are before.
    pub from: PerLetter,
    /// Where the first hole is, at the height of `from`.
    pub first: PerLetter,
    /// From one hole to the next.
    pub by: PerLetter,
    /// How many holes.
    pub repeat: u32,
    /// Where feeding begins.
    pub r: f64,
    /// The bottom.
    pub bottom: f64,
    /// Where the normal axis was before the series.
    pub initial: f64,
    /// Where it ends.
    pub retract: Retract,
    /// Depth of a peck (mm).
    pub q: Option<f64>,
    /// How long it stays at the bottom.
    pub p: Option<Wait>,
    /// How fast it feeds.
    pub rate: Rate,
    /// True if G89 feeds out to where it ends, as LinuxCNC's does, rather than to R.
    pub feeds_to_clear: bool,
}

/// How far a peck stays from where it was, as in LinuxCNC (mm).
const PECK_CLEARANCE: f64 = 0.254;

/// A remaining depth below this (mm) is rounding and gets no peck of its own.
const NO_PECK: f64 = 1e-6;

/// A part of a cycle that is written out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// Rapid to here.
    Rapid(PerLetter),
    /// Feed to here.
    Feed(PerLetter),
    /// Wait as P says.
    Dwell(Wait),
    /// The spindle stops.
    SpindleStops,
    /// It turns again, as it did before.
    SpindleTurns,
}

/// The parts of a cycle so far, and where they lead.
struct CycleParts {
    normal: usize,
    at: PerLetter,
    parts: Vec<Part>,
}

impl CycleParts {
    fn rapid(&mut self, place: PerLetter, height: f64) {
        self.go(place, height, Part::Rapid);
    }

    fn feed(&mut self, place: PerLetter, height: f64) {
        self.go(place, height, Part::Feed);
    }

    /// A move to a height at a place, unless it stands there.
    fn go(&mut self, mut to: PerLetter, height: f64, part: fn(PerLetter) -> Part) {
        to[self.normal] = height;
        if (0..COUNT).any(|i| self.at[i] != to[i]) {
            self.at = to;
            self.parts.push(part(to));
        }
    }
}

impl Cycle {
    /// Where the normal axis ends.
    #[must_use]
    pub fn clear(&self) -> f64 {
        match self.retract {
            Retract::Initial => self.initial.max(self.r),
            Retract::Plane => self.r,
        }
    }

    /// True if it feeds out to the level before its series, if that is above R.
    #[must_use]
    pub(crate) fn feeds_to_level(&self) -> bool {
        self.code == 890 && self.feeds_to_clear && self.retract == Retract::Initial
    }

    /// How many pecks a hole takes.
    #[must_use]
    pub fn pecks(&self) -> f64 {
        match (self.code, self.q) {
            (730 | 830, Some(q)) => ((self.r - self.bottom - NO_PECK) / q).ceil(),
            _ => 1.0,
        }
    }

    /// True if the tool cuts, or holds a thread, on its way out too.
    #[must_use]
    pub fn feeds_out(&self) -> bool {
        matches!(self.code, 740 | 840 | 850 | 890)
    }

    /// Where the holes are, at the height of `from`.
    pub fn holes(&self) -> impl Iterator<Item = PerLetter> + '_ {
        (0..self.repeat).map(|n| std::array::from_fn(|i| self.first[i] + f64::from(n) * self.by[i]))
    }

    /// Where the axes end.
    #[must_use]
    pub fn to(&self) -> PerLetter {
        // There is one hole at least.
        let mut to = self.holes().last().unwrap_or(self.from);
        to[self.axes[2]] = self.clear();
        to
    }

    /// The cycle as single moves, in LinuxCNC's order; `None` for those that move with the spindle.
    #[must_use]
    pub fn parts(&self) -> Option<Vec<Part>> {
        let n = self.axes[2];
        let mut out = CycleParts {
            normal: n,
            at: self.from,
            parts: Vec::new(),
        };
        for hole in self.holes() {
            if out.at[n] < self.r {
                out.rapid(out.at, self.r);
            }
            out.rapid(hole, out.at[n]);
            out.rapid(hole, self.r);
            match self.code {
                // Cycles of pecks are read with Q only.
                730 | 830 => self.peck(hole, self.q?, &mut out),
                810 | 820 | 850 | 860 | 890 => {
                    out.feed(hole, self.bottom);
                    if let (820 | 860 | 890, Some(p)) = (self.code, self.p) {
                        out.parts.push(Part::Dwell(p));
                    }
                }
                _ => return None,
            }
            match self.code {
                850 | 890 if self.feeds_to_level() => out.feed(hole, self.clear()),
                850 | 890 => out.feed(hole, self.r),
                860 => out.parts.push(Part::SpindleStops),
                _ => {}
            }
            out.rapid(hole, self.clear());
            if self.code == 860 {
                out.parts.push(Part::SpindleTurns);
            }
        }
        Some(out.parts)
    }

    /// From R to the bottom in pecks: G73 clears the chip where it is, G83 above the hole.
    fn peck(&self, hole: PerLetter, peck: f64, out: &mut CycleParts) {
        let mut depth = self.r;
        while depth > self.bottom {
            let mut next = depth - peck;
            if next < self.bottom + NO_PECK {
                next = self.bottom;
            }
            out.feed(hole, next);
            if next > self.bottom {
                if self.code == 830 {
                    out.rapid(hole, self.r);
                }
                out.rapid(hole, next + PECK_CLEARANCE);
            }
            depth = next;
        }
    }
}
