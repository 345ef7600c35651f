//! Direction of travel with reversal threshold.

use crate::guard::{larger, smaller};
use crate::inputs::Travel;

/// Follows the command of one axis and reports the direction in which it last moved.
///
/// An axis has reversed when it has come back by more than its reversal threshold from the extreme reached since the last
/// reversal. Before the first move by more than the reversal threshold the direction is unknown. Jitter of less than the
/// reversal threshold (peak to peak) never changes the direction.
#[derive(Clone, Copy, Debug)]
pub struct Reversal {
    travel: Travel,
    /// Highest and lowest position since the last reversal; only the relevant one is updated.
    high: f32,
    low: f32,
    last: f32,
    started: bool,
}

impl Reversal {
    /// Direction unknown: the axis has not moved yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            travel: Travel::Unknown,
            high: 0.0,
            low: 0.0,
            last: 0.0,
            started: false,
        }
    }

    /// Direction in which the axis last moved.
    #[must_use]
    pub fn travel(&self) -> Travel {
        self.travel
    }

    /// While an axis keeps moving in its direction, only its extreme changes. Returns the direction as ±1, that
    /// extreme, and how far the axis may move on before more has to be checked. `None` while the direction is unknown.
    pub(crate) fn extreme(&self, reversal_threshold: f32, period: f32) -> Option<(f32, f32, f32)> {
        // Even starting one reversal threshold short of the extreme, this is less than half a turn, so it is not a jump.
        let far = if period > 0.0 {
            0.25 * period
        } else {
            f32::MAX
        };
        if far <= reversal_threshold {
            return None;
        }
        match self.travel {
            Travel::Positive => Some((1.0, self.high, far)),
            Travel::Negative => Some((-1.0, self.low, far)),
            Travel::Unknown => None,
        }
    }

    /// An axis known to have moved in direction `travel`, to the position that comes next.
    pub(crate) fn moved(travel: Travel) -> Self {
        Self {
            travel,
            ..Self::new()
        }
    }

    /// The axis has moved to `q`, by less than half a turn, without reversing on the way.
    pub(crate) fn pass(&mut self, q: f32) {
        self.last = q;
        self.high = larger(q, self.high);
        self.low = smaller(q, self.low);
    }

    /// Processes the commanded position `q` (finite); `reversal_threshold` belongs to the axis. Both are in mm or degrees.
    ///
    /// `period`, if positive, is the period of an endless axis, whose position may be reduced to one turn between
    /// calls: a jump of more than half a period counts as whole turns plus the rest, not as a move.
    pub fn update(&mut self, q: f32, reversal_threshold: f32, period: f32) -> Travel {
        if !self.started {
            (self.high, self.low, self.last, self.started) = (q, q, q, true);
            return self.travel;
        }
        if period > 0.0 {
            let jump = q - self.last;
            if is_turned(jump, period) {
                // Rare, so a division is acceptable.
                let turns = jump / period;
                let turns = (turns + 0.5_f32.copysign(turns)) as i32 as f32;
                self.high += turns * period;
                self.low += turns * period;
            }
        }
        self.pass(q);
        let retreated = self.high - q > reversal_threshold;
        let advanced = q - self.low > reversal_threshold;
        match self.travel {
            // Both at once: the reversal threshold has been reduced, and it is unknown which extreme came last.
            Travel::Unknown if retreated && advanced => self.turn(Travel::Unknown, q),
            Travel::Positive | Travel::Unknown if retreated => self.turn(Travel::Negative, q),
            Travel::Negative | Travel::Unknown if advanced => self.turn(Travel::Positive, q),
            _ => {}
        }
        self.travel
    }

    fn turn(&mut self, travel: Travel, q: f32) {
        self.travel = travel;
        self.high = q;
        self.low = q;
    }
}

/// Whether the jump exceeds half a period and so contains whole turns.
#[inline(always)]
fn is_turned(jump: f32, period: f32) -> bool {
    jump.abs() > 0.5 * period
}

impl Default for Reversal {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn follow(reversal: &mut Reversal, positions: &[f32]) -> Travel {
        positions
            .iter()
            .map(|&q| reversal.update(q, 0.5, 0.0))
            .last()
            .unwrap()
    }

    #[test]
    fn the_direction_is_unknown_until_the_axis_has_moved_by_more_than_the_reversal_threshold() {
        assert_eq!(follow(&mut Reversal::new(), &[7.0]), Travel::Unknown);
        assert_eq!(follow(&mut Reversal::new(), &[7.0, 7.5]), Travel::Unknown);
        assert_eq!(follow(&mut Reversal::new(), &[7.0, 7.75]), Travel::Positive);
        assert_eq!(follow(&mut Reversal::new(), &[7.0, 6.25]), Travel::Negative);
        // 0.25 up, then 0.5 down from the start: 0.75 below the highest position.
        assert_eq!(
            follow(&mut Reversal::new(), &[7.0, 7.25, 6.5]),
            Travel::Negative
        );
    }

    #[test]
    fn a_reversal_is_counted_from_the_extreme_and_not_from_the_last_position() {
        let mut r = Reversal::new();
        assert_eq!(follow(&mut r, &[0.0, 10.0, 9.75, 9.5]), Travel::Positive);
        assert_eq!(follow(&mut r, &[9.25]), Travel::Negative);
        assert_eq!(follow(&mut r, &[5.0, 5.25, 5.0, 5.5]), Travel::Negative);
        assert_eq!(follow(&mut r, &[5.75]), Travel::Positive);
    }

    #[test]
    fn after_a_known_direction_the_first_position_is_the_extreme() {
        for (travel, q, back, other) in [
            (Travel::Positive, 250.0, 249.0, Travel::Negative),
            (Travel::Negative, -250.0, -249.0, Travel::Positive),
        ] {
            let mut r = Reversal::moved(travel);
            for (place, expected) in [(q, travel), (back, other)] {
                assert_eq!(r.update(place, 0.5, 0.0), expected, "{place}");
            }
        }
    }

    #[test]
    fn a_turn_of_a_modulo_axis_is_no_reversal() {
        let mut r = Reversal::new();
        for (q, expected) in [
            (350.0, Travel::Unknown),
            (359.0, Travel::Positive),
            (1.0, Travel::Positive),
            (359.9, Travel::Negative),
            (0.1, Travel::Negative),
            (1.0, Travel::Positive),
            (721.5, Travel::Positive),
            (1.25, Travel::Positive),
            (720.5, Travel::Negative),
        ] {
            assert_eq!(r.update(q, 0.5, 360.0), expected, "{q}");
        }
    }

    #[test]
    fn a_jump_of_half_a_turn_is_a_move() {
        let mut r = Reversal::new();
        for (q, expected) in [
            (0.0, Travel::Unknown),
            (180.0, Travel::Positive),
            (0.0, Travel::Negative),
            (180.125, Travel::Negative),
        ] {
            assert_eq!(r.update(q, 0.5, 360.0), expected, "{q}");
        }
    }

    #[test]
    fn a_direction_that_a_smaller_reversal_threshold_leaves_open_is_unknown_until_the_next_move() {
        for sense in [1.0, -1.0] {
            let mut r = Reversal::new();
            for (q, reversal_threshold) in [(0.0, 10.0), (8.0, 10.0), (5.0, 1.0)] {
                assert_eq!(
                    r.update(sense * q, reversal_threshold, 0.0),
                    Travel::Unknown
                );
            }
            assert_eq!(r.update(sense * 5.75, 1.0, 0.0), Travel::Unknown);
            let travel = r.update(sense * 6.5, 1.0, 0.0);
            let expected = [Travel::Negative, Travel::Positive][usize::from(sense > 0.0)];
            assert_eq!(travel, expected);
        }
    }

    #[test]
    fn while_it_moves_on_only_its_extreme_is_new() {
        for (sense, travel) in [(1.0, Travel::Positive), (-1.0, Travel::Negative)] {
            let mut r = Reversal::new();
            assert_eq!(r.extreme(0.5, 0.0), None);
            r.update(0.0, 0.5, 0.0);
            r.update(10.0 * sense, 0.5, 0.0);
            let extreme = |r: &Reversal, q| {
                // A bounded axis, and an endless one that moved less than half a turn.
                assert_eq!(r.extreme(0.5, 0.0), Some((sense, q, f32::MAX)));
                assert_eq!(r.extreme(0.5, 360.0), Some((sense, q, 90.0)));
                assert_eq!(r.extreme(90.0, 360.0), None);
            };
            extreme(&r, 10.0 * sense);
            r.pass(9.75 * sense);
            extreme(&r, 10.0 * sense);
            for q in [10.0 * sense, 12.0 * sense] {
                r.pass(q);
                assert_eq!(r.travel(), travel);
                extreme(&r, q);
            }
            // Positions in between are not queried: neither a turn nor the old extreme.
            r.pass(90.0 * sense);
            r.pass(170.0 * sense);
            extreme(&r, 170.0 * sense);
            assert_eq!(r.update(200.0 * sense, 0.5, 360.0), travel);
            assert_ne!(r.update(199.0 * sense, 0.5, 360.0), travel);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn jitter_below_the_reversal_threshold_never_changes_the_direction(
            start in -1000.0_f32..1000.0,
            up in any::<bool>(),
            noise in prop::collection::vec(0.0_f32..0.999, 200),
        ) {
            // Peak to peak below 0.999 · h; positions below 1024 round by 3e-5, so h = 0.1 leaves room.
            let h = 0.1;
            let mut r = Reversal::new();
            r.update(start, h, 0.0);
            let end = if up { start + 10.0 } else { start - 10.0 };
            let direction = r.update(end, h, 0.0);
            prop_assert_eq!(direction, if up { Travel::Positive } else { Travel::Negative });
            for n in noise {
                prop_assert_eq!(r.update(end + (n - 0.5) * h * 0.998, h, 0.0), direction);
            }
            // At rest the direction stays unknown.
            let mut r = Reversal::new();
            for n in [0.0, 0.4, 0.998, 0.1] {
                prop_assert_eq!(r.update(start + n * h, h, 0.0), Travel::Unknown);
            }
        }

        #[test]
        fn every_retreat_of_more_than_the_reversal_threshold_changes_it(
            moves in prop::collection::vec(0.109_375_f32..50.0, 1..50),
        ) {
            let mut r = Reversal::new();
            let mut q = 0.0;
            r.update(q, 0.1, 0.0);
            for (k, step) in moves.into_iter().enumerate() {
                q += if k % 2 == 0 { step } else { -step };
                let expected = if k % 2 == 0 { Travel::Positive } else { Travel::Negative };
                prop_assert_eq!(r.update(q, 0.1, 0.0), expected);
            }
        }
    }
}
