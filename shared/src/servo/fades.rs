//! What is faded in: another compensation, other weights, another tool length or temperature.

use super::{Fade, Servo};
use crate::compensation::Compensation;
use crate::description::AUXILIARIES;
use crate::guard;
use crate::inputs::Inputs;
use crate::pace::{Pace, RISE};
use crate::ramp::Ramp;
use crate::weights::Weights;

impl<'a, const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Servo<'a, AXES, TABLES, TERMS, GRIDS>
{
    /// What is being faded in, otherwise what is in use.
    pub(super) fn target(&self) -> &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS> {
        self.fade.as_ref().map_or(self.current, |fade| fade.to)
    }

    /// Takes the limits of the axes: of the compensation in use, and of one that is faded in. The
    /// factors move at a rate that keeps every axis within its ramp rate and rate bound: s moves
    /// it by up to its value bound, f at the worst from bound to bound, and during a fade each
    /// has half of that, for both may move.
    pub(super) fn take_limits(
        &mut self,
        to: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>,
        fading: bool,
    ) {
        let from = self.current;
        let (mut factor, mut blend) = (f32::INFINITY, f32::INFINITY);
        let axes = from.axes().iter().zip(to.axes());
        let reaches = from.reach.axes.iter().zip(&to.reach.axes);
        for (lane, ((a, b), (&near, &far))) in self.lanes.iter_mut().zip(axes.zip(reaches)) {
            let rise = lane.take(a, b, if near < far { near } else { far });
            let (one, both) = (lane.value_bound(), a.value_bound + b.value_bound);
            let (s, f) = (rise / one, rise / both);
            factor = if s < factor { s } else { factor };
            blend = if f < blend { f } else { blend };
        }
        // An empty compensation has no axes and nothing to move.
        let pace = |rate: f32| {
            let rate = if rate < f32::INFINITY { rate } else { 1.0 };
            Pace::new(rate, rate)
        };
        self.factor_pace = pace(if fading { 0.5 * factor } else { factor });
        self.blend_pace = pace(0.5 * blend);
    }

    /// Takes weights of the compensation last accepted.
    pub(super) fn want(&mut self, weights: Weights) {
        if weights.values == self.wanted.values {
            return;
        }
        self.unsettle();
        self.wanted = weights;
        self.compare_weights();
    }

    /// Whether other weights wait than those that are in use or being faded in. Of a queued
    /// compensation they are taken from `wanted` anyway.
    fn compare_weights(&mut self) {
        let coming = if self.fade.is_some() {
            &self.coming
        } else {
            &self.weights
        };
        self.weights_wait = self.queued.is_none() && coming.values != self.wanted.values;
    }

    /// While s rests at 0 nothing of this is felt: all that waits is taken at once.
    pub(super) fn take_at_zero(&mut self) {
        self.arrive();
        if let Some(to) = self.queued.take() {
            self.current = to;
            self.weights.values = self.wanted.values;
            self.take_limits(to, false);
        } else if self.weights_wait {
            self.weights.values = self.wanted.values;
            self.weights_wait = false;
        }
    }

    /// Starts to fade in what waits, as soon as nothing else moves: another compensation only when
    /// its inputs are usable and referenced.
    pub(super) fn start_fade(&mut self, inputs: &Inputs<AXES>, referenced: u16, held: bool) {
        if self.fade.is_some() || !self.factor.at_rest() {
            return;
        }
        match self.queued {
            Some(to) => {
                let reach = &to.reach;
                let ready = to.takes_axes(inputs, referenced)
                    && reach.holds_auxiliaries(inputs)
                    && reach.used_axes & !referenced == 0;
                if ready && !held {
                    self.queued = None;
                    self.start(to, &inputs.auxiliaries, true);
                }
            }
            None if self.weights_wait => {
                let in_use = self.inputs.auxiliaries;
                let auxiliaries = if held { &in_use } else { &inputs.auxiliaries };
                self.start(self.current, auxiliaries, false);
            }
            None => {}
        }
    }

    fn start(
        &mut self,
        to: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>,
        auxiliaries: &[f32; AUXILIARIES],
        swap: bool,
    ) {
        self.weights_wait = false;
        self.blend = Ramp::ZERO;
        // At rest, so that the pace may be lowered.
        self.take_limits(to, true);
        self.coming.values = self.wanted.values;
        self.fade = Some(Fade {
            to,
            auxiliaries: *auxiliaries,
            swap,
        });
    }

    /// Makes what is being faded in the current one.
    fn arrive(&mut self) {
        if let Some(fade) = self.fade.take() {
            self.current = fade.to;
            self.weights.values = self.coming.values;
            self.inputs.auxiliaries = fade.auxiliaries;
            // At least as fast as the slower of both was.
            self.take_limits(fade.to, false);
            self.arrived = true;
        }
    }

    /// The computed correction; returns the mask of saturated axes. `given`: the auxiliaries, if they are
    /// usable; `evaluated`: it is there already, but for the value bounds, and nothing is being faded
    /// in; `begun`: a fade has begun in this period.
    pub(super) fn compute(
        &mut self,
        given: Option<&[f32; AUXILIARIES]>,
        evaluated: bool,
        begun: bool,
        dt: f32,
    ) -> u16 {
        let mut f = 0.0;
        if self.fade.is_some() && !begun {
            f = self.blend.advance(true, &self.blend_pace, dt);
            if f == 1.0 {
                self.arrive();
            }
        }
        let mut saturated = 0;
        let (inputs, travel) = (&self.inputs, &self.travelling);
        let old = &mut self.correction.computed;
        if !evaluated {
            self.current
                .evaluate_into(inputs, travel, &self.weights, old);
        }
        bound(self.current, old, &mut saturated);
        if begun {
            // f is 0 in this period.
            return saturated;
        }
        if self.fade.is_some() {
            self.blend(f, &mut saturated);
        } else if let Some(given) = given
            && !self
                .current
                .reach
                .same_auxiliaries(&inputs.auxiliaries, given)
        {
            self.let_in(given, dt, &mut saturated);
        }
        saturated
    }

    /// Takes other auxiliaries in: at once where they change as slowly as a ramp may begin,
    /// otherwise they are faded in from the next period on.
    #[inline(never)]
    fn let_in(&mut self, given: &[f32; AUXILIARIES], dt: f32, saturated: &mut u16) {
        let inputs = Inputs {
            axes: self.inputs.axes,
            auxiliaries: *given,
        };
        let mut new = [0.0; AXES];
        self.current
            .evaluate_into(&inputs, &self.travelling, &self.weights, &mut new);
        let mut acted = 0;
        bound(self.current, &mut new, &mut acted);
        let axes = self.current.axes().iter();
        let mut slow = true;
        for ((axis, old), new) in axes.zip(&self.correction.computed).zip(&new) {
            let rate = if axis.rate_bound < axis.ramp_rate {
                axis.rate_bound
            } else {
                axis.ramp_rate
            };
            let most = rate * (1.0 / RISE) * dt * dt;
            let change = new - old;
            slow &= change <= most && change >= -most;
        }
        if slow {
            self.inputs = inputs;
            self.correction.computed = new;
            *saturated = acted;
        } else if self.factor.at_rest() {
            self.start(self.current, given, false);
        }
    }

    /// a + (b − a)·f of what was computed and what is being faded in.
    fn blend(&mut self, f: f32, saturated: &mut u16) {
        let Some(fade) = &self.fade else { return };
        let inputs = Inputs {
            axes: self.inputs.axes,
            auxiliaries: fade.auxiliaries,
        };
        let mut new = [0.0; AXES];
        fade.to
            .evaluate_into(&inputs, &self.travelling, &self.coming, &mut new);
        bound(fade.to, &mut new, saturated);
        let both = self.correction.computed.iter_mut().zip(&new);
        for ((computed, new), _) in both.zip(&self.lanes) {
            *computed += (new - *computed) * f;
        }
    }
}

/// Keeps corrections within the value bounds.
fn bound<const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>(
    compensation: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    values: &mut [f32; AXES],
    saturated: &mut u16,
) {
    let mut bit = 1;
    for (value, axis) in values.iter_mut().zip(compensation.axes()) {
        if value.abs() > axis.value_bound {
            *value = guard::bounded(*value, axis.value_bound).0;
            *saturated |= bit;
        }
        bit <<= 1;
    }
}
