//! Fades: another compensation, other weights, another tool length.

use super::state::{Fading, Servo, Values, Waiting};
use crate::compensation::Compensation;
use crate::description::AUXILIARIES;
use crate::guard::{self, smaller};
use crate::handle::Handle;
use crate::inputs::Inputs;
use crate::pace::Pace;
use crate::ramp::Ramp;
use crate::room::Room;
use crate::status::Correction;
use crate::weights::Weights;

impl<H: Handle> Servo<H> {
    /// The compensation being faded in, or else the one in use.
    pub(super) fn target(&self) -> &Compensation<'_, H::Room> {
        target(&self.current, &self.other, self.fading).get()
    }

    /// Adopts the limits of the axes of both the compensation in use and one being faded in. The factors move at a rate
    /// that keeps every axis within its ramp rate and rate bound: s moves it by up to its value bound, f in the
    /// worst case from bound to bound, and during a fade each has half of that, because both may move.
    pub(super) fn take_limits(&mut self) {
        let from = self.current.get();
        let to = target(&self.current, &self.other, self.fading).get();
        let (mut factor, mut blend) = (f32::INFINITY, f32::INFINITY);
        let axes = from.axes().iter().zip(to.axes());
        let reaches = from.reach().axes.iter().zip(to.reach().axes.iter());
        let dt = self.common.dt;
        for (lane, ((a, b), (&near, &far))) in self.lanes.iter_mut().zip(axes.zip(reaches)) {
            let rise = lane.take(a, b, smaller(near, far), dt);
            let (one, both) = (lane.value_bound(), a.value_bound + b.value_bound);
            factor = smaller(rise / one, factor);
            blend = smaller(rise / both, blend);
        }
        // An empty compensation has no axes, so nothing moves.
        let pace = |rate: f32| {
            let rate = if rate < f32::INFINITY { rate } else { 1.0 };
            Pace::rising(rate)
        };
        self.factor_pace = pace(if self.fading == Fading::Nothing {
            factor
        } else {
            0.5 * factor
        });
        self.blend_pace = pace(0.5 * blend);
    }

    /// Adopts weights of the compensation accepted last.
    pub(super) fn want(&mut self, weights: Weights) {
        if weights.values() == self.wanted.values() {
            return;
        }
        self.at_rest = false;
        self.wanted = weights;
        // If a compensation is waiting, its weights are adopted together with it.
        if self.waiting != Waiting::Compensation {
            let coming = if self.fading == Fading::Nothing {
                &self.weights
            } else {
                &self.coming
            };
            self.waiting = if coming.values() == self.wanted.values() {
                Waiting::Nothing
            } else {
                Waiting::Weights
            };
        }
    }

    /// While s rests at 0 the output does not change: everything waiting is adopted at once.
    pub(super) fn take_at_zero(&mut self) {
        self.arrive();
        match core::mem::replace(&mut self.waiting, Waiting::Nothing) {
            Waiting::Nothing => {}
            Waiting::Weights => self.weights.take_values(&self.wanted),
            Waiting::Compensation => {
                self.exchange();
                self.weights.take_values(&self.wanted);
                self.take_limits();
            }
        }
    }

    /// Advances a fade, or begins to fade in what is waiting as soon as nothing else is changing; another compensation
    /// only when its inputs are usable and referenced.
    pub(super) fn begin_fade(&mut self, inputs: &Inputs<Values<H>>, held: bool) {
        if self.fading != Fading::Nothing {
            if self.blend.advance(true, &self.blend_pace, self.common.dt) == 1.0 {
                self.arrive();
            }
            return;
        }
        if !self.factor.at_rest() {
            return;
        }
        // A compensation that waits for its inputs keeps no other change from beginning.
        let compensation = self.waiting == Waiting::Compensation;
        if compensation && !held && self.is_ready(inputs) {
            self.start(&inputs.auxiliaries, Fading::Compensation);
        } else if !held && !self.has_lengths(&inputs.auxiliaries) {
            self.start(&inputs.auxiliaries, Fading::Values);
        } else if self.waiting == Waiting::Weights {
            let in_use = self.inputs.auxiliaries;
            self.start(&in_use, Fading::Values);
        }
    }

    /// Whether the inputs of the compensation that waits are usable and referenced.
    fn is_ready(&self, inputs: &Inputs<Values<H>>) -> bool {
        let Some(to) = &self.other else { return false };
        let reach = to.get().reach();
        reach.holds_axes(inputs, self.referenced)
            && reach.holds_auxiliaries(inputs, self.bad_temperatures)
            && reach.used_axes & !self.referenced == 0
    }

    fn start(&mut self, auxiliaries: &[f32; AUXILIARIES], fading: Fading) {
        self.blend = Ramp::ZERO;
        // This is what was waiting, unless another compensation waits: then the requested weights belong to that one.
        if fading == Fading::Values && self.waiting == Waiting::Compensation {
            self.coming.take_values(&self.weights);
        } else {
            self.waiting = Waiting::Nothing;
            self.coming.take_values(&self.wanted);
        }
        self.coming_auxiliaries = *auxiliaries;
        self.take_temperatures();
        self.fading = fading;
        // At rest, so the pace may be lowered.
        self.take_limits();
    }

    /// Makes the faded-in values current.
    fn arrive(&mut self) {
        if self.fading == Fading::Nothing {
            return;
        }
        if self.fading == Fading::Compensation {
            self.exchange();
        }
        self.fading = Fading::Nothing;
        self.weights.take_values(&self.coming);
        self.inputs.auxiliaries = self.coming_auxiliaries;
        // At least as fast as the slower of the two was.
        self.take_limits();
    }

    /// Switches to the other compensation and retires the previous one.
    fn exchange(&mut self) {
        if let Some(other) = &mut self.other {
            core::mem::swap(&mut self.current, other);
            let auxiliaries = self.current.get().auxiliaries();
            for (follower, _) in self.followers.iter_mut().zip(auxiliaries) {
                follower.look_closely();
            }
        }
    }

    /// Blends the values being faded in into the computed correction, each within its value bounds; the limits know
    /// only the larger ones.
    pub(super) fn fade(&mut self) {
        if self.fading == Fading::Nothing {
            return;
        }
        let Correction {
            computed, status, ..
        } = &mut self.correction;
        bound(self.current.get(), computed, &mut status.saturated);
        // In its first period the blend is still 0.
        if self.blend.value() > 0.0 {
            self.blend(self.blend.value());
        }
    }

    /// a + (b − a)·f of the computed correction and the one being faded in.
    fn blend(&mut self, f: f32) {
        let to = target(&self.current, &self.other, self.fading);
        let inputs = Inputs {
            axes: self.inputs.axes,
            auxiliaries: self.coming_auxiliaries,
        };
        // All of it is overwritten; a copy costs less than zeros.
        let mut new = self.correction.computed;
        to.evaluate_into(&inputs, &self.travelling, &self.coming, &mut new);
        bound(to.get(), &mut new, &mut self.correction.status.saturated);
        let both = self
            .correction
            .computed
            .as_mut()
            .iter_mut()
            .zip(new.as_ref());
        for ((computed, new), _) in both.zip(self.lanes.iter()) {
            *computed += (new - *computed) * f;
        }
    }
}

/// The handle being faded in, or else the one in use.
fn target<'h, H: Handle>(current: &'h H, other: &'h Option<H>, fading: Fading) -> &'h H {
    match other {
        Some(other) if fading == Fading::Compensation => other,
        _ => current,
    }
}

/// Limits corrections to the value bounds.
fn bound<C: Room>(
    compensation: &Compensation<'_, C>,
    values: &mut C::Axes<f32>,
    saturated: &mut u16,
) {
    let mut bit = 1;
    for (value, axis) in values.as_mut().iter_mut().zip(compensation.axes()) {
        if value.abs() > axis.value_bound {
            *value = guard::bounded(*value, axis.value_bound);
            *saturated |= bit;
        }
        bit <<= 1;
    }
}
