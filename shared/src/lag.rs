//! Temperature inputs: readings are followed at a bounded rate, and machine parts follow the temperature of a sensor with
//! a first-order lag.
//!
//! dy/dt = (u − y)/τ, stepped once per update. τ can be hours and a period 50 µs: an increment is then 1e-9 of the
//! difference, which f32 would lose. The states are therefore integers. `docs/src/format.md` is normative.

use crate::access;
use crate::description::{Auxiliary, Sensor};

/// Temperatures are rounded to multiples of this, 2⁻¹⁷ K: 0.2 nm at 20 µm/K.
const STEP: f32 = 1.0 / 131_072.0;
/// 1 / [`STEP`]
const PER_KELVIN: f32 = 131_072.0;
/// Readings beyond this (K) count as this, so that differences of states fit into an integer.
const MOST: f32 = 4096.0;

/// A temperature in 2⁻⁴⁸ K.
type State = i64;

/// The reading `u` (K, finite) in steps.
#[inline(always)]
fn steps(u: f32) -> i32 {
    let u = if u < MOST { u } else { MOST };
    let u = if u > -MOST { u } else { -MOST };
    // SAFETY: at most 2²⁹ in magnitude.
    unsafe { access::whole(u * PER_KELVIN) }
}

#[inline(always)]
fn at(steps: i32) -> State {
    State::from(steps) << 31
}

/// The nearest number of steps.
#[inline(always)]
fn rounded(state: State) -> i32 {
    ((state + (1 << 30)) >> 31) as i32
}

/// Moves a state by `change` steps, at most 2³⁰ in magnitude.
#[inline(never)]
fn moved(state: State, change: f32) -> State {
    const FRACTION: f32 = 2_147_483_648.0;
    // SAFETY: `change` is at most 2³⁰ in magnitude, and its fraction, below 1, has 24 bits.
    let (whole, rest) = unsafe {
        let whole = access::whole(change);
        (whole, access::whole((change - whole as f32) * FRACTION))
    };
    state + at(whole) + State::from(rest)
}

/// The state of a first-order lag, for callers of [`evaluate`](crate::Compensation::evaluate). A
/// [`Servo`](crate::Servo) has its own.
///
/// ```
/// use trueaxis::Lag;
///
/// let mut lag = Lag::NEW;
/// assert_eq!(lag.follow(0.0, 1.0 / 600.0, 0.001), 0.0);
/// for _ in 0..600_000 {
///     lag.follow(8.0, 1.0 / 600.0, 0.001);
/// }
/// // After one time constant: 8 · (1 − 1/e).
/// assert!((lag.value() - 5.056_964).abs() < 2e-5);
/// ```
///
/// # Operations
/// Four conversions between f32 and i32, three products, and sums of integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lag {
    state: State,
    is_set: bool,
}

impl Lag {
    /// Starts at its first reading.
    pub const NEW: Self = Self {
        state: 0,
        is_set: false,
    };

    /// Takes the reading `u` (K) after a period `dt` (s) and returns the filtered value (K). `rate` is 1/τ in 1/s.
    ///
    /// The value starts at the first finite reading. A reading that is not finite leaves the state as it is and is
    /// returned. A period that is not positive changes nothing; one of τ or more sets the value to `u`. The value never
    /// passes the reading.
    pub fn follow(&mut self, u: f32, rate: f32, dt: f32) -> f32 {
        if !u.is_finite() {
            return u;
        }
        let goal = steps(u);
        let part = dt * rate;
        if !self.is_set || part >= 1.0 {
            self.state = at(goal);
            self.is_set = true;
        } else if part > 0.0 {
            let way = (goal - rounded(self.state)) as f32;
            self.state = moved(self.state, way * part);
        }
        self.value()
    }

    /// The filtered value, K, a multiple of 2⁻¹⁷ K; 0 before the first reading.
    #[must_use]
    pub fn value(&self) -> f32 {
        rounded(self.state) as f32 * STEP
    }
}

/// How a servo follows one temperature: the readings at a bounded rate, then the lag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Follower {
    /// The reading, followed at a bounded rate.
    reading: State,
    /// Like `reading`, with the lag.
    lagged: State,
    is_set: bool,
    /// The reading that has been reached (K), so that nothing but the lag is left to do while it lasts; otherwise NaN.
    reached: f32,
}

impl Follower {
    /// Starts at its first plausible reading.
    pub(crate) const NEW: Self = Self {
        reading: 0,
        lagged: 0,
        is_set: false,
        reached: f32::NAN,
    };

    /// The sensor may have other limits from now on.
    pub(crate) fn look_closely(&mut self) {
        self.reached = f32::NAN;
    }

    /// Takes the reading `u` (K from the reference) after a valid period `dt` (s). Returns the temperature that counts
    /// (K), or nothing if the reading is a fault: outside the range, not a number, or a jump. `free`: nothing is output
    /// now, so after a jump it starts anew.
    #[inline(always)]
    pub(crate) fn follow(&mut self, u: f32, of: &Auxiliary, dt: f32, free: bool) -> Option<f32> {
        if u != self.reached && !self.approach(u, of, dt, free) {
            return None;
        }
        let mut steps = rounded(self.reading);
        let lag_rate = of.sensor.lag_rate;
        if lag_rate > 0.0 {
            // No faster than the readings are followed: a period is at most a hundredth of a lag.
            let way = (steps - rounded(self.lagged)) as f32;
            self.lagged = moved(self.lagged, way * (lag_rate * dt));
            steps = rounded(self.lagged);
        }
        Some(steps as f32 * STEP)
    }

    /// Follows the reading; returns false if it is a fault.
    #[inline(never)]
    fn approach(&mut self, u: f32, of: &Auxiliary, dt: f32, free: bool) -> bool {
        let Sensor {
            rate,
            range: [low, high],
            ..
        } = of.sensor;
        let celsius = u + of.reference;
        // NaN fails the comparisons.
        if !(celsius >= low && celsius <= high) {
            return false;
        }
        // SAFETY: the range and the reference are within 1000 °C, so `u` is within 2000 K.
        let goal = unsafe { access::whole(u * PER_KELVIN) };
        let way = (goal - rounded(self.reading)) as f32;
        let rate = rate * PER_KELVIN;
        let jumps = way.abs() > rate * Sensor::JUMP;
        let starts = !self.is_set || (free && jumps);
        if starts {
            self.reading = at(goal);
            self.lagged = at(goal);
            self.is_set = true;
        } else {
            let most = rate * dt;
            let change = if way < most { way } else { most };
            let change = if change > -most { change } else { -most };
            self.reading = moved(self.reading, change);
        }
        let arrived = rounded(self.reading) == goal;
        self.reached = if arrived { u } else { f32::NAN };
        starts || !jumps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_hours_of_milliseconds_stay_with_an_exact_recursion() {
        for (tau, periods) in [(10_800.0_f32, 28_800_000_u32), (60.0, 3_600_000)] {
            let (rate, dt) = (1.0 / tau, 0.001_f32);
            let part = f64::from(dt * rate);
            let mut lag = Lag::NEW;
            let mut exact: Option<f64> = None;
            let mut most = 0.0_f64;
            // A slow square wave with a ramp on it, in readings of f32.
            for k in 0..periods {
                let high = (k / 5_400_000) % 2 == 0;
                let u = if high { 12.5 } else { -3.0 } + (k / 1000) as f32 * 1e-4;
                let y = lag.follow(u, rate, dt);
                let before = exact.unwrap_or(f64::from(u));
                exact = Some(before + part * (f64::from(u) - before));
                most = most.max((f64::from(y) - exact.unwrap_or(0.0)).abs());
            }
            // A reading is truncated to a step; the value is rounded by half a step, both for the difference to the
            // reading and at the end.
            assert!(most <= 2.0 * f64::from(STEP), "{tau} s: {most:e} K");
        }
    }

    #[test]
    fn a_step_arrives_although_each_increment_is_below_the_resolution_of_f32() {
        let (rate, dt) = (1.0 / 10_800.0, 1e-5);
        let mut lag = Lag::NEW;
        lag.follow(20.0, rate, dt);
        lag.follow(20.001, rate, dt);
        // In f32: 20 + 1e-9 · 0.001 = 20. The reading is 131 steps higher.
        let moved = lag.state - at(steps(20.0));
        let expected = 131.0 * f64::from(dt * rate) * 2_147_483_648.0;
        // Truncated to one unit; the product is rounded by 1e-7 of 260 units.
        assert!(
            (moved as f64 - expected).abs() <= 1.001,
            "{moved} {expected}"
        );
    }

    #[test]
    fn it_never_passes_the_reading_whatever_the_period() {
        let mut seed = 1_u32;
        let mut draw = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from_bits(seed)
        };
        let mut lag = Lag::NEW;
        for _ in 0..2_000_000 {
            let (u, rate, dt) = (draw(), draw(), draw());
            let before = lag;
            lag.follow(u, rate, dt);
            if !u.is_finite() {
                assert_eq!(lag, before);
                continue;
            }
            let (goal, now) = (steps(u), rounded(lag.state));
            if before.is_set {
                let last = rounded(before.state);
                let (low, high) = (goal.min(last), goal.max(last));
                // Differences of more than 128 K round to f32.
                let rounding = if goal.abs_diff(last) < 1 << 24 { 0 } else { 64 };
                let range = low - rounding..=high + rounding;
                assert!(range.contains(&now), "{u} {rate} {dt}");
            } else {
                assert_eq!(now, goal);
            }
        }
    }

    #[test]
    fn it_starts_at_the_first_finite_reading_and_holds_while_there_is_none() {
        let mut lag = Lag::NEW;
        assert!(lag.follow(f32::NAN, 0.1, 0.001).is_nan());
        assert_eq!(lag.follow(3.5, 0.1, 0.001), 3.5);
        let held = lag;
        for lost in [f32::NAN, f32::INFINITY] {
            lag.follow(lost, 0.1, 0.001);
            assert_eq!(lag, held);
        }
        for nothing in [0.0, -1.0, f32::NAN] {
            assert_eq!(lag.follow(9.0, 0.1, nothing), 3.5);
        }
        assert_eq!(lag.follow(9.0, 0.1, 1e9), 9.0);
        assert_eq!(lag.follow(1e9, 0.1, 1e9), MOST);
        assert_eq!(lag.follow(f32::MIN, 0.1, 1e9), -MOST);
    }
}
