//! Platinum: PT100, PT1000 as in IEC 60751.

use crate::{Curve, SensorError};

/// Coefficients of IEC 60751: R(t)/R(0) = 1 + A·t + B·t² above 0 °C, and below
/// 1 + A·t + B·t² + C·(t − 100 °C)·t³.
const A: f32 = 3.9083e-3;
const B: f32 = -5.775e-7;
const C: f32 = -4.183e-12;

/// R/R(0) at −200 and 850 °C, where the standard ends, with 0.1 K to spare.
const COLDEST: f32 = 0.1848;
const HOTTEST: f32 = 3.9050;
/// Newton steps below 0 °C. The equation for above is off by 2.4 K at −200 °C; the first step leaves 0.003 K, the
/// second what f32 is able to.
const STEPS: usize = 2;

/// A platinum resistor with the coefficients of IEC 60751, −200 … 850 °C.
///
/// f32: the rounding costs less than 0.0003 K.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Platinum {
    /// Ω at 0 °C
    zero: f32,
}

impl Platinum {
    /// 100 Ω at 0 °C.
    pub const PT100: Self = Self::new(100.0);
    /// 1000 Ω at 0 °C.
    pub const PT1000: Self = Self::new(1000.0);

    /// Of so many Ω at 0 °C: another size, or one that was measured.
    #[must_use]
    pub const fn new(zero: f32) -> Self {
        Self { zero }
    }

    /// Ω between which it can be.
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
        // The root of B·t² + A·t = change, written so that nothing cancels.
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
