//! The update while nothing but the positions changes, which is almost always: enabled, everything
//! referenced, nothing fading, and all axes well within travel and bounds.
//!
//! It does what `update_any` does there, to the bit, with a quarter of the instructions. Whatever
//! is not so plain it leaves to that, before anything has changed that may not change twice.

use super::{LONGEST_PERIOD, Servo};
use crate::description::Axis;
use crate::direction::Reversal;
use crate::inputs::Inputs;
use crate::status::Status;

/// One axis: its direction of travel, and where its guard rails cannot act.
#[derive(Clone, Copy)]
pub(super) struct Lane {
    /// No farther than `half` from `middle` (mm or degrees) a correction within its bound cannot
    /// leave the travel, and the position is one that the tables take.
    middle: f32,
    half: f32,
    value_bound: f32,
    rate_bound: f32,
    pub reversal: Reversal,
}

impl Lane {
    pub(super) const fn new() -> Self {
        Self {
            middle: 0.0,
            half: -1.0,
            value_bound: 0.0,
            rate_bound: 0.0,
            reversal: Reversal::new(),
        }
    }

    /// Takes the guard rails from an axis whose tables take positions up to `reach`.
    fn set(&mut self, axis: &Axis, reach: f32) {
        // Generous, so that no rounding here or in the comparison matters.
        const MARGIN: f32 = 1e-6;
        let [low, high] = axis.travel;
        let low = if low < -reach { -reach } else { low };
        let high = if high > reach { reach } else { high };
        let largest = if high > -low { high } else { -low };
        self.middle = 0.5 * low + 0.5 * high;
        self.half = (0.5 * high - 0.5 * low) - axis.value_bound - MARGIN * largest;
        self.value_bound = axis.value_bound;
        self.rate_bound = axis.rate_bound;
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
            let axes = self.current.axes().iter().zip(&self.current.reach.axes);
            for (lane, (axis, &reach)) in self.lanes.iter_mut().zip(axes) {
                lane.set(axis, reach);
            }
        }
    }

    /// The update in the steady state; false if it has to be made by `update_any`.
    #[inline(always)]
    pub(super) fn update_steady(
        &mut self,
        inputs: &Inputs<AXES>,
        referenced: u16,
        dt: f32,
    ) -> bool {
        let good_period = dt > 0.0 && dt <= LONGEST_PERIOD;
        if !self.steady || !good_period || self.current.reach.all_axes & !referenced != 0 {
            return false;
        }
        let mut turns = 0_u32;
        for (lane, &q) in self.lanes.iter_mut().zip(&inputs.axes) {
            // Not-a-number fails the comparison.
            if !(magnitude(q - lane.middle) <= lane.half) {
                return false;
            }
            if !lane.reversal.moves_on(q) {
                turns += 1;
            }
        }
        if turns > 0 {
            self.turn(inputs);
        }
        let computed = &mut self.correction.computed;
        let (travelling, weights) = (&self.travelling, &self.weights);
        self.current
            .evaluate_into(inputs, travelling, weights, computed);
        for ((lane, &last), &dq) in self.lanes.iter().zip(&self.correction.dq).zip(&*computed) {
            let within = magnitude(dq) <= lane.value_bound;
            if !(within && magnitude(dq - last) <= lane.rate_bound * dt) {
                return false;
            }
        }
        self.correction.dq = *computed;
        self.correction.status = Status::default();
        // The auxiliary inputs do not matter, see `settle`.
        self.inputs.axes = inputs.axes;
        self.period = dt;
        true
    }

    /// Follows the axes that do not merely move on in their direction.
    #[inline(never)]
    fn turn(&mut self, inputs: &Inputs<AXES>) {
        let axes = self.current.axes().iter().zip(&self.current.reach.periods);
        let travelling = self.travelling.0.iter_mut().zip(&inputs.axes);
        for ((lane, (axis, &period)), (travel, &q)) in
            self.lanes.iter_mut().zip(axes).zip(travelling)
        {
            *travel = lane.reversal.update(q, axis.hysteresis, period);
        }
    }
}
