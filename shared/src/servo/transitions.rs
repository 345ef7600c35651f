//! Changes other than positions: the period, references, usable inputs, switches, the fade factor.

use super::lane::Step;
use super::period::{LONGEST_PERIOD, PATIENCE, is_period};
use super::state::{Fading, Following, Servo, Values, Waiting};
use crate::description::AUXILIARIES;
use crate::guard::smaller;
use crate::handle::Handle;
use crate::inputs::Inputs;
use crate::status::Conditions;

/// Longest time, s, that passes in one call of [`Servo::pass_time`]: a thousand periods.
const MOST_TIME: f32 = 10.0;

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

    /// Follows the temperatures. If everything else `rests` and all auxiliaries that matter are usable, within their
    /// tables, and, if they are not temperatures, those in use, takes the temperatures and returns true.
    #[inline(never)]
    pub(super) fn follow_auxiliaries(&mut self, inputs: &Inputs<Values<H>>, rests: bool) -> bool {
        let current = self.current.get();
        let reach = current.reach();
        let dt = self.common.dt;
        let free = self.switches != Conditions::default() && self.is_silent();
        let (mut bad, mut beyond, mut bit) = (0, false, 1);
        let states = self.followers.iter_mut().zip(&mut self.followed);
        let all = current.auxiliaries().iter().zip(&reach.ranges);
        for (((follower, followed), &u), (auxiliary, [low, high])) in
            states.zip(&inputs.auxiliaries).zip(all)
        {
            if reach.temperatures & bit != 0 {
                match follower.follow(u, auxiliary, dt, free) {
                    Some(kelvin) => *followed = kelvin,
                    None => bad |= bit,
                }
                beyond |= *followed < *low || *followed > *high;
            }
            bit <<= 1;
        }
        self.bad_temperatures = bad;
        self.beyond = beyond;
        let usable = bad & reach.used_auxiliaries == 0 && !beyond;
        let rests = rests && usable && self.has_lengths(&inputs.auxiliaries);
        if rests {
            self.take_temperatures();
        }
        rests
    }

    /// Time in which nothing is updated, s: temperatures are followed for so long, at most 10 s, and corrections stay as
    /// they are. For a controller that updates the servo while it plans a move, at the periods of that move: what passes in
    /// addition, at standstill or because the move is slower, has to be told.
    pub fn pass_time(&mut self, auxiliaries: &[f32; AUXILIARIES], time: f32) {
        if self.current.get().reach().temperatures == 0 {
            return;
        }
        let inputs = Inputs {
            axes: self.inputs.axes,
            auxiliaries: *auxiliaries,
        };
        let dt = self.common.dt;
        let mut left = if time > 0.0 {
            smaller(time, MOST_TIME)
        } else {
            0.0
        };
        while left > 0.0 {
            self.common.dt = smaller(left, LONGEST_PERIOD);
            left -= LONGEST_PERIOD;
            self.follow_auxiliaries(&inputs, false);
        }
        self.common.dt = dt;
    }

    /// Takes the followed temperatures into the computed correction.
    #[inline(never)]
    pub(super) fn take_temperatures(&mut self) {
        let mut temperatures = self.current.get().reach().temperatures;
        let both = self.inputs.auxiliaries.iter_mut();
        let both = both.zip(&mut self.coming_auxiliaries);
        for ((used, coming), &followed) in both.zip(&self.followed) {
            if temperatures == 0 {
                break;
            }
            if temperatures & 1 != 0 {
                (*used, *coming) = (followed, followed);
            }
            temperatures >>= 1;
        }
    }

    /// Whether the auxiliaries that matter and are not temperatures equal those in use.
    pub(super) fn has_lengths(&self, auxiliaries: &[f32; AUXILIARIES]) -> bool {
        let reach = self.current.get().reach();
        reach.same_lengths(&self.inputs.auxiliaries, auxiliaries)
    }

    /// The fade factor is at rest at 0, so the output does not change now.
    #[inline(never)]
    fn is_silent(&self) -> bool {
        self.factor.at_rest() && self.factor.value() == 0.0
    }

    /// Evaluates the compensation in use.
    #[inline(always)]
    pub(super) fn compute(&mut self) {
        let computed = &mut self.correction.computed;
        (self.current).evaluate_into(&self.inputs, &self.travelling, &self.weights, computed);
    }

    /// An update in which anything may change, except for the limits.
    #[inline(never)]
    pub(super) fn change(&mut self, inputs: &Inputs<Values<H>>, usable: bool, dt: f32) {
        self.begin(inputs, usable, dt);
        self.compute();
        self.fade();
        self.move_factor();
    }

    /// Whether the inputs are followed, the directions of travel, and what is being faded in.
    #[inline(always)]
    fn begin(&mut self, inputs: &Inputs<Values<H>>, usable: bool, dt: f32) {
        let good_period = is_period(dt);
        let silent = self.is_silent();
        if silent {
            self.take_at_zero();
        }
        let (reach, other) = (self.current.get().reach(), self.target().reach());
        let bad = self.bad_temperatures;
        let mut good_auxiliaries = reach.holds_auxiliaries(inputs, bad);
        let (mut used, mut directional) = (reach.used_axes, reach.directional);
        let temperatures = reach.temperatures;
        if !core::ptr::eq(reach, other) {
            good_auxiliaries &= other.holds_auxiliaries(inputs, bad);
            used |= other.used_axes;
            directional |= other.directional;
        }
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
        let freezes = unreferenced || (hold && (silent || self.fault > PATIENCE));
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
        self.common.step = match (was_held, held) {
            (false, true) => Step::Hold,
            (true, false) => Step::Release,
            _ => Step::Nothing,
        };
        if !held {
            self.inputs.axes = inputs.axes;
            if silent {
                self.inputs.auxiliaries = inputs.auxiliaries;
            }
            if temperatures != 0 {
                self.take_temperatures();
            }
            let reverses = self.take_directions(directional);
            if reverses && self.common.step == Step::Nothing {
                self.common.step = Step::Reversal;
            }
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

    /// Advances the fade factor and reports the conditions that hold.
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
        let step = self.common.step != Step::Nothing;
        if step {
            self.lanes.iter_mut().for_each(|lane| lane.look_closely());
            if self.common.step == Step::Reversal {
                let axes = self.current.get().axes();
                for (lane, axis) in self.lanes.iter_mut().zip(axes) {
                    lane.take_reversal(axis);
                }
            }
        }
        let moves = !self.factor.at_rest();
        let held = self.following != Following::Inputs;
        self.at_rest =
            !(moves || fading || waiting || held || step || self.common.ramps) && s == 1.0;

        let conditions = &mut self.correction.status.conditions;
        *conditions |= self.switches;
        conditions.set(Conditions::NOTHING_LOADED, empty);
        conditions.set(Conditions::HELD, held);
        conditions.set(Conditions::FROZEN, self.following == Following::Frozen);
        conditions.set(Conditions::RAMPING, moves);
        conditions.set(Conditions::FADING, fading || waiting);
    }
}
