//! Moves a value to its target with bounded speed and acceleration, whatever the period of each step.

use crate::guard::{larger, smaller};

/// Time from standstill to full rate, s.
pub const RISE: f32 = 0.05;

/// Limits of an [`Approach`]. The divisions happen here, so that none are needed on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Largest speed, per second.
    pub rate: f32,
    /// Largest acceleration, per second squared.
    pub acceleration: f32,
    /// 1 / (2 · acceleration): v² times this is the braking distance. Slightly enlarged, so that braking can always
    /// make up for what rounding adds to the speed on the way.
    braking: f32,
}

impl Pace {
    /// A speed up to `rate`, reached within [`RISE`] seconds.
    pub(crate) fn rising(rate: f32) -> Self {
        Self::new(rate, rate * (1.0 / RISE))
    }

    /// A speed up to `rate`, with this acceleration.
    pub(crate) fn new(rate: f32, acceleration: f32) -> Self {
        Self {
            rate,
            acceleration,
            braking: 0.5001 / acceleration,
        }
    }
}

/// The remaining distance, and the speed at which it shrinks.
///
/// Each step has constant acceleration from the speed at its start to that at its end (the last step may speed up and
/// slow down within it). So the mean speeds of neighbouring steps differ by no more than the acceleration over half of
/// both, even if their periods differ. A speed is only chosen if it is possible to stop from it, whatever the next
/// periods are, so the approach lands exactly.
///
/// Near the end the remaining distance is small, so f32 resolves it finely enough. `carry` keeps what rounding loses
/// far from the end, so that slow motion in short steps does not stall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approach {
    pub remaining: f32,
    carry: f32,
    /// Speed towards the end, per second; negative while still moving away from it.
    pub speed: f32,
}

impl Approach {
    pub(crate) const DONE: Self = Self::from(0.0, 0.0);

    /// Starts with a speed towards the end.
    pub(crate) const fn from(remaining: f32, speed: f32) -> Self {
        Self {
            remaining,
            carry: 0.0,
            speed,
        }
    }

    pub(crate) fn is_done(&self) -> bool {
        self.remaining == 0.0 && self.speed == 0.0
    }

    /// What rounding has dropped from `remaining`.
    #[cfg(test)]
    pub(crate) fn carried(&self) -> f32 {
        self.carry
    }

    /// The reverse approach over a total distance of 1, including the rounding carry of both.
    pub(crate) fn turned(&self) -> Self {
        let remaining = 1.0 - self.remaining;
        Self {
            remaining,
            carry: (1.0 - remaining - self.remaining) - self.carry,
            speed: -self.speed,
        }
    }

    /// One step of `dt` seconds. If the speed was too high to stop, the remaining distance becomes negative.
    ///
    /// Of the speeds v + a·dt, v + a·dt/4, v and v − a·dt at the end of the step it takes the first from which it can
    /// stop within the remaining distance: v²/2a ≤ remaining.
    pub(crate) fn advance(&mut self, pace: &Pace, dt: f32) {
        let (v, change) = (self.speed, pace.acceleration * dt);
        let half = 0.5 * dt;
        let stops = |next: f32| next * next * pace.braking <= self.remaining - (v + next) * half;
        let slower = larger(v - change, 0.0);
        let next = if v < 0.0 {
            let back = v + change;
            if back <= 0.0 || stops(back) {
                back
            } else {
                0.0
            }
        } else if v > pace.rate {
            larger(slower, pace.rate)
        } else {
            let most = v + change;
            if v <= change {
                // Up to here it speeds up for part of the step and comes to rest at its end.
                let reach = (0.5 * most * most - v * v) * pace.braking;
                let least = v * v * pace.braking;
                if self.remaining <= reach && self.remaining >= 0.999 * least {
                    *self = Self::DONE;
                    return;
                }
            }
            let most = smaller(most, pace.rate);
            let little = v + 0.25 * (most - v);
            if stops(most) {
                most
            } else if stops(little) {
                little
            } else if stops(v) {
                v
            } else {
                slower
            }
        };
        let step = self.carry - (v + next) * half;
        let remaining = self.remaining + step;
        self.carry = step - (remaining - self.remaining);
        self.remaining = remaining;
        self.speed = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Speed after one step of 0.1 s with an acceleration of 1.
    fn after(remaining: f32, speed: f32, rate: f32) -> f32 {
        let mut way = Approach::from(remaining, speed);
        way.advance(&Pace::new(rate, 1.0), 0.1);
        way.speed
    }

    #[test]
    fn it_takes_the_first_of_four_speeds_from_which_it_can_stop() {
        // From 1.1, 1.025 and 1 the braking distances are 0.605, 0.525 and 0.5; the step itself adds 0.105, 0.101 and
        // 0.1.
        for (remaining, expected) in [
            (0.72, 1.1),
            (0.7, 1.025),
            (0.64, 1.025),
            (0.61, 1.0),
            (0.59, 0.9),
        ] {
            let found = after(remaining, 1.0, 10.0);
            assert!((found - expected).abs() < 1e-6, "{remaining}: {found}");
        }
    }

    #[test]
    fn faster_than_its_rate_it_brakes_no_harder_than_it_may() {
        for (speed, expected) in [(3.0, 2.9), (1.15, 1.05), (1.05, 1.0), (1.0, 1.0)] {
            let found = after(100.0, speed, 1.0);
            assert!((found - expected).abs() < 1e-6, "{speed}: {found}");
        }
    }
}
