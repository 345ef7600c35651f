//! The servo-side state: one compensation in a control loop, with its limits and transitions.
//!
//! It uses the commanded positions, a mask of referenced axes and the period of each call, and produces the correction
//! to add to the command. Three layers, from the inside out:
//!
//! 1. *Computed.* The evaluation, each axis limited to its value bound. While other weights or another compensation are
//!    being faded in: a + (b − a)·f of both. While inputs are unusable, the last usable inputs apply.
//! 2. *Fade factor.* All axes are multiplied by one s(t) between 0 and 1, so that corrections that belong together
//!    stay together. It goes to 0 when disabled, in a dry run, without reference and in a lasting fault.
//! 3. *Limits.* Travel, then rate bound, each axis by itself.
//!
//! Where the computed correction steps (a reversal with directional tables, the start and end of a hold) or moves
//! faster than the rate bound, each axis catches up by itself, with the acceleration of the ramp and no faster than the
//! rate bound: see `catch_up.rs`. The ratio between axes is lost until they have caught up.
//!
//! s and f move at a rate at which no correction within its bound changes faster than the ramp rate (or the rate bound)
//! of its axis; full rate is reached within [`RISE`](crate::RISE). During a cross-fade each of them gets half of that
//! rate, because s may start to move meanwhile.
//!
//! `state.rs` holds the state of a servo, `transitions.rs` handles changes other than positions, `fades.rs` handles
//! fades, `lane.rs` handles one axis.

use crate::compensation::Compensation;
use crate::description::{AUXILIARIES, Auxiliary, Axis};
use crate::handle::Handle;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::room::Row;
use crate::status::{Conditions, Correction, Status};
use crate::weights::{WeightError, Weights};
use lane::Followed;
use state::{Fading, Travels, Values, Waiting};

pub use lane::OVERTRAVEL;
pub use period::{LONGEST_PERIOD, PATIENCE, SHORTEST_PERIOD};
pub use refused::{NotTaken, Refused};
pub use state::Servo;

impl<H: Handle> Servo<H> {
    /// Ramps the corrections in.
    pub fn enable(&mut self) {
        self.switch(Conditions::DISABLED, false);
    }

    /// Ramps the corrections out.
    pub fn disable(&mut self) {
        self.switch(Conditions::DISABLED, true);
    }

    /// Starts or ends a dry run: everything is computed and reported, while the output goes to zero.
    pub fn dry_run(&mut self, on: bool) {
        self.switch(Conditions::DRY_RUN, on);
    }

    fn switch(&mut self, switch: Conditions, on: bool) {
        if self.switches.contains(switch) != on {
            self.switches.0 ^= switch.0;
            self.at_rest = false;
        }
    }

    /// Fades over to another compensation, with its stored weights, as soon as nothing else is changing and its inputs
    /// are usable. If `to` is already in use, only the weights are faded to the stored ones.
    ///
    /// Returns a handle that the servo no longer holds: the previous compensation if it was not [taken
    /// back](Self::take_retired), or `to` if that is already in use.
    ///
    /// # Errors
    /// [`Refused`], together with `to`; nothing changes.
    pub fn swap(&mut self, to: H) -> Result<Option<H>, NotTaken<H>> {
        if let Some(why) = self.refusal(to.get()) {
            return Err(NotTaken { why, handle: to });
        }
        if core::ptr::eq(self.current.get(), to.get()) {
            self.want(to.get().weights());
            return Ok(Some(to));
        }
        self.wanted = to.get().weights();
        self.at_rest = false;
        self.waiting = Waiting::Compensation;
        Ok(self.other.replace(to))
    }

    /// Why this compensation is refused, if it is.
    fn refusal(&self, new: &Compensation<'_, H::Room>) -> Option<Refused> {
        let current = self.current.get();
        let same = |(a, b): (&Axis, &Axis)| {
            a.name == b.name && a.travel == b.travel && a.period == b.period
        };
        let (axes, others) = (current.axes(), new.axes());
        if self.is_swapping() {
            Some(Refused::Busy)
        } else if axes.len() != others.len() || !axes.iter().zip(others).all(same) {
            Some(Refused::Axes)
        } else if !alike(current.auxiliaries(), new.auxiliaries()) {
            Some(Refused::Auxiliaries)
        } else {
            None
        }
    }

    /// The previously used compensation, once the change is complete and the servo no longer reads it. Returned once.
    pub fn take_retired(&mut self) -> Option<H> {
        if self.is_swapping() {
            return None;
        }
        self.other.take()
    }

    /// Sets the weight of an adjustable term of the compensation accepted last. The change is faded in. Weights set
    /// while others are being faded in follow together after those.
    ///
    /// # Errors
    /// [`WeightError`]; nothing changes.
    pub fn set_weight(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        let mut wanted = self.wanted;
        wanted.set(term, value)?;
        self.want(wanted);
        Ok(())
    }

    /// Sets the direction in which an axis last moved, if the controller knows it (homing, for example, ends with a
    /// move in a known direction). Takes effect at the next update if the axis is referenced then; directional tables
    /// come in as after a reversal.
    pub fn set_travel(&mut self, axis: usize, travel: Travel) {
        self.at_rest = false;
        if let Some(lane) = self.lanes.get_mut(axis) {
            lane.set_travel(travel);
        }
    }

    /// The compensation in use; during a change, the old one.
    #[must_use]
    pub fn compensation(&self) -> &Compensation<'_, H::Room> {
        self.current.get()
    }

    /// The handle of the compensation in use. Once this is the new one, the servo no longer reads the old one.
    #[must_use]
    pub fn handle(&self) -> &H {
        &self.current
    }

    /// Whether a change of compensation is waiting or in progress.
    #[must_use]
    pub fn is_swapping(&self) -> bool {
        self.waiting == Waiting::Compensation || self.fading == Fading::Compensation
    }

    /// The fade factor s, 0…1.
    #[must_use]
    pub fn factor(&self) -> f32 {
        self.factor.value()
    }

    /// The requested weights of the compensation accepted last.
    #[must_use]
    pub fn wanted_weights(&self) -> &Weights {
        &self.wanted
    }

    /// Direction in which each axis last moved.
    #[must_use]
    pub fn travelling(&self) -> Travelling<Travels<H>> {
        let mut travelling = Travelling(Travels::<H>::all(Travel::Unknown));
        for (travel, lane) in travelling.0.as_mut().iter_mut().zip(self.lanes.iter()) {
            *travel = lane.travelled();
        }
        travelling
    }

    /// The auxiliaries that the corrections contain: temperatures as they were followed, with their lags.
    #[must_use]
    pub fn auxiliaries(&self) -> &[f32; AUXILIARIES] {
        &self.inputs.auxiliaries
    }

    /// The correction of the last period.
    #[must_use]
    pub fn correction(&self) -> &Correction<Values<H>> {
        &self.correction
    }

    /// Rate of change of each correction in the last period, mm/s or degrees/s. Add it to the velocity of the command
    /// for drives that take velocity feed-forward.
    #[must_use]
    pub fn velocity(&self) -> Values<H> {
        let mut velocity = self.correction.dq;
        for (velocity, before) in velocity.as_mut().iter_mut().zip(self.before.as_ref()) {
            *velocity = (*velocity - before) * self.common.last_frequency;
        }
        velocity
    }

    /// Processes one servo period and returns the correction for it.
    ///
    /// `inputs`: the uncorrected commands in machine coordinates, and auxiliaries as read: temperatures are followed at
    /// the rate and with the lag in the compensation, whose reference is subtracted from them before;
    /// `referenced`: bit 0 for the first axis, cleared while it is not referenced or is homing; `dt`: the period in s.
    ///
    /// # Operations
    /// One evaluation (two during a fade), and about 30 operations per axis.
    ///
    /// # Memory
    /// That of [`Compensation::evaluate`], and `12 · AXES` bytes.
    ///
    /// # Timing
    /// Lowest while only positions change, no axis reverses and none is near the ends of its travel. Divisions occur
    /// only when the period differs from the last one, when an endless axis was reduced by a turn, at the start of a
    /// catch-up, and at the start and end of a fade.
    #[inline]
    pub fn update(
        &mut self,
        inputs: &Inputs<Values<H>>,
        referenced: u16,
        dt: f32,
    ) -> Correction<Values<H>> {
        *self.advance(inputs, referenced, dt)
    }

    /// Like [`update`](Self::update), but the correction stays in place until the next call, which saves a copy.
    ///
    /// Each period takes the same steps: follow the commands, evaluate, apply the limits. Any other activity (a
    /// hold, a ramp, a fade) is handled only if something other than positions changed in this period or was not at
    /// rest in the last one.
    #[inline(never)]
    pub fn advance(
        &mut self,
        inputs: &Inputs<Values<H>>,
        referenced: u16,
        dt: f32,
    ) -> &Correction<Values<H>> {
        if dt != self.common.dt {
            self.take_period(dt);
        }
        if referenced != self.referenced {
            self.take_references(referenced);
        }
        let mut followed = Followed::Along;
        for (lane, &q) in self.lanes.iter_mut().zip(inputs.axes.as_ref()) {
            if !lane.moves_on(q) {
                followed = followed.max(lane.follow(q));
            }
        }
        self.correction.status = Status::default();
        let mut rests = self.at_rest && followed == Followed::Along;
        if self.current.get().reach().watched != 0 {
            rests = self.follow_auxiliaries(inputs, rests);
        }
        if rests {
            self.inputs.axes = inputs.axes;
            self.compute();
        } else {
            self.change(inputs, followed != Followed::Unusable, dt);
        }
        let s = self.common.s;
        let Correction {
            dq,
            computed,
            status,
        } = &mut self.correction;
        let values = dq.as_mut().iter_mut().zip(computed.as_mut());
        let values = values.zip(self.before.as_mut());
        for (lane, ((dq, computed), before)) in self.lanes.iter_mut().zip(values) {
            let (last, goal) = (*dq, s * *computed);
            *dq = if lane.passes(*computed, goal, last) {
                goal
            } else {
                lane.guard(&self.common, computed, [last, *before], status)
            };
            *before = last;
        }
        self.common.last_frequency = self.common.frequency;
        &self.correction
    }
}

/// Whether two lists of auxiliaries mean the same quantities.
fn alike(a: &[Auxiliary], b: &[Auxiliary]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.is_like(b))
}

mod fades;
mod lane;
mod period;
mod place;
mod refused;
mod state;
#[cfg(all(test, feature = "encode"))]
mod tests;
mod transitions;
