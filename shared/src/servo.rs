//! The servo-side state: one compensation in a control loop, with its guard rails and transitions.
//!
//! It uses the commanded positions, a mask of referenced axes and the period of each call, and
//! produces the correction to add to the command. Three layers, from the inside out:
//!
//! 1. *Computed.* The evaluation, each axis within its value bound. While other weights or another
//!    compensation are faded in: a + (b − a)·f of both. While inputs are unusable, those of the
//!    last period in which they were usable count.
//! 2. *Common factor.* All axes times one s(t) between 0 and 1, so that corrections that belong
//!    together stay together. It goes to 0 when disabled, in a dry run, without reference and in
//!    a lasting fault.
//! 3. *Guard rails.* Travel, then rate bound, each axis by itself.
//!
//! What it cannot do: a reversal of a directional table, or a table steeper than the rate bound
//! allows, is a step of the computed correction; the rate bound alone turns it into a slope, and
//! there the ratio between axes is lost until the rest is made up.
//!
//! s and f move at a rate at which no correction within its bound changes faster than the ramp
//! rate (or the rate bound) of its axis; full rate is reached within [`RISE`](crate::RISE). During
//! a cross-fade each of both has half of that, for s may start to move meanwhile.

use core::fmt;

use crate::compensation::Compensation;
use crate::direction::Reversal;
use crate::guard;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::ramp::{Pace, Ramp};
use crate::status::{Conditions, Correction, Status};
use crate::weights::{WeightError, Weights};
use steady::Lane;

/// Longest period of a call, s. Longer ones are a fault: time has been lost.
pub const LONGEST_PERIOD: f32 = 0.01;

/// For so long unusable inputs only hold the correction, s; then it is ramped to zero.
pub const PATIENCE: f32 = 0.01;

/// Why a compensation was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "link", derive(serde::Serialize, serde::Deserialize))]
pub enum Refused {
    /// The change before it is not finished: try again when [`Servo::is_swapping`] is false.
    Busy,
    /// It has other axes (number, order, letters, travel or period).
    Axes,
    /// An auxiliary input has another kind or name.
    Auxiliaries,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Busy => "the previous change of compensation is not finished",
            Self::Axes => "the axes differ in number, order, letter, travel or period",
            Self::Auxiliaries => "an auxiliary input differs in kind or name",
        })
    }
}

impl core::error::Error for Refused {}

/// What is faded in.
struct Fade<C> {
    to: C,
    weights: Weights,
    swap: bool,
}

/// One compensation in a control loop. See the head of `servo.rs` for what it does in which order.
pub struct Servo<
    'a,
    const AXES: usize = 8,
    const TABLES: usize = 96,
    const TERMS: usize = 256,
    const GRIDS: usize = 2,
> {
    current: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>,
    weights: Weights,
    fade: Option<Fade<&'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>>>,
    /// Accepted, waits until nothing else moves.
    queued: Option<&'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>>,
    /// The weights last asked for, of the compensation last accepted.
    wanted: Weights,
    /// `wanted` are not those in use or being faded in.
    weights_wait: bool,
    enabled: bool,
    dry_run: bool,
    /// s(t)
    factor: Ramp,
    factor_pace: Pace,
    /// f(t)
    blend: Ramp,
    blend_pace: Pace,
    /// One per axis.
    lanes: heapless::Vec<Lane, AXES>,
    /// What is computed from: those of the last period that was neither held nor frozen.
    inputs: Inputs<AXES>,
    travelling: Travelling<AXES>,
    /// Last finite positions, for the travel.
    positions: [f32; AXES],
    /// Of the last period.
    correction: Correction<AXES>,
    /// While nothing but the positions changes, the period of the last call, s; otherwise not a
    /// number: see `steady.rs`.
    steady: f32,
    frozen: bool,
    /// For how long inputs have been unusable, s.
    fault: f32,
    /// Last usable period, s.
    period: f32,
}

/// The rate at which a factor from 0 to 1 keeps every axis within its ramp rate and rate bound,
/// where it moves each correction by up to `range` times its value bound.
fn pace<const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>(
    a: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    b: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    range: impl Fn(f32, f32) -> f32,
) -> Pace {
    let slowest = a
        .axes()
        .iter()
        .zip(b.axes())
        .map(|(a, b)| {
            let rate = a.ramp_rate.min(b.ramp_rate);
            let bound = a.rate_bound.min(b.rate_bound);
            rate.min(bound) / range(a.value_bound, b.value_bound)
        })
        .fold(f32::INFINITY, f32::min);
    // An empty compensation has no axes and nothing to move.
    Pace::new(if slowest.is_finite() { slowest } else { 1.0 })
}

impl<'a, const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Servo<'a, AXES, TABLES, TERMS, GRIDS>
{
    /// Disabled, all corrections zero.
    #[must_use]
    pub fn new(compensation: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>) -> Self {
        Self {
            current: compensation,
            weights: compensation.weights(),
            fade: None,
            queued: None,
            wanted: compensation.weights(),
            weights_wait: false,
            enabled: false,
            dry_run: false,
            factor: Ramp::ZERO,
            factor_pace: pace(compensation, compensation, f32::max),
            blend: Ramp::ZERO,
            blend_pace: pace(compensation, compensation, |a, b| a + b),
            lanes: compensation.axes().iter().map(|_| Lane::new()).collect(),
            inputs: Inputs::at([0.0; AXES]),
            travelling: Travelling([Travel::Unknown; AXES]),
            positions: [0.0; AXES],
            correction: Correction {
                dq: [0.0; AXES],
                computed: [0.0; AXES],
                status: Status::default(),
            },
            steady: f32::NAN,
            // Until the first usable inputs.
            frozen: true,
            fault: 0.0,
            period: 0.0,
        }
    }

    /// Lets the corrections in.
    pub fn enable(&mut self) {
        self.enabled = true;
        self.unsettle();
    }

    /// Takes the corrections out.
    pub fn disable(&mut self) {
        self.enabled = false;
        self.unsettle();
    }

    /// Starts or ends a dry run: everything is computed and reported, the output goes to zero.
    pub fn dry_run(&mut self, on: bool) {
        self.dry_run = on;
        self.unsettle();
    }

    /// Fades over to another compensation, with its stored weights, as soon as nothing else moves
    /// and its inputs are usable.
    ///
    /// # Errors
    /// [`Refused`]; nothing changes.
    pub fn swap(
        &mut self,
        to: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>,
    ) -> Result<(), Refused> {
        if self.is_swapping() {
            return Err(Refused::Busy);
        }
        let (old, new) = (self.current.axes(), to.axes());
        let same = |(a, b): (&crate::Axis, &crate::Axis)| {
            a.name == b.name && a.travel == b.travel && a.period == b.period
        };
        if old.len() != new.len() || !old.iter().zip(new).all(same) {
            return Err(Refused::Axes);
        }
        let mut both = self.current.auxiliaries().iter().zip(to.auxiliaries());
        if !both.all(|(a, b)| a.kind == b.kind && a.name == b.name) {
            return Err(Refused::Auxiliaries);
        }
        self.unsettle();
        self.queued = Some(to);
        self.wanted = to.weights();
        self.weights_wait = false;
        Ok(())
    }

    /// Sets the weight of an adjustable term of the compensation last accepted. It is faded in;
    /// weights that are set while others fade in follow together after those.
    ///
    /// # Errors
    /// [`WeightError`]; nothing changes.
    pub fn set_weight(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        self.wanted.set(term, value)?;
        self.unsettle();
        // Of a queued compensation they are taken from `wanted` anyway.
        self.weights_wait |= self.queued.is_none();
        Ok(())
    }

    /// The compensation in use; during a change the old one. Once this returns the new one, the
    /// servo no longer reads the old one.
    #[must_use]
    pub fn compensation(&self) -> &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS> {
        self.current
    }

    /// Whether a change of compensation is waiting or under way.
    #[must_use]
    pub fn is_swapping(&self) -> bool {
        self.queued.is_some() || self.fade.as_ref().is_some_and(|fade| fade.swap)
    }

    /// The common factor s, 0…1.
    #[must_use]
    pub fn factor(&self) -> f32 {
        self.factor.value()
    }

    /// The weights asked for, of the compensation last accepted.
    #[must_use]
    pub fn wanted_weights(&self) -> &Weights {
        &self.wanted
    }

    /// Direction in which each axis last moved.
    #[must_use]
    pub fn travelling(&self) -> Travelling<AXES> {
        let mut travelling = Travelling::default();
        for (travel, lane) in travelling.0.iter_mut().zip(&self.lanes) {
            *travel = lane.reversal.travel();
        }
        travelling
    }

    /// Takes in the state of one servo period and returns the correction for it.
    ///
    /// `inputs`: the uncorrected commands in machine coordinates; `referenced`: bit 0 for the
    /// first axis, cleared while it is not referenced or is homing; `dt`: the period in s.
    ///
    /// # Operations
    /// One evaluation (two while something is faded in), and per axis about 30 operations.
    ///
    /// # Memory
    /// That of [`Compensation::evaluate`], and `12 · AXES` bytes.
    ///
    /// # Timing
    /// While nothing but positions changes and all axes are well within travel and bounds, far
    /// less than otherwise: see `servo/steady.rs`. Without divisions, but for an endless
    /// axis whose position was reduced by a turn, and for a change of compensation in the call
    /// that starts it.
    #[inline]
    pub fn update(&mut self, inputs: &Inputs<AXES>, referenced: u16, dt: f32) -> Correction<AXES> {
        *self.advance(inputs, referenced, dt)
    }

    /// As [`update`](Self::update); the correction stays in its place until the next call, which
    /// saves copying it.
    #[inline(never)]
    pub fn advance(
        &mut self,
        inputs: &Inputs<AXES>,
        referenced: u16,
        dt: f32,
    ) -> &Correction<AXES> {
        if !self.update_steady(inputs, referenced, dt) {
            self.update_any(inputs, referenced, dt);
        }
        &self.correction
    }

    /// The update in any state.
    #[inline(never)]
    fn update_any(&mut self, inputs: &Inputs<AXES>, referenced: u16, dt: f32) {
        self.unsettle();
        let mut status = Status::default();
        let conditions = &mut status.conditions;

        let good_period = dt > 0.0 && dt <= LONGEST_PERIOD;
        if good_period {
            self.period = dt;
        }
        // In place of a period that cannot be right: the last that could.
        let dt = self.period;
        self.schedule(inputs, referenced);
        let target = self.target();
        let good_inputs = self.current.usable(inputs) && target.usable(inputs);
        let used = self.current.reach.used_axes | target.reach.used_axes;
        let unreferenced = used & !referenced != 0;
        conditions.set(Conditions::BAD_PERIOD, !good_period);
        conditions.set(Conditions::BAD_INPUT, !good_inputs);
        conditions.set(Conditions::UNREFERENCED, unreferenced);

        let hold = !(good_period && good_inputs);
        self.fault = if hold { self.fault + dt } else { 0.0 };
        // At rest at zero there is nothing to hold.
        if unreferenced || self.fault > PATIENCE || (hold && self.silent()) {
            self.frozen = true;
        } else if self.frozen && !hold && self.silent() {
            self.frozen = false;
        }
        self.follow(inputs, referenced);
        let held = hold || self.frozen;
        if !held {
            self.inputs = *inputs;
            self.travelling = self.travelling();
        }
        status.saturated = self.compute(dt);
        let up = self.enabled && !self.dry_run && !self.frozen;
        let s = self.factor.advance(up, &self.factor_pace, dt);
        self.guard(s, dt, &mut status);

        let conditions = &mut status.conditions;
        conditions.set(Conditions::HELD, held);
        conditions.set(Conditions::FROZEN, self.frozen);
        conditions.set(Conditions::RAMPING, !self.factor.at_rest());
        let waiting = self.queued.is_some() || self.weights_wait;
        conditions.set(Conditions::FADING, self.fade.is_some() || waiting);
        conditions.set(Conditions::DISABLED, !self.enabled);
        conditions.set(Conditions::DRY_RUN, self.dry_run);
        self.correction.status = status;
        self.settle(held);
    }

    /// What is being faded in, otherwise what is in use.
    fn target(&self) -> &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS> {
        self.fade.as_ref().map_or(self.current, |fade| fade.to)
    }

    /// At rest at zero: nothing that happens now is felt.
    fn silent(&self) -> bool {
        self.factor.at_rest() && self.factor.value() == 0.0
    }

    /// Directions of travel and last finite positions. An axis that is not referenced may be given
    /// another position: its direction starts anew.
    fn follow(&mut self, inputs: &Inputs<AXES>, referenced: u16) {
        let axes = self.current.axes();
        let positions = self.positions.iter_mut().zip(&inputs.axes);
        let all = self.lanes.iter_mut().zip(axes).zip(positions);
        for (k, ((lane, axis), (position, &q))) in all.enumerate() {
            if q.is_finite() {
                *position = q;
            }
            if referenced & (1 << k) == 0 {
                lane.reversal = Reversal::new();
            } else if q.is_finite() {
                lane.reversal.update(q, axis.hysteresis, axis.period);
            }
        }
    }

    /// Starts and ends fades. They end at once while s is 0. Otherwise they start from rest, and
    /// another compensation only when its inputs are usable and referenced.
    fn schedule(&mut self, inputs: &Inputs<AXES>, referenced: u16) {
        let silent = self.silent();
        if silent {
            self.arrive();
        }
        if self.fade.is_some() || !self.factor.at_rest() {
            return;
        }
        match self.queued {
            Some(to) => {
                let ready = to.usable(inputs) && to.reach.used_axes & !referenced == 0;
                if silent || (ready && !self.frozen) {
                    self.queued = None;
                    self.start(to, true);
                }
            }
            None if self.weights_wait => self.start(self.current, false),
            None => {}
        }
        if silent {
            self.arrive();
        }
    }

    fn start(&mut self, to: &'a Compensation<'a, AXES, TABLES, TERMS, GRIDS>, swap: bool) {
        self.weights_wait = false;
        self.blend = Ramp::ZERO;
        // At rest, so that the pace may be lowered.
        self.factor_pace = pace(self.current, to, |a, b| 2.0 * f32::max(a, b));
        self.blend_pace = pace(self.current, to, |a, b| 2.0 * (a + b));
        self.fade = Some(Fade {
            to,
            weights: self.wanted,
            swap,
        });
    }

    /// Makes what is being faded in the current one.
    fn arrive(&mut self) {
        if let Some(fade) = self.fade.take() {
            self.current = fade.to;
            self.weights = fade.weights;
            // At least as fast as the slower of both was.
            self.factor_pace = pace(fade.to, fade.to, f32::max);
        }
    }

    /// The computed correction; returns the mask of saturated axes.
    fn compute(&mut self, dt: f32) -> u16 {
        let (inputs, travel) = (&self.inputs, &self.travelling);
        let mut saturated = 0;
        let old = bounded(self.current, inputs, travel, &self.weights, &mut saturated);
        let Some(fade) = &self.fade else {
            self.correction.computed = old;
            return saturated;
        };
        let new = bounded(fade.to, inputs, travel, &fade.weights, &mut saturated);
        let f = self.blend.advance(true, &self.blend_pace, dt);
        if f == 1.0 {
            self.correction.computed = new;
            self.arrive();
        } else {
            for ((computed, old), new) in self.correction.computed.iter_mut().zip(old).zip(new) {
                *computed = old + (new - old) * f;
            }
        }
        saturated
    }

    /// The common factor and the guard rails.
    fn guard(&mut self, s: f32, dt: f32, status: &mut Status) {
        let axes = self.current.axes().iter().zip(self.target().axes());
        let Correction { dq, computed, .. } = &mut self.correction;
        let values = dq.iter_mut().zip(&*computed).zip(&self.positions);
        for (k, ((axis, other), ((dq, &computed), &q))) in axes.zip(values).enumerate() {
            let rate = if other.rate_bound < axis.rate_bound {
                other.rate_bound
            } else {
                axis.rate_bound
            };
            let passed = guard::pass(s * computed, *dq, q, axis, rate, dt);
            *dq = passed.dq;
            status.rate_limited |= u16::from(passed.rate_limited) << k;
            status.travel_limited |= u16::from(passed.travel_limited) << k;
        }
    }
}

/// The evaluation within the value bounds.
fn bounded<const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>(
    compensation: &Compensation<'_, AXES, TABLES, TERMS, GRIDS>,
    inputs: &Inputs<AXES>,
    travel: &Travelling<AXES>,
    weights: &Weights,
    saturated: &mut u16,
) -> [f32; AXES] {
    let mut values = compensation.evaluate(inputs, travel, weights);
    for (k, (value, axis)) in values.iter_mut().zip(compensation.axes()).enumerate() {
        let (within, acted) = guard::bounded(*value, axis.value_bound);
        *value = within;
        *saturated |= u16::from(acted) << k;
    }
    values
}

mod steady;
#[cfg(all(test, feature = "encode"))]
mod tests;
