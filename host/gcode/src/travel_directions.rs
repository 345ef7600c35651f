//! The direction in which each axis last moved, with its correction: an axis that the program holds still goes back and forth
//! with that, and takes up its lost motion.

use super::axes::{COUNT, PerLetter, Position};
use super::interpret::bits;
use super::tables::Tables;
use trueaxis::{Reversal, Travel};

/// Which way each axis has moved last, along a program.
#[derive(Clone, Debug)]
pub struct TravelDirections {
    reversals: [Reversal; COUNT],
    /// As [`Reversal`] tells.
    pub travel: [Travel; COUNT],
    /// Where they are commanded to, whichever way they travel; NaN where that is not known.
    last: PerLetter,
}

impl TravelDirections {
    /// Before the first line: where axes stand, and which way they have moved before, if that is known.
    #[must_use]
    pub fn new(tables: &Tables<'_>, start: &Position, travel: &[Travel; COUNT]) -> Self {
        let mut ways = Self {
            reversals: [Reversal::new(); COUNT],
            travel: [Travel::Unknown; COUNT],
            last: start.at,
        };
        for (axis, way) in travel.iter().enumerate() {
            if !start.knows(axis) {
                ways.forget(axis);
                continue;
            }
            ways.arrives(tables, axis, start.at[axis], *way);
        }
        ways
    }

    /// An axis goes straight to a position, by quarters of a turn if it is endless: more than half a turn at once would
    /// look like less, the other way.
    fn axis_to(&mut self, tables: &Tables<'_>, axis: usize, q: f64) {
        let period = tables.period[axis];
        let quarter = 0.25 * period;
        let mut by = q - self.last[axis];
        if quarter > 0.0 && by.abs() > quarter {
            if by.abs() > 2.0 * period {
                // All turns but the last ones tell nothing.
                by = by % period + period.copysign(by);
            }
            let parts = (by.abs() / quarter).ceil();
            for part in 1..parts as u32 {
                let left = 1.0 - f64::from(part) / parts;
                self.axis_at(tables, axis, q - left * by);
            }
        }
        self.axis_at(tables, axis, q);
    }

    /// An axis has come to a position, less than half a turn from where it was.
    fn axis_at(&mut self, tables: &Tables<'_>, axis: usize, q: f64) {
        let reversal_threshold = tables.reversal_threshold[axis] as f32;
        let period = tables.period[axis] as f32;
        self.travel[axis] = self.reversals[axis].update(q as f32, reversal_threshold, period);
    }

    /// An axis has come to a position in a direction.
    fn arrives(&mut self, tables: &Tables<'_>, axis: usize, q: f64, way: Travel) {
        self.reversals[axis] = Reversal::new();
        let far = 2.0 * tables.reversal_threshold[axis] + 0.01;
        if way != Travel::Unknown {
            self.axis_at(tables, axis, q - sign(way) * far);
        }
        self.axis_at(tables, axis, q);
    }

    /// Takes a straight move to where axes are commanded to in, along which corrections hardly bend, if no axis turns round on it; otherwise
    /// nothing, and false.
    pub fn goes_on(&mut self, tables: &Tables<'_>, at: &PerLetter) -> bool {
        if tables.directional == 0 {
            self.last = *at;
            return true;
        }
        let mut ways = self.clone();
        ways.come_to(tables, at);
        let keeps = bits(tables.directional).all(|axis| {
            let by = (ways.last[axis] - self.last[axis]).abs();
            // More than half a turn of an endless axis would look like less, the other way.
            let is_plain = tables.period[axis] == 0.0 || by < 0.25 * tables.period[axis];
            let way = ways.travel[axis];
            is_plain && way == self.travel[axis] && way != Travel::Unknown
        });
        if keeps {
            *self = ways;
        }
        keeps
    }

    /// The axes have come to where they are commanded to, whichever way they travel, straight from the place before.
    pub(crate) fn come_to(&mut self, tables: &Tables<'_>, at: &PerLetter) {
        for axis in bits(tables.directional) {
            self.axis_to(tables, axis, at[axis]);
        }
        self.last = *at;
    }

    /// Which way an axis comes is no longer known, nor where from.
    pub(crate) fn forget(&mut self, axis: usize) {
        self.last[axis] = f64::NAN;
        self.reversals[axis] = Reversal::new();
        self.travel[axis] = Travel::Unknown;
    }

    /// The first axis whose direction matters and is not known.
    #[must_use]
    pub fn missing(&self, tables: &Tables<'_>) -> Option<usize> {
        bits(tables.directional).find(|axis| self.travel[*axis] == Travel::Unknown)
    }
}

/// The other direction.
pub(crate) fn opposite(way: Travel) -> Travel {
    match way {
        Travel::Positive => Travel::Negative,
        Travel::Negative => Travel::Positive,
        Travel::Unknown => Travel::Unknown,
    }
}

/// +1 and −1.
pub(crate) fn sign(way: Travel) -> f64 {
    match way {
        Travel::Positive => 1.0,
        Travel::Negative => -1.0,
        Travel::Unknown => 0.0,
    }
}
