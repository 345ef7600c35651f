//! What is faded in: another compensation, other weights, another tool length or temperature.

use super::{Fade, Servo};
use crate::compensation::Compensation;
use crate::description::AUXILIARIES;
use crate::guard;
use crate::inputs::Inputs;
use crate::pace::{Pace, RISE};
use crate::ramp::Ramp;
use crate::weights::Weights;

/// By how many times the larger and the smaller of two value bounds a factor moves a correction.
type Range = [f32; 2];
/// s, while nothing is faded in.
pub(super) const ALONE: Range = [1.0, 0.0];
/// f alone: from one to the other, at the worst from bound to bound.
pub(super) const BLEND: Range = [1.0, 1.0];
/// The same at half of the rate: s may move meanwhile.
const SHARED: Range = [2.0, 0.0];
const SHARED_BLEND: Range = [2.0, 2.0];

/// The rate at which a factor from 0 to 1 keeps every axis within its ramp rate and rate bound.
pub(super) fn pace<
    const AXES: usize,
    const TABLES: usize,
    const TERMS: usize,
    const GRIDS: usize,
>(
    a: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    b: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    range: Range,
) -> Pace {
    let mut slowest = f32::INFINITY;
    for (a, b) in a.axes().iter().zip(b.axes()) {
        let mut rate = a.ramp_rate;
        for other in [b.ramp_rate, a.rate_bound, b.rate_bound] {
            rate = if other < rate { other } else { rate };
        }
        let [larger, smaller] = if a.value_bound > b.value_bound {
            [a.value_bound, b.value_bound]
        } else {
            [b.value_bound, a.value_bound]
        };
        let rate = rate / (range[0] * larger + range[1] * smaller);
        slowest = if rate < slowest { rate } else { slowest };
    }
    // An empty compensation has no axes and nothing to move.
    let rate = if slowest < f32::INFINITY {
        slowest
    } else {
        1.0
    };
    Pace::new(rate, rate)
}

impl<'a, const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Servo<'a, AXES, TABLES, TERMS, GRIDS>
{
    /// What is being faded in, otherwise what is in use.
    pub(super) fn target(&self) -> &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS> {
        self.fade.as_ref().map_or(self.current, |fade| fade.to)
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
        let coming = self
            .fade
            .as_ref()
            .map_or(&self.weights, |fade| &fade.weights);
        self.weights_wait = self.queued.is_none() && coming.values != self.wanted.values;
    }

    /// While s rests at 0 nothing of this is felt: all that waits is taken at once.
    pub(super) fn take_at_zero(&mut self) {
        self.arrive();
        if let Some(to) = self.queued.take() {
            self.current = to;
            self.weights = self.wanted;
            self.factor_pace = pace(to, to, ALONE);
        } else if self.weights_wait {
            self.weights = self.wanted;
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
                    self.start(to, inputs.auxiliaries, true);
                }
            }
            None if self.weights_wait => {
                let auxiliaries = if held {
                    self.inputs.auxiliaries
                } else {
                    inputs.auxiliaries
                };
                self.start(self.current, auxiliaries, false);
            }
            None => {}
        }
    }

    fn start(
        &mut self,
        to: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>,
        auxiliaries: [f32; AUXILIARIES],
        swap: bool,
    ) {
        self.weights_wait = false;
        self.blend = Ramp::ZERO;
        // At rest, so that the pace may be lowered.
        self.factor_pace = pace(self.current, to, SHARED);
        self.blend_pace = pace(self.current, to, SHARED_BLEND);
        self.fade = Some(Fade {
            to,
            weights: self.wanted,
            auxiliaries,
            swap,
        });
    }

    /// Makes what is being faded in the current one.
    fn arrive(&mut self) {
        if let Some(fade) = self.fade.take() {
            self.current = fade.to;
            self.weights = fade.weights;
            self.inputs.auxiliaries = fade.auxiliaries;
            // At least as fast as the slower of both was.
            self.factor_pace = pace(fade.to, fade.to, ALONE);
            self.compare_weights();
        }
    }

    /// The computed correction; returns the mask of saturated axes. `evaluated`: it is there already,
    /// but for the value bounds; nothing is being faded in.
    pub(super) fn compute(&mut self, given: &[f32; AUXILIARIES], evaluated: bool, dt: f32) -> u16 {
        let mut saturated = 0;
        let (inputs, travel) = (&self.inputs, &self.travelling);
        let old = &mut self.correction.computed;
        if !evaluated {
            self.current
                .evaluate_into(inputs, travel, &self.weights, old);
        }
        bound(self.current, old, &mut saturated);
        if self.fade.is_none() {
            let reach = &self.current.reach;
            if reach.same_auxiliaries(&inputs.auxiliaries, given) {
                return saturated;
            }
            if !self.let_in(given, dt, &mut saturated) {
                return saturated;
            }
        }
        self.blend(dt, &mut saturated);
        saturated
    }

    /// Takes other auxiliaries in: at once where they change as slowly as a ramp may begin,
    /// otherwise they are faded in; whether a fade has started.
    #[inline(never)]
    fn let_in(&mut self, given: &[f32; AUXILIARIES], dt: f32, saturated: &mut u16) -> bool {
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
            return false;
        }
        if self.factor.at_rest() {
            self.start(self.current, *given, false);
        }
        self.fade.is_some()
    }

    /// a + (b − a)·f of what was computed and what is being faded in.
    fn blend(&mut self, dt: f32, saturated: &mut u16) {
        let Some(fade) = &self.fade else { return };
        let inputs = Inputs {
            axes: self.inputs.axes,
            auxiliaries: fade.auxiliaries,
        };
        let mut new = [0.0; AXES];
        fade.to
            .evaluate_into(&inputs, &self.travelling, &fade.weights, &mut new);
        bound(fade.to, &mut new, saturated);
        let f = self.blend.advance(true, &self.blend_pace, dt);
        if f == 1.0 {
            self.correction.computed = new;
            self.arrive();
        } else {
            for (computed, new) in self.correction.computed.iter_mut().zip(new) {
                *computed += (new - *computed) * f;
            }
        }
    }
}

/// Keeps corrections within the value bounds.
fn bound<const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>(
    compensation: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    values: &mut [f32; AXES],
    saturated: &mut u16,
) {
    for (k, (value, axis)) in values.iter_mut().zip(compensation.axes()).enumerate() {
        let (within, acted) = guard::bounded(*value, axis.value_bound);
        *value = within;
        *saturated |= u16::from(acted) << k;
    }
}
