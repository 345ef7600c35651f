//! First-order lags of temperature inputs: machine parts follow the temperature of a sensor with a delay.
//!
//! dy/dt = (u − y)/τ, stepped once per update. τ can be hours and a period 1 ms: an increment is then 1e-7 of the
//! difference, which f32 would lose. The state is therefore an integer. `docs/src/format.md` is normative.

/// Units of the state per kelvin, 2⁴⁸. With a period of 1 ms and a lag of 3 h, it comes to rest 4e-8 K before its end.
const PER_KELVIN: f32 = 281_474_976_710_656.0;
/// The value is the state rounded to 2⁻¹⁷ K, 0.2 nm at 20 µm/K: most periods then have the value of the one before, and
/// cost a servo no second evaluation.
const SHIFT: u32 = 31;
const STEP: f32 = 1.0 / 131_072.0;
/// Readings beyond this (K) count as this, so that differences of states fit into an integer.
const MOST: f32 = 8192.0;

/// The state of a first-order lag. A [`Servo`](crate::Servo) has one for each auxiliary; callers of
/// [`evaluate`](crate::Compensation::evaluate) keep their own.
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
/// assert!((lag.value() - 5.056_964).abs() < 1e-5);
/// ```
///
/// # Operations
/// Two conversions from f32 to i64 and one back, four products, and sums of integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lag {
    /// In 2⁻⁴⁸ K.
    state: i64,
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
        let u = if u < MOST { u } else { MOST };
        let u = if u > -MOST { u } else { -MOST };
        let goal = (u * PER_KELVIN) as i64;
        let part = dt * rate;
        if !self.is_set || part >= 1.0 {
            self.state = goal;
            self.is_set = true;
        } else if part > 0.0 {
            self.state += ((goal - self.state) as f32 * part) as i64;
        }
        self.value()
    }

    /// The filtered value, K, a multiple of 2⁻¹⁷ K; 0 before the first reading.
    #[must_use]
    pub fn value(&self) -> f32 {
        ((self.state + (1 << (SHIFT - 1))) >> SHIFT) as i32 as f32 * STEP
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit of the state, K.
    const UNIT: f64 = 1.0 / 281_474_976_710_656.0;

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
            // The value is rounded by up to 3.8e-6 K. Truncation of increments leaves less than a unit divided by
            // `part`, 4e-8 K; rounding of products to f32 is 1e-7 of the 15 K to go.
            assert!(most < 3.82e-6 + 2e-6, "{tau} s: {most:e} K");
        }
    }

    #[test]
    fn a_step_arrives_although_each_increment_is_below_the_resolution_of_f32() {
        let (rate, dt) = (1.0 / 10_800.0, 1e-5);
        let mut lag = Lag::NEW;
        lag.follow(20.0, rate, dt);
        lag.follow(20.001, rate, dt);
        // In f32: 20 + 1e-9 · 0.001 = 20.
        let moved = lag.state - (20 << 48);
        let expected = f64::from(20.001_f32 - 20.0) * f64::from(dt * rate) / UNIT;
        // Truncated to one unit; the difference and its product are rounded by 1e-7 of 260 units.
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
            let goal = (u.clamp(-MOST, MOST) * PER_KELVIN) as i64;
            if before.is_set {
                let (low, high) = (goal.min(before.state), goal.max(before.state));
                assert!((low..=high).contains(&lag.state), "{u} {rate} {dt}");
            } else {
                assert_eq!(lag.state, goal);
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
