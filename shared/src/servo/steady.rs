//! The update while nothing but the positions changes, which is almost always: enabled, everything
//! referenced, nothing fading, and all axes well within travel and bounds.
//!
//! It does what `update_any` does there, to the bit, with far fewer instructions. Whatever is
//! not so plain it leaves to that, before anything has changed that may not change twice.

use super::{LONGEST_PERIOD, Servo};
use crate::description::Axis;
use crate::direction::Reversal;
use crate::inputs::Inputs;
use crate::status::Status;

/// One axis: its direction of travel, and where its guard rails cannot act.
#[derive(Clone, Copy)]
pub(super) struct Lane {
    /// Direction of travel: ±1.
    sense: f32,
    /// The extreme reached in it, times `sense`; infinite where more than this may be new.
    front: f32,
    /// How far it may go on, times `sense`.
    end: f32,
    value_bound: f32,
    /// Largest change in one period.
    most: f32,
    rate_bound: f32,
    /// Between these (mm or degrees) a correction within its bound cannot leave the travel, and
    /// the position is one that the tables take.
    inside: [f32; 2],
    pub reversal: Reversal,
}

impl Lane {
    pub(super) const fn new() -> Self {
        Self {
            sense: 1.0,
            front: f32::INFINITY,
            end: f32::NEG_INFINITY,
            value_bound: 0.0,
            most: 0.0,
            rate_bound: 0.0,
            inside: [0.0; 2],
            reversal: Reversal::new(),
        }
    }

    /// Takes the guard rails from an axis whose tables take positions up to `reach`.
    fn settle(&mut self, axis: &Axis, reach: f32) {
        // Generous, so that no rounding here or in the comparison matters.
        const MARGIN: f32 = 1e-6;
        let [low, high] = axis.travel;
        let low = if low < -reach { -reach } else { low };
        let high = if high > reach { reach } else { high };
        let largest = if high > -low { high } else { -low };
        let margin = axis.value_bound + MARGIN * largest;
        self.inside = [low + margin, high - margin];
        self.value_bound = axis.value_bound;
        self.rate_bound = axis.rate_bound;
        self.watch(axis.period);
    }

    /// Takes direction and extreme from the reversal, if the axis is well inside its travel.
    fn watch(&mut self, period: f32) {
        let [low, high] = self.inside;
        let extreme = self.reversal.extreme(period);
        let extreme = extreme.filter(|(_, q)| *q >= low && *q <= high);
        let (sense, q) = extreme.unwrap_or((1.0, f32::INFINITY));
        self.sense = sense;
        self.front = sense * q;
        self.end = if sense > 0.0 { high } else { -low };
    }

    /// Gives the extreme back to the reversal.
    fn unwatch(&mut self) {
        if self.front < f32::INFINITY {
            self.reversal.moved_on(self.sense * self.front);
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
        if !self.steady.is_nan() {
            self.steady = f32::NAN;
            self.positions = self.inputs.axes;
            for lane in &mut self.lanes {
                lane.unwatch();
            }
        }
    }

    /// After an update: prepares for the next one if it may be steady.
    pub(super) fn settle(&mut self, held: bool) {
        let moving = self.fade.is_some() || self.queued.is_some() || self.weights_wait;
        let in_full = self.factor.at_rest() && self.factor.value() == 1.0;
        let plain = in_full && !self.current.reach.uses_auxiliaries();
        if self.enabled && !self.dry_run && !held && !moving && plain {
            let reach = &self.current.reach;
            let axes = self.current.axes().iter().zip(&reach.axes);
            for (lane, (axis, &reach)) in self.lanes.iter_mut().zip(axes) {
                lane.settle(axis, reach);
            }
            self.keep_pace(self.period);
        }
    }

    /// The period of the updates from now on.
    #[cold]
    fn keep_pace(&mut self, dt: f32) {
        self.steady = dt;
        self.period = dt;
        for lane in &mut self.lanes {
            lane.most = lane.rate_bound * dt;
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
        if dt != self.steady {
            let good_period = dt > 0.0 && dt <= LONGEST_PERIOD;
            if !good_period || self.steady.is_nan() {
                return false;
            }
            self.keep_pace(dt);
        }
        if self.current.reach.all_axes & !referenced != 0 {
            return false;
        }
        let mut turning = 0_u32;
        for (k, (lane, &q)) in self.lanes.iter_mut().zip(&inputs.axes).enumerate() {
            let along = q * lane.sense;
            // Not-a-number fails the comparisons.
            if along >= lane.front && along <= lane.end {
                lane.front = along;
            } else {
                turning |= 1 << k;
            }
        }
        if turning != 0 && !self.turn(inputs, turning) {
            return false;
        }
        let computed = &mut self.correction.computed;
        let (travelling, weights) = (&self.travelling, &self.weights);
        self.current
            .evaluate_into(inputs, travelling, weights, computed);
        for ((lane, &last), &dq) in self.lanes.iter().zip(&self.correction.dq).zip(&*computed) {
            let within = magnitude(dq) <= lane.value_bound;
            if !(within && magnitude(dq - last) <= lane.most) {
                return false;
            }
        }
        self.correction.dq = *computed;
        self.correction.status = Status::default();
        self.inputs = *inputs;
        true
    }

    /// Follows the axes that do not merely move on in their direction; false, and nothing changed,
    /// if one of them is not well inside its travel.
    #[inline(never)]
    fn turn(&mut self, inputs: &Inputs<AXES>, turning: u32) -> bool {
        let turns = |k: usize| turning & (1 << k) != 0;
        let mut all = self.lanes.iter().zip(&inputs.axes).enumerate();
        if all.any(|(k, (lane, &q))| turns(k) && !(q >= lane.inside[0] && q <= lane.inside[1])) {
            return false;
        }
        let axes = self.current.axes();
        let travelling = self.travelling.0.iter_mut().zip(&inputs.axes);
        let lanes = self.lanes.iter_mut().zip(axes).zip(travelling).enumerate();
        for (_, ((lane, axis), (travel, &q))) in lanes.filter(|(k, _)| turns(*k)) {
            lane.unwatch();
            *travel = lane.reversal.update(q, axis.hysteresis, axis.period);
            lane.watch(axis.period);
        }
        true
    }
}
