//! Holes of a cycle that stays one.

use super::{Check, CheckError, lost};
use crate::axes::{COUNT, PerLetter};
use crate::cycle::Cycle;
use crate::limits::displacement;
use crate::program::{Reading, Segment};
use crate::trace::{Field, Node};
use std::io::BufRead;

/// Heights at which a hole is looked at, besides its bottom.
const HEIGHTS: usize = 8;
/// The level to which a cycle returns is that of the program, but for a correction, and those are smaller (mm).
const CORRECTION: f64 = 1.0;

impl Check<'_> {
    /// A written cycle with some holes of one of the program.
    pub(super) fn holes<R: BufRead>(
        &mut self,
        before: &Reading<'_, R>,
        cycle: &Cycle,
        written: &Cycle,
        [from, until]: [usize; 2],
    ) -> Result<(), CheckError> {
        let line = before.number();
        let another = Err(CheckError::Hole(line));
        if !is_same_cycle(cycle, written, [from, until]) {
            return another;
        }
        let Some(segment) = before
            .segments(&crate::moves::Move::Cycle(Box::new(cycle.clone())))
            .pop()
        else {
            return another;
        };
        let field = self.field_of(&segment);
        let pairs = cycle
            .holes()
            .skip(from)
            .take(until - from)
            .zip(written.holes());
        for (number, (hole, there)) in pairs.enumerate() {
            let pair = HolePair {
                cycle,
                written,
                hole,
                there,
            };
            if field.turns {
                let over = hole[cycle.axes[2]].max(cycle.r);
                self.come_to(&field, &pair.place(over));
                self.come_to(&field, &pair.place(cycle.bottom));
            }
            let bottom = field.node(1.0, &pair.place(cycle.bottom), &self.ways.travel);
            let bottom = bottom.map_err(|_| CheckError::Outside(line))?;
            // Of holes in one line the first is exact, and the others within the tolerance.
            let exact = written.repeat == 1 || number == 0;
            if exact && !pair.is_exact(&bottom, &self.last_digits) {
                return another;
            }
            self.along_hole(&pair, &field, &segment)?;
            if field.turns {
                self.come_to(&field, &pair.place(cycle.clear()));
            }
        }
        Ok(())
    }

    /// The axes have come to a place of a hole.
    fn come_to(&mut self, field: &Field<'_>, place: &PerLetter) {
        self.ways.come_to(self.tables, &field.middle(place));
    }

    /// How far a hole is off between R and its bottom.
    fn along_hole(
        &mut self,
        pair: &HolePair<'_>,
        field: &Field<'_>,
        segment: &Segment,
    ) -> Result<(), CheckError> {
        let (cycle, written) = (pair.cycle, pair.written);
        let travel = self.ways.travel;
        for k in 0..=HEIGHTS {
            let part = k as f64 / HEIGHTS as f64;
            let place = pair.place(cycle.r + part * (cycle.bottom - cycle.r));
            let node = field.node(1.0, &place, &travel);
            let node = node.map_err(|_| CheckError::Outside(segment.line))?;
            let mut at = pair.there;
            at[cycle.axes[2]] = written.r + part * (written.bottom - written.r);
            let off: PerLetter = std::array::from_fn(|i| at[i] - node.to[i]);
            let um = displacement(&off) * 1e3;
            if um > self.found.hole_um {
                self.found.hole_um = um;
                self.found.hole_line = segment.line;
            }
            self.tool(field, segment, &travel, &node.q, &at)?;
        }
        Ok(())
    }
}

/// A hole of the program, and where the corrected program has it.
struct HolePair<'c> {
    cycle: &'c Cycle,
    written: &'c Cycle,
    hole: PerLetter,
    there: PerLetter,
}

impl HolePair<'_> {
    /// The hole of the program at a height.
    fn place(&self, height: f64) -> PerLetter {
        let mut place = self.hole;
        place[self.cycle.axes[2]] = height;
        place
    }

    /// True if bottom and R are where the correction of the bottom brings them.
    fn is_exact(&self, bottom: &Node, last: &PerLetter) -> bool {
        let (cycle, written) = (self.cycle, self.written);
        let n = cycle.axes[2];
        let by = bottom.to[n] - bottom.q[n];
        let mut meant = bottom.to;
        let mut found = self.there;
        for axis in (0..COUNT).filter(|axis| !cycle.axes.contains(axis)) {
            // Axes beside the cycle: as far as the tolerance lets them.
            meant[axis] = found[axis];
        }
        found[n] = written.bottom;
        let r = (written.r - cycle.r - by).abs();
        lost(u16::MAX, &found, &meant, last).is_none() && r <= super::NEAR * last[n]
    }
}

/// True for holes `from` to `until` of a cycle, with its words and levels.
fn is_same_cycle(cycle: &Cycle, written: &Cycle, [from, until]: [usize; 2]) -> bool {
    cycle.code == written.code
        && cycle.axes == written.axes
        && cycle.retract == written.retract
        && cycle.p == written.p
        && cycle.rate == written.rate
        && cycle.q.unwrap_or_default() == written.q.unwrap_or_default()
        && cycle.pecks() == written.pecks()
        && until == from + written.repeat as usize
        && until <= cycle.repeat as usize
        && (cycle.clear() - written.clear()).abs() <= CORRECTION
}
