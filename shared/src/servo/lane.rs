//! One axis of the servo: its direction of travel, its guard rails, and what both are while nothing
//! but its position changes.

use crate::catch_up::{CatchUp, Period};
use crate::description::Axis;
use crate::direction::Reversal;
use crate::guard::{self, larger, smaller};
use crate::inputs::Travel;

/// What lets the short way pass over an axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Watch {
    /// It moves on from its extreme.
    Extreme,
    /// It stays where it is.
    Place,
    /// It may be anywhere: nothing depends on it.
    Anywhere,
}

/// One axis.
// `repr(C)`: what the short way looks at stands in front, where several values are loaded at once.
#[repr(C)]
#[derive(Clone, Copy)]
pub(in crate::servo) struct Lane {
    /// Direction of travel: ±1; 0 where the position does not matter.
    pub sense: f32,
    /// The extreme reached in it, times `sense`; infinite where more than this may be new.
    pub front: f32,
    /// How far it may go on, times `sense`.
    pub end: f32,
    /// Largest correction that no rail can limit; negative near the ends of the travel.
    pub free: f32,
    /// Largest change in one period.
    pub most: f32,
    watch: Watch,
    /// In this period the reversal has been followed already.
    pub turned: bool,
    pub rate_bound: f32,
    /// The rate that is reached in [`RISE`](crate::RISE) seconds.
    rise: f32,
    value_bound: f32,
    travel: [f32; 2],
    hysteresis: f32,
    /// Of an endless axis, otherwise 0.
    period: f32,
    /// How far from 0 it may be.
    reach: f32,
    /// Between these (mm or degrees) a correction within its bound cannot leave the travel.
    inside: [f32; 2],
    /// Where it was last, referenced and within reach: that of the travel.
    position: f32,
    /// That is not where it is now: it has lost its reference since.
    lost: bool,
    /// How far it moved in this period.
    moved: f32,
    /// Near the ends of the travel, where the axis stays: between which corrections these leave, and what they
    /// leave of the correction of this period.
    room: [f32; 2],
    pub goal: f32,
    pub reversal: Reversal,
    pub catch_up: CatchUp,
}

/// What the guard rails let through.
pub(super) struct Passed {
    pub dq: f32,
    pub rate_limited: bool,
    pub travel_limited: bool,
}

impl Lane {
    pub(super) fn new() -> Self {
        Self {
            sense: 1.0,
            front: f32::INFINITY,
            end: f32::NEG_INFINITY,
            free: 0.0,
            most: 0.0,
            watch: Watch::Anywhere,
            turned: false,
            rate_bound: 0.0,
            rise: 0.0,
            value_bound: 0.0,
            travel: [0.0; 2],
            hysteresis: 0.0,
            period: 0.0,
            reach: 0.0,
            inside: [0.0; 2],
            position: 0.0,
            lost: true,
            moved: 0.0,
            room: [0.0; 2],
            goal: 0.0,
            reversal: Reversal::new(),
            catch_up: CatchUp::new(),
        }
    }

    /// Takes in the position of a period.
    ///
    /// An axis that is not referenced may be given any other position: its direction starts anew,
    /// and its travel is that of the last position that counted, until it `returns`.
    #[inline(always)]
    pub(super) fn follow(&mut self, q: f32, referenced: bool, returns: bool) {
        self.moved = 0.0;
        if !referenced {
            self.lost = true;
            self.reversal = Reversal::new();
        } else if q.abs() <= self.reach {
            if self.period != 0.0 || !self.reversal.moves_on(q) {
                self.reversal.update(q, self.hysteresis, self.period);
            }
            if !self.lost {
                self.moved = (q - self.position).abs();
                self.position = q;
            } else if returns {
                self.lost = false;
                self.position = q;
            }
        }
    }

    /// Takes limits from the axis of the compensation in use, and of the one that is being faded in:
    /// the narrower ones. Returns the rate that neither ramp rate nor rate bound exceeds.
    pub(super) fn take(&mut self, axis: &Axis, other: &Axis, reach: f32) -> f32 {
        self.travel = axis.travel;
        self.hysteresis = axis.hysteresis;
        self.period = axis.period;
        self.reach = reach;
        self.value_bound = larger(axis.value_bound, other.value_bound);
        self.rate_bound = smaller(axis.rate_bound, other.rate_bound);
        self.rise = smaller(self.rate_bound, smaller(axis.ramp_rate, other.ramp_rate));
        // Generous, so that no rounding here or in the comparison matters.
        const MARGIN: f32 = 1e-6;
        let [low, high] = self.travel;
        let [from, to] = [larger(low, -reach), smaller(high, reach)];
        let margin = self.value_bound + MARGIN * larger(-from, to);
        self.inside = [from + margin, to - margin];
        self.rise
    }

    /// The larger value bound.
    pub(super) fn value_bound(&self) -> f32 {
        self.value_bound
    }

    /// Where a correction within its bound may be: in the travel, at the last position that counted.
    #[inline(always)]
    pub(super) fn within_travel(&self, dq: f32) -> (f32, bool) {
        let [low, high] = self.inside;
        if self.position >= low && self.position <= high {
            return (dq, false);
        }
        self.near_travel(dq)
    }

    #[inline(never)]
    fn near_travel(&self, dq: f32) -> (f32, bool) {
        guard::within_travel(dq, self.position, self.travel)
    }

    /// The guard rails where the correction cannot simply follow: rate bound, then travel. At the end
    /// of the travel the correction follows the command, at most as fast as the command itself,
    /// and even where the rate bound would not let it.
    #[inline(never)]
    pub(super) fn catch_up(&mut self, p: &Period, limited: bool) -> Passed {
        let reached = self.catch_up.advance(p, self.rise);
        // Coming to rest from a move may lead beyond the value bound, or out of the travel. After a
        // change of compensation the last correction may still be beyond the new bound.
        let bound = larger(self.value_bound, p.last.abs());
        let bounded = guard::bounded(reached, bound);
        let (inside, again) = self.near_travel(bounded);
        let most = larger((reached - p.last).abs(), self.moved);
        let dq = guard::within_reach(inside, p.last, most);
        if dq != reached {
            self.catch_up.displaced(dq, p, self.rise);
        }
        Passed {
            dq,
            rate_limited: dq != p.goal,
            travel_limited: limited | again,
        }
    }

    /// It last moved in direction `travel`, to where it will be seen next.
    pub(super) fn set_travel(&mut self, travel: Travel) {
        self.reversal = Reversal::moved(travel);
    }

    /// Prepares for updates in which nothing but the position changes. `matters`: it is referenced.
    pub(super) fn settle(&mut self, matters: bool) {
        self.watch(self.position, matters);
    }

    /// What the positions after `q` are compared with.
    fn watch(&mut self, q: f32, matters: bool) {
        let [low, high] = self.inside;
        let inside = q >= low && q <= high;
        self.free = if inside { self.value_bound } else { -1.0 };
        self.room = guard::room(q, self.travel);
        if !matters {
            self.watch = Watch::Anywhere;
            // Times 0 all finite positions are 0.
            (self.sense, self.front, self.end) = (0.0, 0.0, 0.0);
            return;
        }
        let extreme = self.reversal.extreme(self.hysteresis, self.period);
        if let Some((sense, front, far)) = extreme
            && front == q
            && inside
        {
            self.watch = Watch::Extreme;
            self.sense = sense;
            self.front = sense * q;
            let end = if sense > 0.0 { high } else { -low };
            self.end = smaller(end, self.front + far);
        } else {
            self.watch = Watch::Place;
            (self.sense, self.front, self.end) = (1.0, q, q);
        }
    }

    /// Follows an axis that does not merely move on; its position is usable. Whether its direction
    /// is another one now.
    pub(super) fn turn(&mut self, q: f32, last: f32) -> bool {
        let before = self.reversal.travel();
        self.unwatch(last);
        let travel = self.reversal.update(q, self.hysteresis, self.period);
        self.turned = true;
        self.watch(q, true);
        travel != before
    }

    /// Whether `q` is a position of this axis.
    pub(super) fn takes(&self, q: f32) -> bool {
        q.abs() <= self.reach
    }

    /// Gives what was watched back. `last`: the position of the last update.
    pub(super) fn unwatch(&mut self, last: f32) {
        if self.watch == Watch::Extreme {
            self.reversal.moved_on(self.sense * self.front);
        }
        if self.watch != Watch::Anywhere {
            self.position = last;
            if !self.turned {
                self.reversal.stands_at(last);
            }
        }
        self.watch = Watch::Anywhere;
    }

    /// Near the ends of the travel: finds what is left of `dq`; false if another bound acts.
    #[inline(always)]
    pub(super) fn near_end(&mut self, dq: f32, last: f32) -> bool {
        self.goal = guard::within_room(dq, self.room).0;
        let near = self.free < 0.0 && dq.abs() <= self.value_bound;
        near && (self.goal - last).abs() <= self.most
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::specimen;

    #[test]
    fn only_near_the_ends_of_the_travel_is_it_compared_with_them() {
        for travel in [[-100.0, 50.0], [-1.0, 1000.0], [20.0, 30.0], [-30.0, -20.0]] {
            for (bound, reach) in [(0.25, f32::MAX), (2.0, f32::MAX), (0.25, 25.0)] {
                let mut axis = specimen::axis(b'X');
                (axis.travel, axis.value_bound) = (travel, bound);
                let mut lane = Lane::new();
                lane.take(&axis, &axis, reach);
                let [low, high] = travel.map(f64::from);
                let [from, to] = lane.inside.map(f64::from);
                let [first, last] = [low.max(-f64::from(reach)), high.min(f64::from(reach))];
                // A millionth of the larger end, and what rounding adds to that.
                let margin = 1.2e-6 * first.abs().max(last.abs());
                let bound = f64::from(bound);
                assert!(
                    from > first + bound && from < first + bound + margin,
                    "{travel:?}"
                );
                assert!(
                    to < last - bound && to > last - bound - margin,
                    "{travel:?}"
                );
            }
        }
    }

    /// Of these limits, where it has come in direction `sense` to `q`.
    fn moved(travel: [f32; 2], period: f32, sense: f32, q: f32) -> Lane {
        let mut axis = specimen::axis(b'X');
        (axis.travel, axis.period, axis.value_bound) = (travel, period, 0.25);
        let mut lane = Lane::new();
        lane.take(&axis, &axis, f32::MAX);
        for q in [q - sense, q] {
            lane.follow(q, true, true);
        }
        lane
    }

    #[test]
    fn an_axis_at_its_extreme_is_watched_as_far_as_nothing_else_acts() {
        for (travel, period, sense, end) in [
            ([-100.0, 50.0], 0.0, 1.0, 50.0),
            ([-100.0, 50.0], 0.0, -1.0, 100.0),
            ([-f32::MAX, f32::MAX], 360.0, 1.0, 100.0),
            ([-f32::MAX, f32::MAX], 360.0, -1.0, 80.0),
        ] {
            let mut lane = moved(travel, period, sense, 10.0);
            lane.settle(true);
            assert!(lane.watch == Watch::Extreme);
            assert_eq!((lane.sense, lane.front), (sense, 10.0 * sense));
            assert_eq!(lane.free, 0.25);
            // The value bound and a millionth of the travel are left free; a quarter of a turn is exact.
            let left = end - lane.end;
            let expected = if period > 0.0 {
                0.0..=0.0
            } else {
                0.25..=0.2502
            };
            assert!(expected.contains(&left), "{left}");
            // Within the hysteresis behind it, and unreferenced.
            lane.unwatch(10.0);
            let behind = 10.0 - 0.005 * sense;
            lane.follow(behind, true, true);
            lane.settle(true);
            assert!(lane.watch == Watch::Place);
            assert_eq!([lane.sense, lane.front, lane.end], [1.0, behind, behind]);
            lane.unwatch(behind);
            lane.settle(false);
            assert!(lane.watch == Watch::Anywhere);
            assert_eq!([lane.sense, lane.front, lane.end], [0.0; 3]);
        }
    }

    #[test]
    fn what_was_watched_is_where_it_came_to() {
        for sense in [1.0, -1.0] {
            let travel = [-f32::MAX, f32::MAX];
            let mut lane = moved(travel, 360.0, sense, 10.0 * sense);
            let before = lane.reversal.travel();
            lane.settle(true);
            // As the short way does.
            lane.front = 95.0;
            lane.unwatch(95.0 * sense);
            assert_eq!(lane.position, 95.0 * sense);
            let extreme = lane.reversal.extreme(0.01, 360.0);
            assert_eq!(extreme, Some((sense, 95.0 * sense, 90.0)));
            // Less than half a turn from there on, and more from where it was.
            lane.follow(195.0 * sense, true, true);
            assert_eq!(lane.reversal.travel(), before);
        }
    }

    #[test]
    fn only_where_no_other_bound_acts_is_the_travel_left_to_the_short_way() {
        let near = |q: f32, dq, last| {
            let mut lane = moved([-100.0, 50.0], 0.0, 1.0, q);
            lane.settle(true);
            lane.most = 0.125;
            let found = lane.near_end(dq, last);
            (found, lane.goal)
        };
        // 0.0625 are left to the end.
        let q = 50.0 - 0.0625;
        assert_eq!(near(q, 0.25, 0.0), (true, 0.0625));
        assert_eq!(near(q, -0.125, 0.0), (true, -0.125));
        assert!(!near(q, 0.5, 0.0).0, "the value bound");
        assert!(!near(q, -0.25, 0.0).0, "the rate bound");
        assert!(!near(0.0, 0.125, 0.0).0, "far from the ends");
    }
}
