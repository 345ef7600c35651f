//! The direction in which each axis last moved.

use super::axes::{COUNT, PerLetter, Position, is_rotary};
use super::interpret::bits;
use super::tables::Tables;
use trueaxis::{Reversal, Travel};

/// Which way each axis has moved last, along a program.
#[derive(Clone, Debug)]
pub struct TravelDirections {
    reversals: [Reversal; COUNT],
    /// As [`Reversal`] tells.
    pub travel: [Travel; COUNT],
    /// Where they have come to; NaN where that is not known.
    last: PerLetter,
    /// What an axis may come back by beyond its hysteresis, for the last digits of words (mm, degrees).
    slack: [f64; 2],
}

impl TravelDirections {
    /// Before the first line: where axes stand, and which way they have moved before, if that is known.
    #[must_use]
    pub fn new(tables: &Tables<'_>, start: &Position, travel: &[Travel; COUNT]) -> Self {
        let mut ways = Self {
            reversals: [Reversal::new(); COUNT],
            travel: [Travel::Unknown; COUNT],
            last: start.at,
            slack: [0.0; 2],
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

    /// Positions are rounded by so much (mm, degrees): an axis that comes back by no more than that beyond its hysteresis
    /// has not turned round.
    #[must_use]
    pub(crate) fn rounded_by(self, slack: [f64; 2]) -> Self {
        Self { slack, ..self }
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
        let slack = self.slack[usize::from(is_rotary(axis))];
        let hysteresis = (tables.hysteresis[axis] + slack).max(0.0) as f32;
        let period = tables.period[axis] as f32;
        self.travel[axis] = self.reversals[axis].update(q as f32, hysteresis, period);
    }

    /// An axis has come to a position in a direction.
    fn arrives(&mut self, tables: &Tables<'_>, axis: usize, q: f64, way: Travel) {
        self.reversals[axis] = Reversal::new();
        let far = 2.0 * tables.hysteresis[axis] + 0.01;
        if way != Travel::Unknown {
            self.axis_at(tables, axis, q - sign(way) * far);
        }
        self.axis_at(tables, axis, q);
    }

    /// The axes have come to a position that depends on the directions in which they came, as those of a corrected
    /// program do: `at` says where they are by such directions. As few axes have turned round as it takes; one that has
    /// may have gone nowhere yet, but not on.
    ///
    /// # Errors
    /// Those of `at`.
    pub(crate) fn come_by<E>(
        &mut self,
        tables: &Tables<'_>,
        at: impl Fn(&Self) -> Result<PerLetter, E>,
    ) -> Result<(), E> {
        let axes: Vec<usize> = bits(tables.directional).collect();
        let mut choices: Vec<u32> = (0..1 << axes.len()).collect();
        choices.sort_by_key(|choice| choice.count_ones());
        for choice in choices {
            let has_turned = |place: usize| choice >> place & 1 != 0;
            let mut trial = self.clone();
            for (place, axis) in axes.iter().enumerate() {
                if has_turned(place) {
                    trial.travel[*axis] = opposite(self.travel[*axis]);
                }
            }
            let q = at(&trial)?;
            let mut fits = true;
            for (place, axis) in axes.iter().copied().enumerate() {
                let (before, way) = (self.travel[axis], trial.travel[axis]);
                if has_turned(place) {
                    let on = sign(before) * (q[axis] - self.last[axis]);
                    fits &= before != Travel::Unknown && on <= tables.hysteresis[axis];
                    trial.arrives(tables, axis, q[axis], way);
                } else {
                    trial.axis_to(tables, axis, q[axis]);
                    fits &= before == Travel::Unknown || trial.travel[axis] == before;
                }
            }
            if fits {
                trial.last = q;
                *self = trial;
                return Ok(());
            }
        }
        let q = at(self)?;
        self.come_to(tables, &q);
        Ok(())
    }

    /// The axes stand while some have turned round: the step of a reversal, as a corrected program has it. `stands` says
    /// where they are by such directions, if that is where they were. False, and nothing done, if it takes no axis that
    /// has turned, or if none helps.
    ///
    /// # Errors
    /// Those of `stands`.
    pub(crate) fn turn_by<E>(
        &mut self,
        tables: &Tables<'_>,
        stands: impl Fn(&Self) -> Result<Option<PerLetter>, E>,
    ) -> Result<bool, E> {
        let mut choices = vec![(0_u32, self.travel)];
        for axis in bits(tables.directional) {
            let others = match self.travel[axis] {
                Travel::Unknown => &[Travel::Positive, Travel::Negative][..],
                Travel::Positive => &[Travel::Negative],
                Travel::Negative => &[Travel::Positive],
            };
            for k in 0..choices.len() {
                let (turned, travel) = choices[k];
                choices.extend(others.iter().map(|way| {
                    let mut travel = travel;
                    travel[axis] = *way;
                    (turned + 1, travel)
                }));
            }
        }
        choices.sort_by_key(|(turned, _)| *turned);
        for (turned, travel) in choices {
            let mut trial = self.clone();
            trial.travel = travel;
            let Some(q) = stands(&trial)? else {
                continue;
            };
            for axis in bits(tables.directional) {
                if travel[axis] != self.travel[axis] {
                    trial.arrives(tables, axis, q[axis], travel[axis]);
                }
            }
            if turned > 0 {
                trial.last = q;
                *self = trial;
            }
            return Ok(turned > 0);
        }
        Ok(false)
    }

    /// Takes a straight move to a position in, if no axis turns round on it; otherwise nothing, and false.
    pub fn goes_on(&mut self, tables: &Tables<'_>, to: &PerLetter) -> bool {
        if tables.directional == 0 {
            self.last = *to;
            return true;
        }
        let mut ways = self.clone();
        ways.come_to(tables, to);
        let keeps = bits(tables.directional).all(|axis| {
            let by = (to[axis] - self.last[axis]).abs();
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

    /// The axes have come to a position, straight from the one before.
    pub(crate) fn come_to(&mut self, tables: &Tables<'_>, q: &PerLetter) {
        for axis in bits(tables.directional) {
            self.axis_to(tables, axis, q[axis]);
        }
        self.last = *q;
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

/// +1 and −1.
fn sign(way: Travel) -> f64 {
    match way {
        Travel::Positive => 1.0,
        Travel::Negative => -1.0,
        Travel::Unknown => 0.0,
    }
}

fn opposite(way: Travel) -> Travel {
    match way {
        Travel::Positive => Travel::Negative,
        Travel::Negative => Travel::Positive,
        Travel::Unknown => Travel::Unknown,
    }
}
