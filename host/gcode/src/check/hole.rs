//! Holes of a cycle that stays one.

use super::{Check, CheckError, lost};
use crate::axes::{COUNT, PerLetter};
use crate::cycle::Cycle;
use crate::limits::displacement;
use crate::program::Reading;
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
        let same_words = cycle.code == written.code
            && cycle.axes == written.axes
            && cycle.retract == written.retract
            && cycle.p == written.p
            && cycle.rate == written.rate
            && cycle.q.unwrap_or_default() == written.q.unwrap_or_default()
            && cycle.pecks() == written.pecks()
            && until == from + written.repeat as usize
            && until <= cycle.repeat as usize;
        if !same_words || (cycle.clear() - written.clear()).abs() > CORRECTION {
            return another;
        }
        let Some(segment) = before
            .segments(&crate::moves::Move::Cycle(Box::new(cycle.clone())))
            .pop()
        else {
            return another;
        };
        let last = self.last_digits;
        let field = self.field_of(&segment);
        let n = cycle.axes[2];
        let outside = |_| CheckError::Outside(line);
        // Of holes in one line the first is exact, and the others within the tolerance.
        let exact = written.repeat == 1;
        let pairs = cycle
            .holes()
            .skip(from)
            .take(until - from)
            .zip(written.holes());
        for (number, (hole, there)) in pairs.enumerate() {
            let place = |height: f64| {
                let mut place = hole;
                place[n] = height;
                place
            };
            if field.turns {
                self.ways.come_to(self.tables, &place(hole[n].max(cycle.r)));
                self.ways.come_to(self.tables, &place(cycle.bottom));
            }
            let travel = self.ways.travel;
            let bottom = field
                .node(1.0, &place(cycle.bottom), &travel)
                .map_err(outside)?;
            let by = bottom.to[n] - bottom.q[n];
            let mut meant = bottom.to;
            let mut found = there;
            for axis in (0..COUNT).filter(|axis| !cycle.axes.contains(axis)) {
                // Axes beside the cycle: as far as the tolerance lets them.
                meant[axis] = found[axis];
            }
            found[n] = written.bottom;
            let far = match exact || number == 0 {
                true => lost(u16::MAX, &found, &meant, &last).is_some(),
                false => false,
            };
            let r = (written.r - cycle.r - by).abs();
            if far || (exact || number == 0) && r > super::NEAR * last[n] {
                return another;
            }
            for k in 0..=HEIGHTS {
                let part = k as f64 / HEIGHTS as f64;
                let node = field.node(
                    1.0,
                    &place(cycle.r + part * (cycle.bottom - cycle.r)),
                    &travel,
                );
                let node = node.map_err(outside)?;
                let mut at = there;
                at[n] = written.r + part * (written.bottom - written.r);
                let off: PerLetter = std::array::from_fn(|i| at[i] - node.to[i]);
                let um = displacement(&off) * 1e3;
                if um > self.found.hole_um {
                    self.found.hole_um = um;
                    self.found.hole_line = line;
                }
                self.tool(&field, &segment, &travel, &node.q, &at)?;
            }
            if field.turns {
                self.ways.come_to(self.tables, &place(cycle.clear()));
            }
        }
        Ok(())
    }
}
