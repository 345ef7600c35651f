//! How the correction of one axis returns to its goal after the goal has stepped.

use crate::guard::{bounded, larger};
use crate::pace::{Approach, Pace};

/// One period of one axis, mm or degrees and seconds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Period {
    /// Desired correction.
    pub goal: f32,
    /// Previous correction.
    pub last: f32,
    /// Mean velocity of the correction over the previous period.
    pub velocity: f32,
    /// The goal may have stepped, so it is not followed directly.
    pub step: bool,
    /// With which a step, or what a goal that is too fast leaves, is made up.
    pub acceleration: f32,
    /// Largest speed.
    pub rate: f32,
    /// Like `rate`, until this step is made up, if larger.
    pub faster: f32,
    pub dt: f32,
    /// 1 / dt
    pub frequency: f32,
    /// 1 / dt of the previous period.
    pub last_frequency: f32,
    /// A ramp also moves the goal.
    pub ramps: bool,
}

/// The one bounded follower of an axis: holds, ends of holds, reversals, goals that are too fast and the ends of the
/// travel are all steps of its goal, made up with limits on rate and acceleration. They differ only in these limits
/// ([`Period::acceleration`]); until everything is made up, the sharpest of them hold.
///
/// Inactive while the goal is followed directly. After a step of the goal, or while the goal moves faster than the
/// rate, holds the *remainder* between correction and goal. The remainder starts at the step, with the velocity that
/// the correction had, and is reduced to 0 with bounded acceleration. The goal's own motion is passed through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CatchUp {
    active: bool,
    /// The goal stepped in the previous period, so its velocity is unknown.
    stepped: bool,
    /// Sign of the remainder.
    sense: f32,
    way: Approach,
    pace: Pace,
    /// Speed beyond the rate that is permitted until the steps are made up.
    faster: f32,
    /// Goal of the previous period.
    goal: f32,
    /// Velocity of the correction at the end of the previous period.
    velocity: f32,
}

impl CatchUp {
    pub(crate) fn new() -> Self {
        Self {
            active: false,
            stepped: false,
            sense: 1.0,
            way: Approach::DONE,
            pace: Pace::new(1.0, 1.0),
            faster: 0.0,
            goal: 0.0,
            velocity: 0.0,
        }
    }

    /// Whether the correction differs from the goal.
    #[inline(always)]
    pub(crate) fn is_active(&self) -> bool {
        self.active
    }

    /// The correction for a period in which the goal cannot simply be followed: while this is active, and when the goal
    /// may have stepped or moved faster than the rate.
    #[inline(never)]
    pub(crate) fn advance(&mut self, p: &Period) -> f32 {
        if !self.active {
            self.begin(p);
        } else if p.step {
            self.faster = larger(p.faster, self.faster);
            if p.acceleration > self.pace.acceleration {
                self.pace = Pace::new(p.rate, p.acceleration);
            }
        }
        let rate = larger(p.rate, self.faster);
        self.pace.rate = rate;
        let most = rate * p.dt;
        if !self.active {
            self.active = true;
            let change = p.goal - p.last;
            let jerk = (change - p.velocity * p.dt).abs();
            // Mean velocities of neighbouring periods differ by the acceleration over half of both. The old velocity
            // may return in the next period, and either neighbour may be very short, so only half of this period
            // counts. A ramp, which moves all axes together, is followed as far as its own acceleration permits.
            let shorter = larger(p.last_frequency, p.frequency);
            let other = if p.ramps { 1.0 } else { 0.0 };
            let apart = 0.5 * p.dt * (other + p.dt * shorter);
            let smooth = jerk * shorter <= self.pace.acceleration * apart;
            if change.abs() <= most && smooth {
                // Following the goal directly steps neither position nor velocity.
                self.active = false;
                return p.goal;
            }
            self.velocity = bounded(p.velocity, rate);
            self.goal = p.last;
        }
        let moved = p.goal - self.goal;
        let steps = p.step || moved.abs() > most;
        // During a step the goal is assumed to rest at its new place.
        let own = if steps { 0.0 } else { moved * p.frequency };
        if steps {
            self.set(p.last - p.goal, self.velocity);
        } else if self.stepped {
            self.set(self.sense * self.way.remaining, self.velocity - own);
        }
        self.stepped = steps;
        self.goal = p.goal;
        if self.way.remaining < 0.0 {
            // It could not stop in time.
            self.set(
                self.sense * self.way.remaining,
                -self.sense * self.way.speed,
            );
        }
        self.way.advance(&self.pace, p.dt);
        if self.way.is_done() && !steps && (p.goal - p.last).abs() <= most {
            self.active = false;
            return p.goal;
        }
        let dq = p.goal + self.sense * self.way.remaining;
        self.velocity = own - self.sense * self.way.speed;
        let change = dq - p.last;
        if change.abs() <= most {
            return dq;
        }
        // Goal and remainder both move; together they stay within the rate.
        let dq = p.last + bounded(change, most);
        self.velocity = bounded(change * p.frequency, rate);
        self.set(dq - p.goal, self.velocity - own);
        dq
    }

    /// The correction was forced to `dq`: continue from there.
    pub(crate) fn displaced(&mut self, dq: f32, p: &Period) {
        if dq == p.goal {
            self.active = false;
            return;
        }
        if !self.active {
            self.active = true;
            self.begin(p);
        }
        self.velocity = bounded((dq - p.last) * p.frequency, p.rate);
        self.stepped = true;
        self.goal = p.goal;
        self.set(dq - p.goal, 0.0);
    }

    /// Takes the limits of the first step.
    fn begin(&mut self, p: &Period) {
        self.pace = Pace::new(p.rate, p.acceleration);
        self.faster = p.faster;
    }

    /// Sets the remainder and its velocity.
    fn set(&mut self, remainder: f32, velocity: f32) {
        self.sense = if remainder < 0.0 { -1.0 } else { 1.0 };
        self.way = Approach::from(remainder.abs(), -self.sense * velocity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pace::RISE;

    #[test]
    fn the_rate_bound_holds_to_the_end_of_a_catch_up_of_a_moving_goal() {
        let rate = 1.0;
        for dt in [0.01, 0.003, 0.001] {
            for (step, part) in (1..200).map(|k| (1e-4 * k as f32, 0.005 * k as f32)) {
                let mut way = CatchUp::new();
                let (mut goal, mut last, mut before) = (step, 0.0, 0.0);
                for period in 0..4000 {
                    let now = Period {
                        goal,
                        last,
                        velocity: (last - before) / dt,
                        step: period == 0,
                        acceleration: rate / RISE,
                        rate,
                        faster: 0.0,
                        dt,
                        frequency: 1.0 / dt,
                        last_frequency: 1.0 / dt,
                        ramps: false,
                    };
                    let dq = way.advance(&now);
                    // f32 rounding for positions of a few mm.
                    assert!((dq - last).abs() <= rate * dt + 1e-6, "{step} {part} {dt}");
                    if !way.is_active() {
                        assert_eq!(dq, goal);
                        break;
                    }
                    (before, last) = (last, dq);
                    goal += part * rate * dt;
                }
                // A goal nearly as fast as the rate is reached late.
                assert!(part > 0.9 || !way.is_active(), "{step} {part} {dt}");
            }
        }
    }

    /// A period with the goal at rest at `goal` and a rate of 2 mm/s.
    fn period(goal: f32, last: f32, before: f32) -> Period {
        let dt = 0.001;
        Period {
            goal,
            last,
            velocity: (last - before) / dt,
            step: false,
            acceleration: 0.4 / RISE,
            rate: 2.0,
            faster: 0.0,
            dt,
            frequency: 1.0 / dt,
            last_frequency: 1.0 / dt,
            ramps: false,
        }
    }

    #[test]
    fn both_directions_are_worked_off_alike() {
        for part in [-1.5, -0.5, 0.0, 0.5, 1.5] {
            let mut ways = [CatchUp::new(), CatchUp::new()];
            let (mut goal, mut last, mut before) = (0.25, 0.0, 0.0);
            for k in 0..400 {
                let found = [1.0, -1.0].map(|sense| Period {
                    step: k == 0,
                    ..period(sense * goal, sense * last, sense * before)
                });
                let [up, down] = [0, 1].map(|way| ways[way].advance(&found[way]));
                assert_eq!(up, -down, "{part}, period {k}");
                (before, last) = (last, up);
                // From faster than the rate in one direction to faster than the rate in the other.
                goal += part * 0.002;
            }
        }
    }

    #[test]
    fn what_had_to_be_elsewhere_goes_on_from_there_at_its_speed() {
        let acceleration = 0.4 / RISE;
        for sense in [1.0, -1.0] {
            // Previously followed directly, or still catching up.
            for stepped in [false, true] {
                let mut way = CatchUp::new();
                let (goal, last) = (0.5 * sense, -0.25 * sense);
                if stepped {
                    let begin = Period {
                        step: true,
                        ..period(goal, last, last)
                    };
                    way.advance(&begin);
                }
                assert_eq!(way.is_active(), stepped);
                // At 0.5 mm/s towards the goal.
                let dq = last + 0.0005 * sense;
                way.displaced(dq, &period(goal, last, last));
                assert!(way.is_active());
                let next = way.advance(&period(goal, dq, last));
                let change = (next - dq) / 0.001 - 0.5 * sense;
                // Corrections below 0.5 round by 2⁻²⁶, twice in a speed.
                let rounding = 2.0_f32.powi(-25) / 0.001;
                assert!(change.abs() <= acceleration * 0.001 + rounding, "{change}");
                // At its goal there is nothing left to make up.
                way.displaced(goal, &period(goal, next, dq));
                assert!(!way.is_active());
            }
        }
    }

    #[test]
    fn a_step_within_a_long_period_is_no_jerk_in_a_very_short_one_after_it() {
        let (rate, speed) = (2.0, 0.25_f32);
        let (long, short) = (0.01_f32, 1e-5);
        let acceleration = 0.4 / RISE;
        // Fractions of the acceleration over a long period, towards and away from the goal.
        for part in (-20..=20).map(|k| 0.05 * k as f32) {
            let mut way = CatchUp::new();
            let step = part * acceleration * long * long;
            // The goal has been followed at constant speed.
            let (mut goal, mut last, mut velocity) = (0.0, 0.0, f64::from(speed));
            let mut last_dt = long;
            for (period, dt) in [long, long, short, long, long, short]
                .into_iter()
                .enumerate()
            {
                goal += speed * dt + if period == 1 { step } else { 0.0 };
                let now = Period {
                    goal,
                    last,
                    velocity: velocity as f32,
                    step: period == 1,
                    acceleration,
                    rate,
                    faster: 0.0,
                    dt,
                    frequency: 1.0 / dt,
                    last_frequency: 1.0 / last_dt,
                    ramps: false,
                };
                let dq = if way.is_active() || now.step {
                    way.advance(&now)
                } else {
                    goal
                };
                let reached = (f64::from(dq) - f64::from(last)) / f64::from(dt);
                let most = f64::from(acceleration) * 0.5 * f64::from(dt + last_dt);
                // Positions below 1/64 round by 2⁻³¹: twice in each of two velocities, and as often on the way there.
                let rounding =
                    8.0 * 2.0_f64.powi(-31) / f64::from(if dt < last_dt { dt } else { last_dt });
                assert!(
                    (reached - velocity).abs() <= most * 1.001 + rounding,
                    "{part}, period {period}: {velocity} to {reached}, not {most}"
                );
                (last, velocity, last_dt) = (dq, reached, dt);
            }
        }
    }
}
