//! The update while nothing but the positions changes, which is almost always: enabled, everything
//! referenced, nothing fading, and all axes well within travel and bounds.
//!
//! It does what `update_any` does there, to the bit, with a quarter of the instructions. Whatever
//! is not so plain it leaves to that, before anything has changed that may not change twice.

use super::Servo;
use crate::inputs::Inputs;
use crate::status::Correction;

/// Where the guard rails of an axis cannot act.
#[derive(Clone, Copy)]
pub(super) struct Rail {
    /// No farther than `half` from `middle` (mm or degrees) a correction within its bound cannot
    /// leave the travel, and the position is one that the tables take.
    middle: f32,
    half: f32,
    value_bound: f32,
    rate_bound: f32,
}

impl Rail {
    pub(super) const NONE: Self = Self {
        middle: 0.0,
        half: -1.0,
        value_bound: 0.0,
        rate_bound: 0.0,
    };

    fn new([low, high]: [f32; 2], reach: f32, value_bound: f32, rate_bound: f32) -> Self {
        // Generous, so that no rounding here or in the comparison matters.
        const MARGIN: f32 = 1e-6;
        let low = if low < -reach { -reach } else { low };
        let high = if high > reach { reach } else { high };
        let largest = if high > -low { high } else { -low };
        Self {
            middle: 0.5 * low + 0.5 * high,
            half: (0.5 * high - 0.5 * low) - value_bound - MARGIN * largest,
            value_bound,
            rate_bound,
        }
    }
}

/// |x|
#[inline(always)]
fn magnitude(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7FFF_FFFF)
}

impl<'a, const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Servo<'a, AXES, TABLES, TERMS, GRIDS>
{
    /// After a call or an update after which the next one is not like the last.
    pub(super) fn unsettle(&mut self) {
        if self.steady {
            self.steady = false;
            self.positions = self.inputs.axes;
        }
    }

    /// After an update: whether the next one is to be steady.
    pub(super) fn settle(&mut self, held: bool) {
        let moving = self.fade.is_some() || self.queued.is_some() || self.weights_wait;
        let in_full = self.factor.at_rest() && self.factor.value() == 1.0;
        self.steady = self.enabled
            && !self.dry_run
            && !held
            && !moving
            && in_full
            && !self.current.reach.uses_auxiliaries();
        if self.steady {
            let reach = &self.current.reach;
            for ((rail, axis), &reach) in self
                .rails
                .iter_mut()
                .zip(self.current.axes())
                .zip(&reach.axes)
            {
                *rail = Rail::new(axis.travel, reach, axis.value_bound, axis.rate_bound);
            }
        }
    }

    /// The update in the steady state; false if it has to be made by `update_any`.
    #[inline]
    pub(super) fn update_steady(
        &mut self,
        inputs: &Inputs<AXES>,
        referenced: u16,
        dt: f32,
        correction: &mut Correction<AXES>,
    ) -> bool {
        let count = self.current.axes().len();
        let all = (1_u32 << count) - 1;
        let good_period = dt > 0.0 && dt <= super::LONGEST_PERIOD;
        if !self.steady || !good_period || !u32::from(referenced) & all != 0 {
            return false;
        }
        for (rail, &q) in self.rails.iter().zip(&inputs.axes).take(count) {
            // Not-a-number fails the comparison.
            if !(magnitude(q - rail.middle) <= rail.half) {
                return false;
            }
        }
        let moves = self.reversals.iter_mut().zip(&inputs.axes);
        for (k, (reversal, &q)) in moves.enumerate().take(count) {
            if !reversal.moves_on(q) {
                let axis = &self.current.axes()[k];
                let travel = reversal.update(q, axis.hysteresis, self.current.reach.periods[k]);
                self.travelling.0[k] = travel;
            }
        }
        correction.computed = self
            .current
            .evaluate(inputs, &self.travelling, &self.weights);
        let last = self.rails.iter().zip(&self.dq);
        for ((rail, &last), &dq) in last.zip(&correction.computed).take(count) {
            let within = magnitude(dq) <= rail.value_bound;
            if !(within && magnitude(dq - last) <= rail.rate_bound * dt) {
                return false;
            }
        }
        correction.dq = correction.computed;
        self.dq = correction.computed;
        self.inputs = *inputs;
        self.period = dt;
        true
    }
}
