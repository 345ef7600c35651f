//! One axis of the servo: its direction of travel and its limits.
//!
//! Almost always an axis moves on in its direction, or stands still, far from the ends of its travel, and its
//! correction follows the computed one. A few comparisons detect this: [`Lane::moves_on`] and [`Lane::passes`].
//! Everything else takes the slow path, which also prepares the values for these comparisons.

use super::period::PATIENCE;
use crate::catch_up::{CatchUp, Period};
use crate::description::Axis;
use crate::direction::Reversal;
use crate::guard::{self, larger, smaller};
use crate::inputs::Travel;
use crate::pace::RISE;
use crate::status::Status;

/// Fraction of the length of the travel by which a command may be beyond either end. Farther out it is a fault, because
/// it cannot be intended.
pub const OVERTRAVEL: f32 = 0.1;

/// One axis.
// `repr(C)`: the fields compared in every update come first.
#[repr(C)]
#[derive(Clone, Copy)]
pub(super) struct Lane {
    /// `sense` and `front` are compared with the next command. `sense` is ±1, or 0 if nothing depends on the position
    /// or the direction is unknown; `front` is the position times `sense`.
    sense: f32,
    front: f32,
    /// How far the axis may go on, times `sense`.
    end: f32,
    /// Largest correction that passes: the value bound, or −1 to force the slow path.
    free: f32,
    /// Largest change that passes in one period.
    most: f32,
    /// Mask bit of this axis.
    bit: u16,
    referenced: bool,
    /// The axis has been referenced again since the last position.
    returned: bool,
    rate_bound: f32,
    /// With which a reversal is made up.
    reversal_rate: f32,
    reversal_acceleration: f32,
    value_bound: f32,
    travel: [f32; 2],
    reversal_threshold: f32,
    /// Period of an endless axis, otherwise 0.
    period: f32,
    /// Range of plausible commands.
    reach: [f32; 2],
    /// Between these (mm or degrees), a correction within its bound cannot leave the travel.
    inside: [f32; 2],
    /// Last position while referenced and within reach, used for the travel check. Not updated while the axis moves on.
    position: f32,
    /// Distance moved in this period, near the ends of the travel.
    moved: f32,
    reversal: Reversal,
    catch_up: CatchUp,
}

/// Result of following a command.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Followed {
    /// Only the position has changed.
    Along,
    /// The direction of travel has changed.
    Turned,
    /// The value is not a valid position of this axis.
    Unusable,
}

/// Why the computed correction may have stepped.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// It has not.
    Nothing,
    /// A hold begins.
    Hold,
    /// A hold ends.
    Release,
    /// An axis with directional tables has reversed.
    Reversal,
}

/// Parameters of an update shared by all axes.
pub(super) struct Common {
    /// The fade factor.
    pub s: f32,
    /// Why the computed correction may have stepped.
    pub step: Step,
    /// The fade factor has moved, or a fade is in progress.
    pub ramps: bool,
    /// Last usable period, s.
    pub dt: f32,
    /// 1 / dt
    pub frequency: f32,
    /// 1 / dt of the last update.
    pub last_frequency: f32,
}

impl Followed {
    fn turned(turned: bool) -> Self {
        if turned { Self::Turned } else { Self::Along }
    }
}

impl Common {
    /// Before the first update.
    pub(super) const STILL: Self = Self {
        s: 0.0,
        step: Step::Nothing,
        ramps: false,
        dt: 0.0,
        frequency: 0.0,
        last_frequency: 0.0,
    };
}

impl Lane {
    pub(super) fn new(axis: usize) -> Self {
        Self {
            sense: 0.0,
            front: 1.0,
            end: 0.0,
            free: -1.0,
            most: 0.0,
            bit: 1 << axis,
            referenced: false,
            returned: false,
            rate_bound: 0.0,
            reversal_rate: 0.0,
            reversal_acceleration: 0.0,
            value_bound: 0.0,
            travel: [0.0; 2],
            reversal_threshold: 0.0,
            period: 0.0,
            reach: [0.0; 2],
            inside: [0.0; 2],
            position: 0.0,
            moved: 0.0,
            reversal: Reversal::new(),
            catch_up: CatchUp::new(),
        }
    }

    /// Adopts limits from the axis of the compensation in use and of the one being faded in: the narrower of the two.
    /// `farthest` is the largest permitted distance from 0. Returns the rate that exceeds neither ramp rate nor rate
    /// bound.
    #[inline(always)]
    pub(super) fn take(&mut self, axis: &Axis, other: &Axis, farthest: f32, dt: f32) -> f32 {
        // Its direction, and whether it is within reach, may depend on the limits.
        self.look_closely();
        self.travel = axis.travel;
        self.reversal_threshold = axis.reversal_threshold;
        self.period = axis.period;
        self.value_bound = larger(axis.value_bound, other.value_bound);
        self.rate_bound = smaller(axis.rate_bound, other.rate_bound);
        self.take_period(dt);
        // Halves, because otherwise the length of an endless travel would be infinite.
        let [low, high] = self.travel;
        let beyond = 2.0 * OVERTRAVEL * (0.5 * high - 0.5 * low);
        self.reach = [
            larger(low - beyond, -farthest),
            smaller(high + beyond, farthest),
        ];
        // Large enough that no rounding here or in the comparison matters.
        const MARGIN: f32 = 1e-6;
        let [from, to] = [larger(low, -farthest), smaller(high, farthest)];
        let margin = self.value_bound + MARGIN * larger(-from, to);
        self.inside = [from + margin, to - margin];
        self.prepare_correction();
        smaller(self.rate_bound, smaller(axis.ramp_rate, other.ramp_rate))
    }

    /// Adopts the limits of a reversal from the axis of the compensation in use.
    pub(super) fn take_reversal(&mut self, axis: &Axis) {
        self.reversal_rate = axis.reversal_rate;
        self.reversal_acceleration = axis.reversal_acceleration;
    }

    /// Sets the period of the following updates, s.
    pub(super) fn take_period(&mut self, dt: f32) {
        self.most = self.rate_bound * dt;
    }

    /// The larger value bound.
    pub(super) fn value_bound(&self) -> f32 {
        self.value_bound
    }

    /// Mask bit of this axis.
    pub(super) fn bit(&self) -> u16 {
        self.bit
    }

    /// Direction in which the axis last moved.
    pub(super) fn travelled(&self) -> Travel {
        self.reversal.travel()
    }

    /// States that the axis last moved in direction `travel`, to its next position.
    pub(super) fn set_travel(&mut self, travel: Travel) {
        self.look_closely();
        self.reversal = Reversal::moved(travel);
    }

    /// An axis that is not referenced may be set to any position: its direction starts anew, and the travel check uses
    /// the last valid position until the reference is back.
    pub(super) fn set_referenced(&mut self, referenced: bool) {
        if referenced == self.referenced {
            return;
        }
        self.look_closely();
        self.referenced = referenced;
        self.returned = referenced;
    }

    /// Updates the position.
    fn sync_position(&mut self) {
        if self.sense != 0.0 {
            self.position = self.sense * self.front;
        }
    }

    /// Updates the position and its extreme.
    fn sync(&mut self) {
        if self.sense != 0.0 {
            self.sync_position();
            self.reversal.pass(self.position);
        }
    }

    /// Forces the next command and the next correction onto the slow path.
    pub(super) fn look_closely(&mut self) {
        self.sync();
        // 0 is not beyond 1.
        (self.sense, self.front) = (0.0, 1.0);
        self.free = -1.0;
    }

    /// Follows a command if the axis merely moves on in its direction or stands still; returns whether it did.
    #[inline(always)]
    pub(super) fn moves_on(&mut self, q: f32) -> bool {
        let along = q * self.sense;
        // NaN fails the comparisons.
        if along >= self.front && along <= self.end {
            self.front = along;
            return true;
        }
        false
    }

    /// Follows any command. An unusable one changes nothing.
    #[cold]
    #[inline(never)]
    pub(super) fn follow(&mut self, q: f32) -> Followed {
        self.sync();
        let before = self.reversal.travel();
        let [low, high] = self.reach;
        if !self.referenced {
            self.reversal = Reversal::new();
            // Multiplied by 0, all finite positions are 0.
            (self.sense, self.front, self.end) = (0.0, 0.0, 0.0);
            self.prepare_correction();
            return if q.is_finite() {
                Followed::turned(before != Travel::Unknown)
            } else {
                Followed::Unusable
            };
        }
        if !(q >= low && q <= high) {
            return Followed::Unusable;
        }
        let returned = core::mem::take(&mut self.returned);
        self.moved = if returned {
            0.0
        } else {
            (q - self.position).abs()
        };
        self.position = q;
        let travel = self
            .reversal
            .update(q, self.reversal_threshold, self.period);
        self.prepare();
        Followed::turned(travel != before)
    }

    /// Whether a correction within its bound cannot leave the travel.
    fn is_inside(&self) -> bool {
        let [low, high] = self.inside;
        self.position >= low && self.position <= high
    }

    /// Prepares the comparison values for the next correction.
    fn prepare_correction(&mut self) {
        self.free = if self.is_inside() && !self.catch_up.is_active() {
            // Far from the ends of the travel this does not matter.
            self.moved = 0.0;
            self.value_bound
        } else {
            -1.0
        };
    }

    /// Prepares the comparison values for the next command and the next correction, at a valid position.
    fn prepare(&mut self) {
        self.prepare_correction();
        let q = self.position;
        let extreme = self.reversal.extreme(self.reversal_threshold, self.period);
        (self.sense, self.front, self.end) = match extreme {
            Some((sense, front, far)) if front == q && self.is_inside() => {
                let [low, high] = self.inside;
                let end = if sense > 0.0 { high } else { -low };
                (sense, sense * q, smaller(end, sense * q + far))
            }
            _ => (1.0, q, q),
        };
    }

    /// Whether the correction follows the computed one: no limit acts, and there is nothing to catch up.
    #[inline(always)]
    pub(super) fn passes(&self, computed: f32, goal: f32, last: f32) -> bool {
        (goal - last).abs() <= self.most && computed.abs() <= self.free
    }

    /// The limits: value bound, travel, rate bound, travel again. Limits `computed` to the value bound in place;
    /// `last` and `before` are the last two corrections.
    #[cold]
    #[inline(never)]
    pub(super) fn guard(
        &mut self,
        common: &Common,
        computed: &mut f32,
        [last, before]: [f32; 2],
        status: &mut Status,
    ) -> f32 {
        self.sync_position();
        let bounded = guard::bounded(*computed, self.value_bound);
        if bounded != *computed {
            *computed = bounded;
            status.saturated |= self.bit;
        }
        let (goal, limited) = guard::within_travel(common.s * bounded, self.position, self.travel);
        if limited {
            status.travel_limited |= self.bit;
        }
        let follows = (goal - last).abs() <= self.most && common.step == Step::Nothing;
        if follows && !self.catch_up.is_active() {
            self.moved = 0.0;
            return goal;
        }
        self.catch_up(common, goal, [last, before], status)
    }

    /// The limits where the correction cannot simply follow: rate bound, then travel. At the end of the travel the
    /// correction follows the command, at most as fast as the command itself, even where the rate bound would prevent
    /// it.
    #[inline(never)]
    fn catch_up(
        &mut self,
        common: &Common,
        goal: f32,
        [last, before]: [f32; 2],
        status: &mut Status,
    ) -> f32 {
        let acceleration = match common.step {
            Step::Reversal => self.reversal_acceleration,
            Step::Hold => self.rate_bound * (1.0 / RISE),
            Step::Nothing | Step::Release => self.rate_bound * (1.0 / PATIENCE),
        };
        let reverses = common.step == Step::Reversal;
        let period = Period {
            goal,
            last,
            velocity: (last - before) * common.last_frequency,
            step: common.step != Step::Nothing,
            acceleration,
            rate: self.rate_bound,
            faster: if reverses { self.reversal_rate } else { 0.0 },
            dt: common.dt,
            frequency: common.frequency,
            last_frequency: common.last_frequency,
            ramps: common.ramps,
        };
        let reached = self.catch_up.advance(&period);
        // Stopping after a move may overshoot the value bound or leave the travel. After a change of compensation the
        // last correction may still exceed the new bound.
        let bound = larger(self.value_bound, last.abs());
        let bounded = guard::bounded(reached, bound);
        let (inside, limited) = guard::within_travel(bounded, self.position, self.travel);
        let most = larger((reached - last).abs(), self.moved);
        let dq = guard::within_reach(inside, last, most);
        if dq != reached {
            self.catch_up.displaced(dq, &period);
        }
        if dq != goal {
            status.rate_limited |= self.bit;
        }
        if limited {
            status.travel_limited |= self.bit;
        }
        self.moved = 0.0;
        if dq.abs() > self.value_bound {
            // The distance moved now matters farther inside the travel than usual.
            self.look_closely();
        } else {
            self.prepare_correction();
        }
        dq
    }
}
