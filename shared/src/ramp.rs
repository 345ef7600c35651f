//! The factor s(t) between 0 and 1 by which all corrections move together in a transition.

/// Seconds from standstill to the full rate.
pub const RISE: f32 = 0.05;

/// How fast a [`Ramp`] may move. The divisions are here, so that none are in the ramp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pace {
    /// Largest |ds/dt|, 1/s.
    rate: f32,
    /// Largest |d²s/dt²|, 1/s².
    acceleration: f32,
    /// 1 / (2 · acceleration): v² times this is the way to stand still.
    braking: f32,
}

impl Pace {
    pub(crate) fn new(rate: f32) -> Self {
        Self {
            rate,
            acceleration: rate / RISE,
            braking: RISE / (2.0 * rate),
        }
    }

    #[cfg(test)]
    pub(crate) fn acceleration(&self) -> f32 {
        self.acceleration
    }
}

/// s(t), on its way to 0 or to 1 with bounded rate and acceleration; it lands exactly, also when
/// the period varies from call to call and when the target changes on the way.
///
/// The state is the *remaining* way: near its end it is small and therefore fine enough in f32
/// to be halved further; `carry` keeps what its rounding loses far from the end, so that slow
/// ramps at high servo rates do not stand still.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    up: bool,
    remaining: f32,
    carry: f32,
    /// Towards the target, 1/s; negative while it still moves away after a change of target.
    speed: f32,
}

impl Ramp {
    /// At rest at 0.
    pub(crate) const ZERO: Self = Self {
        up: false,
        remaining: 0.0,
        carry: 0.0,
        speed: 0.0,
    };

    /// s, within 0…1.
    pub(crate) fn value(&self) -> f32 {
        if self.up {
            1.0 - self.remaining
        } else {
            self.remaining
        }
    }

    pub(crate) fn at_rest(&self) -> bool {
        self.remaining == 0.0 && self.speed == 0.0
    }

    /// Moves on by `dt` seconds towards 1 (`up`) or 0 and returns s.
    ///
    /// While it moves the pace may be raised, not lowered.
    ///
    /// It may run at v if it can still stop afterwards: v·dt + v²/2a ≤ remaining. Of v + a·dt, v
    /// and v − a·dt the first that may is taken; if the current v could stop before, the last can.
    pub(crate) fn advance(&mut self, up: bool, pace: &Pace, dt: f32) -> f32 {
        if up != self.up {
            self.up = up;
            self.remaining = 1.0 - self.remaining;
            self.carry = -self.carry;
            self.speed = -self.speed;
        }
        if self.remaining <= 0.0 {
            (self.remaining, self.carry, self.speed) = (0.0, 0.0, 0.0);
            return self.value();
        }
        let change = pace.acceleration * dt;
        let stops = |v: f32, remaining: f32| v * dt + v * v * pace.braking <= remaining;
        let v = self.speed;
        let speed = if v < 0.0 {
            let slower = v + change;
            if slower < 0.0 { slower } else { 0.0 }
        } else if v <= change && self.remaining <= change * dt {
            // Lands within this period, at no more than `change`. That is kept as the speed: if
            // the target changes now, it is braked before the way back begins.
            (self.remaining, self.carry, self.speed) = (0.0, 0.0, change);
            return self.value();
        } else {
            let faster = v + change;
            let faster = if faster < pace.rate {
                faster
            } else {
                pace.rate
            };
            if stops(faster, self.remaining) {
                faster
            } else if stops(v, self.remaining) {
                v
            } else {
                // Never quite to rest before the landing.
                let slower = v - change;
                let creep = 0.5 * change;
                if slower > creep { slower } else { creep }
            }
        };
        self.speed = speed;
        let step = self.carry - speed * dt;
        let remaining = self.remaining + step;
        self.carry = step - (remaining - self.remaining);
        self.remaining = remaining;
        if remaining <= 0.0 {
            (self.remaining, self.carry) = (0.0, 0.0);
        } else if remaining > 1.0 {
            (self.remaining, self.carry) = (1.0, 0.0);
        }
        self.value()
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_ramp_lands_exactly_and_in_time() {
        for rate in [0.001, 0.1, 1.0, 5.0, 20.0, 100.0] {
            for dt in [1e-5, 1e-4, 1e-3, 1e-2_f32] {
                let pace = Pace::new(rate);
                let mut ramp = Ramp::ZERO;
                // At full rate 1/rate, the rise and the braking add half a RISE each; where the
                // full rate is not reached, two halves of 2·√(1/a). Creeping adds a few periods.
                let full = 1.0 / rate + RISE;
                let bound = full.max(2.0 * (RISE / rate).sqrt()) * 1.01 + 12.0 * dt;
                for up in [true, false] {
                    let mut steps = 0;
                    while !(ramp.at_rest() && ramp.value() == f32::from(u8::from(up))) {
                        ramp.advance(up, &pace, dt);
                        steps += 1;
                        assert!(
                            f64::from(steps) * f64::from(dt) <= f64::from(bound),
                            "rate {rate}, period {dt}: at {}",
                            ramp.value()
                        );
                    }
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn rate_and_acceleration_stay_within_their_bounds(
            rate in 0.1875_f32..50.0,
            base in 1.0 / 16384.0_f32..0.01,
            plan in prop::collection::vec((any::<bool>(), 1_usize..400, 0.25_f32..1.0), 1..12),
        ) {
            let pace = Pace::new(rate);
            let mut ramp = Ramp::ZERO;
            let mut value = 0.0_f64;
            let mut speed = 0.0_f64;
            let mut last_dt = base;
            let dts: Vec<f32> = plan.iter().map(|p| base * p.2).collect();
            for (leg, (up, steps, _)) in plan.into_iter().enumerate() {
                for step in 0..steps {
                    // The period changes within a leg too.
                    let dt = if step % 3 == 0 { base } else { dts[leg] };
                    let s = f64::from(ramp.advance(up, &pace, dt));
                    prop_assert!((0.0..=1.0).contains(&s));
                    let now = (s - value) / f64::from(dt);
                    // The remaining way rounds by up to 2⁻²⁵, s = 1 − it once more, and a difference
                    // has two of them.
                    let rounding = 2.0_f64.powi(-23) / f64::from(dt.min(last_dt));
                    prop_assert!(now.abs() <= f64::from(rate) * (1.0 + 1e-6) + rounding);
                    let change = f64::from(pace.acceleration()) * f64::from(dt.max(last_dt));
                    prop_assert!(
                        (now - speed).abs() <= change * (1.0 + 1e-5) + 2.0 * rounding,
                        "from {} to {} by more than {}", speed, now, change
                    );
                    (value, speed, last_dt) = (s, now, dt);
                }
            }
        }
    }
}
