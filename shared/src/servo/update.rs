//! The update in any state.

use super::{LONGEST_PERIOD, PATIENCE, Servo};
use crate::catch_up::Period;
use crate::inputs::Inputs;
use crate::status::{Conditions, Correction, Status};

impl<const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Servo<'_, AXES, TABLES, TERMS, GRIDS>
{
    /// `evaluated`: as far as that the corrections are evaluated, but nothing more.
    #[inline(never)]
    pub(super) fn update_any(&mut self, inputs: &Inputs<AXES>, referenced: u16, evaluated: bool) {
        self.unsettle();
        let dt = self.asked;
        let mut status = Status::default();
        let conditions = &mut status.conditions;

        let good_period = dt > 0.0 && dt <= LONGEST_PERIOD;
        if good_period {
            self.take_period(dt);
        }
        // In place of a period that cannot be right: the last that could.
        let dt = self.period;
        if self.silent() {
            self.take_at_zero();
        }
        let (current, target) = (self.current, self.target());
        let mut good_axes = current.takes_axes(inputs, referenced);
        let mut good_auxiliaries = current.reach.holds_auxiliaries(inputs);
        let mut used = current.reach.used_axes;
        if !core::ptr::eq(current, target) {
            good_axes &= target.takes_axes(inputs, referenced);
            good_auxiliaries &= target.reach.holds_auxiliaries(inputs);
            used |= target.reach.used_axes;
        }
        let good_inputs = good_axes && good_auxiliaries;
        let unreferenced = used & !referenced != 0;
        conditions.set(Conditions::BAD_PERIOD, !good_period);
        conditions.set(Conditions::BAD_INPUT, !good_inputs);
        conditions.set(Conditions::BAD_AUXILIARY, !good_auxiliaries);
        conditions.set(Conditions::UNREFERENCED, unreferenced);

        let hold = !(good_period && good_inputs);
        self.fault = if hold { self.fault + dt } else { 0.0 };
        // At rest at zero there is nothing to hold.
        if unreferenced || self.fault > PATIENCE || (hold && self.silent()) {
            self.frozen = true;
        } else if self.frozen && !hold && self.silent() {
            self.frozen = false;
        }
        let held = hold || self.frozen;
        let mut step = self.follow(inputs, referenced, held);
        step |= held != self.held;
        self.held = held;
        let mut given = self.inputs.auxiliaries;
        if !held {
            self.inputs.axes = inputs.axes;
            given = inputs.auxiliaries;
            if self.silent() {
                self.inputs.auxiliaries = given;
            }
        }
        self.start_fade(inputs, referenced, held);
        status.saturated = self.compute(&given, evaluated, dt);
        let up = self.enabled && !self.dry_run && !self.frozen;
        let s = self.factor.advance(up, &self.factor_pace, dt);
        self.guard(s, step, &mut status);

        let conditions = &mut status.conditions;
        conditions.set(Conditions::HELD, held);
        conditions.set(Conditions::FROZEN, self.frozen);
        conditions.set(Conditions::RAMPING, !self.factor.at_rest());
        let waiting = self.queued.is_some() || self.weights_wait;
        conditions.set(Conditions::FADING, self.fade.is_some() || waiting);
        conditions.set(Conditions::DISABLED, !self.enabled);
        conditions.set(Conditions::DRY_RUN, self.dry_run);
        self.correction.status = status;
        self.settle(referenced);
    }

    /// At rest at zero: nothing that happens now is felt.
    pub(super) fn silent(&self) -> bool {
        self.factor.at_rest() && self.factor.value() == 0.0
    }

    /// Directions of travel and positions; whether tables change with a direction that is new.
    fn follow(&mut self, inputs: &Inputs<AXES>, referenced: u16, held: bool) -> bool {
        let (current, target) = (self.current, self.target());
        let reaches = current.reach.axes.iter().zip(&target.reach.axes);
        let axes = current.axes().iter().zip(reaches).zip(&inputs.axes);
        let travelling = self.travelling.0.iter_mut();
        let directional = current.reach.directional | target.reach.directional;
        let mut step = false;
        let mut bit = 1;
        for ((lane, travel), ((axis, (&a, &b)), &q)) in
            self.lanes.iter_mut().zip(travelling).zip(axes)
        {
            let reach = if a < b { a } else { b };
            lane.follow(q, referenced & bit != 0, !self.frozen, axis, reach);
            if !held && lane.reversal.travel() != *travel {
                *travel = lane.reversal.travel();
                step |= directional & bit != 0;
            }
            bit <<= 1;
        }
        step
    }

    /// The common factor and the guard rails.
    fn guard(&mut self, s: f32, step: bool, status: &mut Status) {
        let axes = self.current.axes().iter().zip(self.target().axes());
        let Correction { dq, computed, .. } = &mut self.correction;
        let values = dq.iter_mut().zip(&*computed).zip(&mut self.before);
        let mut bit = 1;
        for ((lane, (axis, other)), ((dq, &computed), before)) in
            self.lanes.iter_mut().zip(axes).zip(values)
        {
            let mut period = Period {
                goal: s * computed,
                last: *dq,
                velocity: (*dq - *before) * self.last_frequency,
                step,
                rate: 0.0,
                dt: self.period,
                frequency: self.frequency,
            };
            let passed = lane.pass(axis, other, &mut period);
            *before = *dq;
            *dq = passed.dq;
            status.rate_limited |= if passed.rate_limited { bit } else { 0 };
            status.travel_limited |= if passed.travel_limited { bit } else { 0 };
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
