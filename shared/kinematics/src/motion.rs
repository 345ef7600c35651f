//! One error motion: a component of the error of one axis along its travel.

use crate::sine::sin_cos;
use crate::{MAX_DEGREE, MAX_HARMONIC, MAX_SENSORS, ParameterKind};
use heapless::Vec;

/// Maximum number of temperature-dependent coefficients of one motion.
pub const MAX_CHANGES: usize = 16;

/// Temperature dependence of one coefficient of an error motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// The coefficient: [`ParameterKind::Degree`], [`ParameterKind::Cosine`] or [`ParameterKind::Sine`].
    pub kind: ParameterKind,
    /// Index of the sensor.
    pub sensor: usize,
    /// Change per kelvin from the sensor's reference.
    pub per_kelvin: f64,
}

/// A measured error motion: values at increasing positions, interpolated linearly, with the end values held outside.
/// `P` stores them: borrowed, or owned where there is a heap.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<P = &'static [f64]> {
    /// Positions (mm or rad).
    pub at: P,
    /// Values (mm or rad) after positive travel, one for each position.
    pub positive: P,
    /// Values (mm or rad) after negative travel, if they differ.
    pub negative: Option<P>,
}

impl<P: AsRef<[f64]>> Table<P> {
    /// The value (mm or rad) at a position: mean + `sign` · half the difference between the two directions. So +1 and
    /// −1 give the values of each direction, and 0 (unknown) gives their mean.
    #[must_use]
    pub fn value(&self, q: f64, sign: f64) -> f64 {
        self.value_by(q, q, sign)
    }

    /// Value on the straight line through the points around `by`, extended to `q`.
    fn value_by(&self, q: f64, by: f64, sign: f64) -> f64 {
        let at = self.at.as_ref();
        let positive = interpolate(at, self.positive.as_ref(), q, by);
        let Some(negative) = &self.negative else {
            return positive;
        };
        let negative = interpolate(at, negative.as_ref(), q, by);
        0.5 * (positive + negative) + sign * (0.5 * (positive - negative))
    }
}

/// One error motion: a component of the error of one axis along its travel. It is the sum of all parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion<P = &'static [f64]> {
    /// Coefficients of degree 0, 1, 2 … (mm or rad, per mmᵏ or radᵏ).
    pub coefficients: Vec<f64, { MAX_DEGREE as usize + 1 }>,
    /// Coefficients (mm or rad) of cosine and sine of 1, 2, 3 … times the angle of a rotary axis.
    pub harmonics: Vec<[f64; 2], { MAX_HARMONIC as usize }>,
    /// Half of the reversal value (mm or rad).
    pub backlash: f64,
    /// Measured values.
    pub table: Option<Table<P>>,
    /// Temperature dependences of coefficients.
    pub thermal: Vec<Change, MAX_CHANGES>,
    /// True for an endless axis, whose harmonics are known over the whole turn.
    pub endless: bool,
}

impl<P> Default for Motion<P> {
    /// No error.
    fn default() -> Self {
        Self {
            coefficients: Vec::new(),
            harmonics: Vec::new(),
            backlash: 0.0,
            table: None,
            thermal: Vec::new(),
            endless: false,
        }
    }
}

impl<P> Motion<P> {
    /// True if it keeps its end value outside the calibrated range: it is tabulated, has coefficients of degree 2 or
    /// more, or has harmonics on an axis that is not endless. Degrees 0 and 1 alone are a location or a scale and stay
    /// valid everywhere.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.table.is_some()
            || self.coefficients.len() > 2
            || (!self.harmonics.is_empty() && !self.endless)
            || self.thermal.iter().any(|change| match change.kind {
                ParameterKind::Degree(k) => k >= 2,
                _ => !self.endless,
            })
    }

    /// True if it is zero everywhere, in every direction and at every temperature.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.coefficients.iter().all(|c| *c == 0.0)
            && self.harmonics.iter().all(|h| *h == [0.0; 2])
            && self.backlash == 0.0
            && self.table.is_none()
            && self.thermal.is_empty()
    }

    /// True if it changes along the travel.
    #[must_use]
    pub fn varies(&self) -> bool {
        self.coefficients.iter().skip(1).any(|c| *c != 0.0)
            || self.harmonics.iter().any(|h| *h != [0.0; 2])
            || self.table.is_some()
            || self
                .thermal
                .iter()
                .any(|change| change.kind != ParameterKind::Degree(0))
    }

    /// True if it depends on the direction of travel.
    #[must_use]
    pub fn reverses(&self) -> bool {
        self.backlash != 0.0 || self.table.as_ref().is_some_and(|t| t.negative.is_some())
    }

    /// The constant part (degree 0) only.
    pub(crate) fn constant(&self, kelvin: &[f64; MAX_SENSORS]) -> f64 {
        let mut value = self.coefficients.first().copied().unwrap_or(0.0);
        for change in &self.thermal {
            if change.kind == ParameterKind::Degree(0) {
                value += change.per_kelvin * kelvin[change.sensor];
            }
        }
        value
    }

    /// Sets a coefficient; returns false if the motion has no such coefficient.
    pub(crate) fn set(&mut self, kind: ParameterKind, value: f64) -> bool {
        match kind {
            ParameterKind::Inter => return false,
            ParameterKind::Backlash => self.backlash = value,
            ParameterKind::Degree(k) => {
                let k = usize::from(k);
                if self.coefficients.len() <= k && self.coefficients.resize(k + 1, 0.0).is_err() {
                    return false;
                }
                self.coefficients[k] = value;
            }
            ParameterKind::Cosine(k) | ParameterKind::Sine(k) => {
                let Some(k) = usize::from(k).checked_sub(1) else {
                    return false;
                };
                if self.harmonics.len() <= k && self.harmonics.resize(k + 1, [0.0; 2]).is_err() {
                    return false;
                }
                self.harmonics[k][usize::from(matches!(kind, ParameterKind::Sine(_)))] = value;
            }
        }
        true
    }
}

impl<P: AsRef<[f64]>> Motion<P> {
    /// The value (mm or rad) at a position (mm or rad) inside the calibrated range, with direction of travel `sign`
    /// (+1, −1, or 0 if unknown), at `kelvin` relative to the sensors' references.
    #[must_use]
    pub fn value(&self, q: f64, sign: f64, kelvin: &[f64; MAX_SENSORS]) -> f64 {
        self.value_by(q, q, sign, kelvin)
    }

    /// Value by the piece of a table that applies at `by`, extended to `q`.
    pub(crate) fn value_by(&self, q: f64, by: f64, sign: f64, kelvin: &[f64; MAX_SENSORS]) -> f64 {
        let mut value = self
            .coefficients
            .iter()
            .rev()
            .fold(0.0, |sum, c| sum * q + c);
        for change in &self.thermal {
            value += change.per_kelvin * kelvin[change.sensor] * change.kind.basis(q);
        }
        if !self.harmonics.is_empty() {
            value += harmonics(&self.harmonics, q);
        }
        if let Some(table) = &self.table {
            value += table.value_by(q, by, sign);
        }
        value + self.backlash * sign
    }
}

impl ParameterKind {
    /// The factor of a coefficient of an error motion at a position (mm or rad); 1 for any other parameter.
    #[must_use]
    pub fn basis(self, q: f64) -> f64 {
        match self {
            Self::Degree(k) => power(q, k),
            Self::Cosine(k) => sin_cos(f64::from(k) * q).1,
            Self::Sine(k) => sin_cos(f64::from(k) * q).0,
            Self::Inter | Self::Backlash => 1.0,
        }
    }
}

/// Σ cₖ·cos(k·q) + sₖ·sin(k·q), with one sine and cosine: each angle is the previous one rotated by q, which costs one
/// unit in the last place.
fn harmonics(coefficients: &[[f64; 2]], q: f64) -> f64 {
    let (s1, c1) = sin_cos(q);
    let (mut s, mut c) = (s1, c1);
    let mut value = 0.0;
    for [cosine, sine] in coefficients {
        value += cosine * c + sine * s;
        (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
    }
    value
}

/// qᵏ by squaring.
fn power(mut q: f64, mut k: u8) -> f64 {
    let mut power = 1.0;
    loop {
        if k & 1 == 1 {
            power *= q;
        }
        k >>= 1;
        if k == 0 {
            return power;
        }
        q *= q;
    }
}

/// Linear between the points, with the end value held outside.
fn interpolate(at: &[f64], values: &[f64], q: f64, by: f64) -> f64 {
    let last = at.len() - 1;
    if by < at[0] {
        return values[0];
    }
    if by > at[last] {
        return values[last];
    }
    let above = at.partition_point(|a| *a <= by).clamp(1, last);
    let t = (q - at[above - 1]) / (at[above] - at[above - 1]);
    values[above - 1] + (values[above] - values[above - 1]) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLD: [f64; MAX_SENSORS] = [0.0; MAX_SENSORS];

    #[test]
    fn a_table_has_a_value_for_each_direction_and_their_mean_for_an_unknown_one() {
        let motion = Motion::<&[f64]> {
            table: Some(Table {
                at: &[0.0, 10.0, 20.0],
                positive: &[1.0, 3.0, 3.0],
                negative: Some(&[-1.0, 1.0, 5.0]),
            }),
            ..Motion::default()
        };
        assert!(motion.reverses() && motion.holds() && motion.varies());
        for (q, positive, negative) in [
            (5.0, 2.0, 0.0),
            (15.0, 3.0, 3.0),
            (25.0, 3.0, 5.0),
            (-1.0, 1.0, -1.0),
        ] {
            assert_eq!(motion.value(q, 1.0, &COLD), positive);
            assert_eq!(motion.value(q, -1.0, &COLD), negative);
            assert_eq!(motion.value(q, 0.0, &COLD), 0.5 * (positive + negative));
            assert_eq!(
                motion.value(q, 0.5, &COLD),
                0.75 * positive + 0.25 * negative
            );
        }
    }

    #[test]
    fn harmonics_are_cosines_and_sines_of_multiples_of_the_angle() {
        let mut motion = Motion::<&[f64]>::default();
        for k in 1..=MAX_HARMONIC {
            assert!(motion.set(ParameterKind::Cosine(k), 0.1 * f64::from(k)));
            assert!(motion.set(ParameterKind::Sine(k), 1.0 / f64::from(k)));
        }
        for step in -40..=40 {
            let q = 0.17 * f64::from(step);
            let expected: f64 = (1..=8)
                .map(|k| {
                    0.1 * f64::from(k) * (f64::from(k) * q).cos()
                        + (f64::from(k) * q).sin() / f64::from(k)
                })
                .sum();
            // Sixteen terms of size 1, each accurate to a few units in the last place.
            assert!((motion.value(q, 0.0, &COLD) - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn harmonics_hold_except_on_an_endless_axis() {
        let mut motion = Motion::<&[f64]>::default();
        assert!(motion.set(ParameterKind::Sine(1), 1e-3));
        assert!(motion.holds());
        motion.endless = true;
        assert!(!motion.holds());
        assert!(motion.set(ParameterKind::Degree(2), 1e-3));
        assert!(motion.holds());
    }

    #[test]
    fn a_coefficient_changes_with_temperature() {
        let mut motion = Motion::<&[f64]>::default();
        for (kind, sensor) in [(ParameterKind::Degree(3), 0), (ParameterKind::Cosine(2), 1)] {
            let change = Change {
                kind,
                sensor,
                per_kelvin: 0.5,
            };
            motion.thermal.push(change).unwrap();
        }
        let mut kelvin = COLD;
        assert_eq!(motion.value(2.0, 0.0, &kelvin), 0.0);
        (kelvin[0], kelvin[1]) = (10.0, -2.0);
        let expected = 40.0 - 4.0_f64.cos();
        assert!((motion.value(2.0, 0.0, &kelvin) - expected).abs() < 1e-14);
    }

    #[test]
    fn a_coefficient_that_does_not_exist_cannot_be_set() {
        let mut motion = Motion::<&[f64]>::default();
        for kind in [
            ParameterKind::Inter,
            ParameterKind::Degree(MAX_DEGREE + 1),
            ParameterKind::Cosine(0),
            ParameterKind::Sine(MAX_HARMONIC + 1),
        ] {
            assert!(!motion.set(kind, 1.0));
        }
        assert!(motion.is_zero());
    }
}
