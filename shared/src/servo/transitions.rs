//! Changes other than positions: the period, references, usable inputs, switches, the common factor.

use super::period::{LONGEST_PERIOD, PATIENCE, is_period};
use super::state::{Fading, Following, Servo, Values, Waiting};
use crate::description::AUXILIARIES;
use crate::handle::Handle;
use crate::inputs::Inputs;
use crate::status::Conditions;

impl<H: Handle> Servo<H> {
    /// Adopts the period of this update, which differs from the last. If it is too long, the corrections advance by
    /// what the longest permitted period allows; if it is otherwise invalid, by what the last period allowed.
    #[cold]
    pub(super) fn take_period(&mut self, dt: f32) {
        let good = is_period(dt);
        self.at_rest &= good;
        if good || dt > LONGEST_PERIOD {
            let dt = if good { dt } else { LONGEST_PERIOD };
            self.common.dt = dt;
            self.common.frequency = 1.0 / dt;
            self.lanes.iter_mut().for_each(|lane| lane.take_period(dt));
        }
    }

    #[cold]
    pub(super) fn take_references(&mut self, referenced: u16) {
        self.referenced = referenced;
        self.at_rest = false;
        for lane in self.lanes.iter_mut() {
            lane.set_referenced(referenced & lane.bit() != 0);
        }
    }

    /// Whether the auxiliaries that matter, with their lags, equal the adopted ones after a period; only then the lags are
    /// stepped.
    #[inline(always)]
    pub(super) fn keeps_auxiliaries(&mut self, inputs: &Inputs<Values<H>>) -> bool {
        self.current.get().reach().watched_auxiliaries == 0 || self.keeps_watched(inputs)
    }

    /// The same where there are any; not inlined, so that updates without them need no room for the values.
    #[inline(never)]
    fn keeps_watched(&mut self, inputs: &Inputs<Values<H>>) -> bool {
        if self.current.get().reach().lagging == 0 {
            return self.has_auxiliaries(&inputs.auxiliaries);
        }
        let before = self.lags;
        let lagged = self.lagged(inputs);
        let keeps = self.has_auxiliaries(&lagged);
        if !keeps {
            self.lags = before;
        }
        keeps
    }

    /// Whether the auxiliaries that matter equal the adopted ones.
    pub(super) fn has_auxiliaries(&self, auxiliaries: &[f32; AUXILIARIES]) -> bool {
        let reach = self.current.get().reach();
        reach.same_auxiliaries(&self.inputs.auxiliaries, auxiliaries)
    }

    /// Steps the lags by a period, an invalid one by the last valid or the longest. The auxiliaries with their lags.
    #[inline(never)]
    fn lagged(&mut self, inputs: &Inputs<Values<H>>) -> [f32; AUXILIARIES] {
        let (mut values, dt) = (inputs.auxiliaries, self.common.dt);
        let all = self.current.get().auxiliaries().iter();
        for ((value, lag), auxiliary) in values.iter_mut().zip(&mut self.lags).zip(all) {
            if auxiliary.lag_rate > 0.0 {
                *value = lag.follow(*value, auxiliary.lag_rate, dt);
            }
        }
        values
    }

    /// Evaluates the compensation in use.
    #[inline(always)]
    pub(super) fn compute(&mut self) {
        let computed = &mut self.correction.computed;
        (self.current).evaluate_into(&self.inputs, &self.travelling, &self.weights, computed);
    }

    /// An update in which anything may change, except for the guard rails.
    #[inline(never)]
    pub(super) fn change(&mut self, inputs: &Inputs<Values<H>>, usable: bool, dt: f32) {
        let mut inputs = inputs;
        let lagged;
        if self.current.get().reach().lagging != 0 {
            lagged = Inputs {
                axes: inputs.axes,
                auxiliaries: self.lagged(inputs),
            };
            inputs = &lagged;
        }
        self.begin(inputs, usable, dt);
        self.compute();
        self.fade(inputs);
        self.move_factor();
    }

    /// Whether the inputs are followed, the directions of travel, and what is being faded in.
    #[inline(always)]
    fn begin(&mut self, inputs: &Inputs<Values<H>>, usable: bool, dt: f32) {
        let good_period = is_period(dt);
        // At rest at zero, the output does not change now.
        let silent = self.factor.at_rest() && self.factor.value() == 0.0;
        if silent {
            self.take_at_zero();
        }
        let (reach, other) = (self.current.get().reach(), self.target().reach());
        let mut good_auxiliaries = reach.holds_auxiliaries(inputs);
        let (mut used, mut directional) = (reach.used_axes, reach.directional);
        if !core::ptr::eq(reach, other) {
            good_auxiliaries &= other.holds_auxiliaries(inputs);
            used |= other.used_axes;
            directional |= other.directional;
        }
        self.beyond = reach.watched_auxiliaries != 0 && reach.is_beyond(&inputs.auxiliaries);
        let good_inputs = usable && good_auxiliaries;
        let unreferenced = used & !self.referenced != 0;
        let conditions = &mut self.correction.status.conditions;
        conditions.set(Conditions::UNREFERENCED, unreferenced);
        conditions.set(Conditions::BAD_PERIOD, !good_period);
        conditions.set(Conditions::BAD_INPUT, !good_inputs);
        conditions.set(Conditions::BAD_AUXILIARY, !good_auxiliaries);
        conditions.set(Conditions::BEYOND_RANGE, self.beyond);

        let hold = !(good_period && good_inputs);
        // An invalid period counts as the longest permitted one, because its real length is unknown.
        let lasted = if good_period { dt } else { LONGEST_PERIOD };
        self.fault = if hold { self.fault + lasted } else { 0.0 };
        let before = self.following;
        // At rest at zero there is nothing to hold.
        let freezes = unreferenced || self.fault > PATIENCE || (hold && silent);
        let stays = before == Following::Frozen && (hold || !silent);
        self.following = if freezes || stays {
            Following::Frozen
        } else if hold {
            Following::Held
        } else {
            Following::Inputs
        };
        let held = self.following != Following::Inputs;
        let was_held = before != Following::Inputs;
        self.common.holds = held && !was_held;
        self.common.step = held != was_held;
        if !held {
            self.inputs.axes = inputs.axes;
            if silent {
                self.inputs.auxiliaries = inputs.auxiliaries;
            }
            self.common.step |= self.take_directions(directional);
        }
        self.begin_fade(inputs, held);
    }

    /// Updates the directions of travel; returns whether tables change with a new direction. `directional`: the axes
    /// with such tables, bit 0 is the first.
    fn take_directions(&mut self, directional: u16) -> bool {
        let mut step = false;
        let travelling = self.travelling.0.as_mut();
        for (lane, travel) in self.lanes.iter().zip(travelling) {
            if lane.travelled() != *travel {
                *travel = lane.travelled();
                step |= directional & lane.bit() != 0;
            }
        }
        step
    }

    /// Advances the common factor and reports the conditions that hold.
    #[inline(always)]
    fn move_factor(&mut self) {
        let empty = self.lanes.is_empty();
        let up =
            self.switches == Conditions::default() && self.following != Following::Frozen && !empty;
        let before = self.factor.value();
        let s = self.factor.advance(up, &self.factor_pace, self.common.dt);
        let fading = self.fading != Fading::Nothing;
        let waiting = self.waiting != Waiting::Nothing;
        self.common.s = s;
        self.common.ramps = s != before || fading;
        if self.common.step {
            self.lanes.iter_mut().for_each(|lane| lane.look_closely());
        }
        let moves = !self.factor.at_rest();
        let held = self.following != Following::Inputs;
        self.at_rest = s == 1.0
            && !(moves
                || fading
                || waiting
                || held
                || self.beyond
                || self.common.step
                || self.common.ramps);

        let conditions = &mut self.correction.status.conditions;
        *conditions |= self.switches;
        conditions.set(Conditions::NOTHING_LOADED, empty);
        conditions.set(Conditions::HELD, held);
        conditions.set(Conditions::FROZEN, self.following == Following::Frozen);
        conditions.set(Conditions::RAMPING, moves);
        conditions.set(Conditions::FADING, fading || waiting);
    }
}
