//! The update in any state.

use super::period::{PATIENCE, is_period};
use super::state::{Fading, Servo, Values};
use crate::catch_up::Period;
use crate::handle::Handle;
use crate::inputs::Inputs;
use crate::status::{Conditions, Correction, Status};

impl<H: Handle> Servo<H> {
    /// `evaluated`: as far as that the corrections are evaluated, but nothing more.
    #[inline(never)]
    pub(super) fn update_any(
        &mut self,
        inputs: &Inputs<Values<H>>,
        referenced: u16,
        evaluated: bool,
    ) {
        self.unsettle();
        let dt = self.asked;
        let mut status = Status::default();
        let conditions = &mut status.conditions;

        let good_period = is_period(dt);
        if good_period {
            self.take_period(dt);
        }
        // In place of a period that cannot be right: the last that could.
        let dt = self.period;
        // At rest at zero nothing that happens now is felt.
        let silent = self.factor.at_rest() && self.factor.value() == 0.0;
        if silent {
            self.take_at_zero();
        }
        let (current, target) = (self.current.get(), self.target());
        let (reach, other) = (current.reach(), target.reach());
        let mut good_auxiliaries = reach.holds_auxiliaries(inputs);
        let (mut used, mut directional) = (reach.used_axes, reach.directional);
        if !core::ptr::eq(reach, other) {
            good_auxiliaries &= other.holds_auxiliaries(inputs);
            used |= other.used_axes;
            directional |= other.directional;
        }
        let good_axes = self.takes_axes(inputs, used | referenced);
        let good_inputs = good_axes && good_auxiliaries;
        let unreferenced = used & !referenced != 0;
        conditions.set(Conditions::UNREFERENCED, unreferenced);

        let hold = !(good_period && good_inputs);
        if hold {
            conditions.set(Conditions::BAD_PERIOD, !good_period);
            conditions.set(Conditions::BAD_INPUT, !good_inputs);
            conditions.set(Conditions::BAD_AUXILIARY, !good_auxiliaries);
        }
        self.fault = if hold { self.fault + dt } else { 0.0 };
        // At rest at zero there is nothing to hold.
        if unreferenced || self.fault > PATIENCE || (hold && silent) {
            self.frozen = true;
        } else if self.frozen && !hold && silent {
            self.frozen = false;
        }
        let held = hold || self.frozen;
        let mut step = self.follow(inputs, referenced, directional, held);
        step |= held != self.held;
        self.held = held;
        let mut given = None;
        if !held {
            self.inputs.axes = inputs.axes;
            given = Some(&inputs.auxiliaries);
            if silent {
                self.inputs.auxiliaries = inputs.auxiliaries;
            }
        }
        let fading = self.fading != Fading::Nothing;
        self.start_fade(inputs, referenced, held);
        let begun = self.fading != Fading::Nothing && !fading;
        status.saturated = self.compute(given, evaluated, begun, dt);
        let up = self.enabled && !self.dry_run && !self.frozen;
        let before = self.factor.value();
        let s = self.factor.advance(up, &self.factor_pace, dt);
        let ramps = s != before || self.fading != Fading::Nothing;
        self.guard(s, step, ramps, &mut status);

        let conditions = &mut status.conditions;
        conditions.set(Conditions::HELD, held);
        conditions.set(Conditions::FROZEN, self.frozen);
        conditions.set(Conditions::RAMPING, !self.factor.at_rest());
        let waiting = self.queued || self.weights_wait;
        conditions.set(
            Conditions::FADING,
            self.fading != Fading::Nothing || waiting,
        );
        conditions.set(Conditions::DISABLED, !self.enabled);
        conditions.set(Conditions::DRY_RUN, self.dry_run);
        self.correction.status = status;
        self.settle(referenced);
    }

    /// Whether all axes are finite, and those that matter (bit 0 is the first) within reach.
    fn takes_axes(&self, inputs: &Inputs<Values<H>>, matters: u16) -> bool {
        let mut bit = 1;
        for (lane, q) in self.lanes.iter().zip(inputs.axes.as_ref()) {
            if !lane.takes(*q) && (matters & bit != 0 || !q.is_finite()) {
                return false;
            }
            bit <<= 1;
        }
        true
    }

    /// Directions of travel and positions; whether tables change with a direction that is new.
    /// `directional`: the axes with such tables, bit 0 is the first.
    fn follow(
        &mut self,
        inputs: &Inputs<Values<H>>,
        referenced: u16,
        directional: u16,
        held: bool,
    ) -> bool {
        let returns = !self.frozen;
        let mut step = false;
        let mut bit = 1;
        let axes = self
            .travelling
            .0
            .as_mut()
            .iter_mut()
            .zip(inputs.axes.as_ref());
        for (lane, (travel, &q)) in self.lanes.iter_mut().zip(axes) {
            lane.follow(q, referenced & bit != 0, returns);
            if !held && lane.reversal.travel() != *travel {
                *travel = lane.reversal.travel();
                step |= directional & bit != 0;
            }
            bit <<= 1;
        }
        step
    }

    /// The common factor and the guard rails. `step`: what is computed may have stepped; `ramps`: the factor
    /// has moved, or something is being faded in.
    fn guard(&mut self, s: f32, step: bool, ramps: bool, status: &mut Status) {
        let Correction { dq, computed, .. } = &mut self.correction;
        let values = dq.as_mut().iter_mut().zip(computed.as_ref());
        let values = values.zip(self.before.as_mut());
        let dt = self.period;
        let mut bit = 1;
        for (lane, ((dq, &computed), before)) in self.lanes.iter_mut().zip(values) {
            let last = *dq;
            let (goal, limited) = lane.within_travel(s * computed);
            let slow = (goal - last).abs() <= lane.rate_bound * dt;
            if slow && !step && !lane.catch_up.is_active() {
                *dq = goal;
                status.travel_limited |= if limited { bit } else { 0 };
            } else {
                let period = Period {
                    goal,
                    last,
                    velocity: (last - *before) * self.last_frequency,
                    step,
                    rate: lane.rate_bound,
                    dt,
                    frequency: self.frequency,
                    last_frequency: self.last_frequency,
                    ramps,
                };
                let passed = lane.catch_up(&period, limited);
                *dq = passed.dq;
                status.rate_limited |= if passed.rate_limited { bit } else { 0 };
                status.travel_limited |= if passed.travel_limited { bit } else { 0 };
            }
            *before = last;
            bit <<= 1;
        }
        self.last_frequency = self.frequency;
    }

    /// The period of the updates from now on.
    pub(super) fn take_period(&mut self, dt: f32) {
        if dt != self.period {
            self.period = dt;
            self.frequency = 1.0 / dt;
        }
    }
}
