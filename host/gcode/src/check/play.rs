//! From written positions to where each axis stands in its lost motion: a correction may move an axis back that the program
//! holds still, and so reverse it without a reversal of the program.

use super::Check;
use super::along::samples_of;
use crate::axes::{COUNT, PerLetter};
use crate::interpret::bits;
use crate::tables::Tables;
use crate::trace::{Field, Path, Travels};
use crate::travel_directions::sign;
use trueaxis::Travel;

/// Where the axes stand in their lost motion, as play takes it up.
pub(super) struct Play {
    /// Where they are; NaN before the first position.
    at: PerLetter,
    /// From −1, after negative travel, to 1, after positive travel; NaN before the first position.
    signs: PerLetter,
    /// How much farther tables command each after positive travel (mm, degrees): its lost motion. An axis that is not
    /// commanded farther does not lag behind, and no play explains its reversal.
    lost: PerLetter,
}

impl Play {
    pub fn new() -> Self {
        Self {
            at: [f64::NAN; COUNT],
            signs: [f64::NAN; COUNT],
            lost: [0.0; COUNT],
        }
    }

    /// Takes the lost motions at a place in.
    pub fn learn(&mut self, tables: &Tables<'_>, q: &PerLetter, travel: &Travels, length: f64) {
        for axis in bits(tables.directional) {
            let of = |way: Travel| {
                let mut travel = *travel;
                travel[axis] = way;
                tables.at(q, &travel, length)[axis]
            };
            self.lost[axis] = of(Travel::Positive) - of(Travel::Negative);
            if self.signs[axis].is_nan() {
                self.signs[axis] = sign(travel[axis]);
            }
        }
    }

    /// All axes have come to a position, straight from the one before.
    pub fn come_to(&mut self, to: &PerLetter) {
        let ways = to.iter().zip(&self.at).zip(&self.lost);
        for (sign, ((to, at), lost)) in self.signs.iter_mut().zip(ways) {
            let part = 2.0 * (to - at) / lost;
            if part.is_finite() {
                *sign = (*sign + part).clamp(-1.0, 1.0);
            }
        }
        self.at = *to;
    }

    /// The sign of an axis, if it has play.
    pub fn sign_of(&self, axis: usize) -> Option<f64> {
        (self.lost[axis] > 0.0).then_some(self.signs[axis])
    }
}

impl Check<'_> {
    /// The machine has come along a written path. Axes that follow the tip may turn round on it.
    pub(super) fn plays(&mut self, field: &Field<'_>, path: &Path) {
        let count = match field.tip {
            None => 1,
            Some(_) => samples_of(path),
        };
        for k in 1..=count {
            if let Ok(at) = field.axes(&path.at(k as f64 / count as f64)) {
                self.play.come_to(&at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_motion_is_taken_up_before_an_axis_turns() {
        let mut play = Play::new();
        (play.lost[0], play.signs[0]) = (0.02, 1.0);
        for (to, sign) in [
            (5.0, 1.0),
            (4.995, 0.5),
            (4.985, -0.5),
            (4.0, -1.0),
            (4.01, 0.0),
        ] {
            let mut at = [0.0; COUNT];
            at[0] = to;
            play.come_to(&at);
            assert!((play.sign_of(0).unwrap() - sign).abs() < 1e-9, "{to}");
        }
        assert_eq!(play.sign_of(1), None);
    }
}
