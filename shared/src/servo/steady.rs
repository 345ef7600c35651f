//! The update while nothing but the positions changes, which is almost always: enabled, everything
//! that matters referenced, nothing fading or catching up.
//!
//! It does what `update_any` does there, to the bit, with far fewer instructions. Whatever is
//! not so plain it leaves to that, before anything has changed that may not change twice.

use super::period::is_period;
use super::state::{Fading, Servo, Values};
use super::sweep;
use crate::handle::Handle;
use crate::inputs::Inputs;
use crate::status::Status;

/// How far the short way led.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Steady {
    /// To the end.
    Done,
    /// The corrections are evaluated, but a rail acts.
    Computed,
    /// Nowhere.
    No,
}

/// In the mask of turning axes: the period is another one.
const OTHER_PERIOD: u32 = 1 << 31;

impl<H: Handle> Servo<H> {
    /// After a call or an update after which the next one is not like the last.
    #[inline(always)]
    pub(super) fn unsettle(&mut self) {
        if !self.steady.is_nan() {
            self.give_back();
        }
    }

    #[inline(never)]
    fn give_back(&mut self) {
        self.steady = f32::NAN;
        for (lane, &q) in self.lanes.iter_mut().zip(self.inputs.axes.as_ref()) {
            lane.unwatch(q);
            lane.turned = false;
        }
    }

    /// After an update: prepares for the next one if it may be steady.
    pub(super) fn settle(&mut self, referenced: u16) {
        let moving = self.fading != Fading::Nothing || self.queued || self.weights_wait;
        // Then it is enabled, and this is no dry run: the factor would move.
        let in_full = self.factor.at_rest() && self.factor.value() == 1.0;
        let arrived = core::mem::take(&mut self.arrived);
        if self.held || moving || !in_full || arrived {
            return;
        }
        if self.lanes.iter().any(|lane| lane.catch_up.is_active()) {
            return;
        }
        let mut bit = 1;
        for lane in self.lanes.iter_mut() {
            lane.settle(referenced & bit != 0);
            bit <<= 1;
        }
        let reach = self.current.get().reach();
        self.steady_axes = reach.all_axes;
        self.steady_referenced = reach.all_axes & referenced;
        self.steady_auxiliaries = reach.used_auxiliaries != 0;
        self.keep_pace(self.period);
    }

    /// The period of the updates from now on.
    #[cold]
    fn keep_pace(&mut self, dt: f32) {
        self.steady = dt;
        self.take_period(dt);
        for lane in self.lanes.iter_mut() {
            lane.most = lane.rate_bound * dt;
        }
    }

    /// The update in the steady state, as far as it goes.
    #[inline(always)]
    pub(super) fn update_steady(
        &mut self,
        inputs: &Inputs<Values<H>>,
        referenced: u16,
        dt: f32,
    ) -> Steady {
        let mut turning = 0_u32;
        if dt != self.steady {
            if !is_period(dt) || self.steady.is_nan() {
                return Steady::No;
            }
            self.keep_pace(dt);
            turning = OTHER_PERIOD;
        }
        if referenced & self.steady_axes != self.steady_referenced {
            return Steady::No;
        }
        if self.steady_auxiliaries && !self.same_auxiliaries(inputs) {
            return Steady::No;
        }
        turning |= sweep::turning(&mut self.lanes, inputs.axes.as_ref());
        if turning != 0 && !self.turn(inputs, turning) {
            return Steady::No;
        }
        let computed = &mut self.correction.computed;
        let (travelling, weights) = (&self.travelling, &self.weights);
        self.current
            .get()
            .evaluate_into(inputs, travelling, weights, computed);
        let limited = sweep::limited(&self.lanes, self.correction.dq.as_ref(), computed.as_ref());
        if limited != 0 && !self.near_ends(limited) {
            return Steady::Computed;
        }
        self.before = self.correction.dq;
        self.correction.dq = self.correction.computed;
        self.correction.status = Status::default();
        self.inputs.axes = inputs.axes;
        if turning | limited != 0 {
            self.finish(turning, limited);
        }
        Steady::Done
    }

    /// Whether the auxiliaries that matter are those of the last call.
    #[inline(never)]
    fn same_auxiliaries(&self, inputs: &Inputs<Values<H>>) -> bool {
        let reach = self.current.get().reach();
        reach.same_auxiliaries(&self.inputs.auxiliaries, &inputs.auxiliaries)
    }

    /// Follows the axes that do not merely move on in their direction; false if one of them is at
    /// no usable place, or a direction changes that tables depend on.
    #[inline(never)]
    fn turn(&mut self, inputs: &Inputs<Values<H>>, turning: u32) -> bool {
        let turns = |k: usize| turning & (1 << k) != 0;
        let mut all = self.lanes.iter().zip(inputs.axes.as_ref()).enumerate();
        if all.any(|(k, (lane, &q))| turns(k) && !lane.takes(q)) {
            return false;
        }
        let positions = self.inputs.axes.as_ref().iter().zip(inputs.axes.as_ref());
        let lanes = self.lanes.iter_mut().zip(self.travelling.0.as_mut());
        let directional = u32::from(self.current.get().reach().directional);
        let mut steps = false;
        for (k, ((lane, travel), (&last, &q))) in lanes.zip(positions).enumerate() {
            if turns(k) && lane.turn(q, last) {
                if directional & (1 << k) != 0 {
                    steps = true;
                } else {
                    *travel = lane.reversal.travel();
                }
            }
        }
        !steps
    }

    /// Whether the travel is the only rail that can limit these axes.
    #[inline(never)]
    fn near_ends(&mut self, limited: u32) -> bool {
        let (dq, computed) = (
            self.correction.dq.as_ref(),
            self.correction.computed.as_ref(),
        );
        axes(limited).all(|k| {
            let values = dq.get(k).zip(computed.get(k)).zip(self.lanes.get_mut(k));
            values.is_some_and(|((&last, &dq), lane)| lane.near_end(dq, last))
        })
    }

    /// What else there is to do for axes that turned, for those near the ends of their travel, and
    /// after another period.
    #[inline(never)]
    fn finish(&mut self, turning: u32, limited: u32) {
        self.last_frequency = self.frequency;
        for k in axes(turning) {
            if let Some(lane) = self.lanes.get_mut(k) {
                lane.turned = false;
            }
        }
        for k in axes(limited) {
            let values = self.correction.dq.as_mut().get_mut(k);
            if let Some((dq, lane)) = values.zip(self.lanes.get(k)) {
                let ends = *dq != lane.goal;
                *dq = lane.goal;
                self.correction.status.travel_limited |= u16::from(ends) << k;
            }
        }
    }
}

/// The axes in a mask.
fn axes(mut mask: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let k = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (k < u32::BITS).then_some(k as usize)
    })
}
