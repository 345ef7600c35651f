//! Platinum sensors: PT100, PT1000 according to IEC 60751.

use crate::{Curve, SensorError};

/// Coefficients of IEC 60751: R(t)/R(0) = 1 + A·t + B·t² above 0 °C, and below
/// 1 + A·t + B·t² + C·(t − 100 °C)·t³.
const A: f32 = 3.9083e-3;
const B: f32 = -5.775e-7;
const C: f32 = -4.183e-12;

/// R/R(0) at −200 and 850 °C, the limits of the standard, plus a margin of 0.1 K.
const COLDEST: f32 = 0.1848;
const HOTTEST: f32 = 3.9050;
/// Newton steps below 0 °C. The equation for positive temperatures is off by 2.4 K at −200 °C; the first step leaves
/// 0.003 K, the second is limited by f32.
const STEPS: usize = 2;

/// A platinum resistor with the coefficients of IEC 60751, −200 … 850 °C.
///
/// In f32, rounding costs less than 0.0003 K.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Platinum {
    /// Resistance at 0 °C, Ω.
    zero: f32,
}

impl Platinum {
    /// 100 Ω at 0 °C.
    pub const PT100: Self = Self::new(100.0);
    /// 1000 Ω at 0 °C.
    pub const PT1000: Self = Self::new(1000.0);

    /// With a given resistance at 0 °C, Ω: another size, or a measured one.
    #[must_use]
    pub const fn new(zero: f32) -> Self {
        Self { zero }
    }

    /// Smallest and largest possible resistance, Ω.
    pub(crate) fn limits(self) -> [f32; 2] {
        [COLDEST * self.zero, HOTTEST * self.zero]
    }
}

impl Curve for Platinum {
    fn celsius(&self, ohms: f32) -> Result<f32, SensorError> {
        let ratio = ohms / self.zero;
        if ratio.is_nan() || ratio < 0.0 {
            return Err(SensorError::Implausible);
        }
        if ratio < COLDEST {
            return Err(SensorError::Short);
        }
        if ratio > HOTTEST {
            return Err(SensorError::Open);
        }
        let change = ratio - 1.0;
        // The root of B·t² + A·t = change, written to avoid cancellation.
        let mut t = 2.0 * change / (A + libm::sqrtf(A * A + 4.0 * B * change));
        if t < 0.0 {
            for _ in 0..STEPS {
                let value = t * (A + t * (B + t * (t - 100.0) * C));
                let slope = A + t * (2.0 * B + t * (4.0 * t - 300.0) * C);
                t -= (value - change) / slope;
            }
        }
        Ok(t)
    }
}
