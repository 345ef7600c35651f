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
    /// Its number.
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

    /// Q of a cycle of pecks (mm) for a hole of another depth (mm), with as many pecks, and the tolerance (mm) within
    /// which each of them ends where its correction leads; how many pecks there are.
    #[must_use]
    pub(crate) fn peck_for(&self, depth: f64, tolerance: f64) -> Option<(f64, f64)> {
        let q = self.q.filter(|_| matches!(self.code, 730 | 830))?;
        let planned = self.r - self.bottom;
        let pecks = ((planned - NO_PECK) / q).ceil().max(1.0);
        let scaled = q * depth / planned;
        // A hole that is a little deeper would have one peck more, of a micrometre.
        let is_within = q * pecks >= depth && (scaled - q).abs() * (pecks - 1.0) <= tolerance;
        Some((if is_within { q } else { scaled }, pecks))
    }

    /// The cycle as single moves, in LinuxCNC's order; `None` for those that move with the spindle.
    #[must_use]
    pub fn parts(&self) -> Option<Vec<Part>> {
        let n = self.axes[2];
        let mut parts = Vec::new();
        let mut at = self.from;
        let go = |parts: &mut Vec<Part>, at: &mut PerLetter, to: PerLetter, feed: bool| {
            if (0..COUNT).any(|i| at[i] != to[i]) {
                *at = to;
                parts.push(if feed {
                    Part::Feed(to)
                } else {
                    Part::Rapid(to)
                });
            }
        };
        let with = |mut at: PerLetter, value: f64| {
            at[n] = value;
            at
        };
        for hole in self.holes() {
            if at[n] < self.r {
                let to = with(at, self.r);
                go(&mut parts, &mut at, to, false);
            }
            let over = with(hole, at[n]);
            go(&mut parts, &mut at, over, false);
            go(&mut parts, &mut at, with(hole, self.r), false);
            match self.code {
                730 | 830 => {
                    // Cycles of pecks are read with Q only.
                    let peck = self.q?;
                    let mut depth = self.r;
                    while depth > self.bottom {
                        let mut next = depth - peck;
                        if next < self.bottom + NO_PECK {
                            next = self.bottom;
                        }
                        go(&mut parts, &mut at, with(hole, next), true);
                        if next > self.bottom {
                            if self.code == 730 {
                                go(
                                    &mut parts,
                                    &mut at,
                                    with(hole, next + PECK_CLEARANCE),
                                    false,
                                );
                            } else {
                                go(&mut parts, &mut at, with(hole, self.r), false);
                                go(
                                    &mut parts,
                                    &mut at,
                                    with(hole, next + PECK_CLEARANCE),
                                    false,
                                );
                            }
                        }
                        depth = next;
                    }
                }
                810 | 820 | 850 | 860 | 890 => {
                    go(&mut parts, &mut at, with(hole, self.bottom), true);
                    if let (820 | 860 | 890, Some(p)) = (self.code, self.p) {
                        parts.push(Part::Dwell(p));
                    }
                }
                _ => return None,
            }
            if matches!(self.code, 850 | 890) {
                let level = match self.feeds_to_level() {
                    true => self.clear(),
                    false => self.r,
                };
                go(&mut parts, &mut at, with(hole, level), true);
            }
            if self.code == 860 {
                parts.push(Part::SpindleStops);
            }
            go(&mut parts, &mut at, with(hole, self.clear()), false);
            if self.code == 860 {
                parts.push(Part::SpindleTurns);
            }
        }
        Some(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_that_becomes_a_little_deeper_has_no_peck_more() {
        let cycle = |bottom: f64, q: f64| Cycle {
            code: 830,
            axes: [0, 1, 2],
            from: [0.0; COUNT],
            first: [0.0; COUNT],
            by: [0.0; COUNT],
            repeat: 1,
            r: 4.0,
            bottom,
            initial: 9.0,
            retract: Retract::Initial,
            q: Some(q),
            p: None,
            rate: Rate::PerMinute(100.0),
            feeds_to_clear: true,
        };
        let pecks = |cycle: &Cycle| {
            let parts = cycle.parts().unwrap();
            let feeds = parts.iter().filter(|part| matches!(part, Part::Feed(_)));
            feeds.count()
        };
        let peck_for = |cycle: &Cycle, depth: f64| cycle.peck_for(depth, 1e-3).unwrap();
        let deeper = cycle(-0.0003, 1.0);
        assert_eq!(pecks(&cycle(0.0, 1.0)), 4);
        assert_eq!(pecks(&deeper), 5);
        let (q, _) = peck_for(&cycle(0.0, 1.0), 4.0003);
        assert!(q > 1.0 && q < 1.0001);
        assert_eq!(pecks(&cycle(-0.0003, q)), 4);
        // Less deep, or with room in the last peck: the same Q.
        assert_eq!(peck_for(&cycle(0.0, 1.0), 3.9997), (1.0, 4.0));
        assert_eq!(peck_for(&cycle(0.0, 1.5), 4.0003), (1.5, 3.0));
        // Far less deep: all pecks shorter.
        assert_eq!(peck_for(&cycle(0.0, 1.0), 3.992), (0.998, 4.0));
        // Rounding gets no peck of its own.
        assert_eq!(pecks(&cycle(4.0 - 0.3 * 3.0, 0.3)), 3);
    }
}
