//! Thermistors: Steinhart–Hart, or the constant B.

use crate::{Curve, SensorError};

/// 0 °C in K.
const ZERO: f32 = 273.15;
/// Range of thermistors for machines, −55 … 150 °C plus a margin of 1 K, as 1/K.
const COLDEST: f32 = 1.0 / (ZERO - 56.0);
const HOTTEST: f32 = 1.0 / (ZERO + 151.0);

/// A thermistor: 1/T = a + b·l + c·l² + d·l³ with l = ln(R / reference), T in K.
///
/// In f32, rounding costs less than 0.0003 K from −55 to 150 °C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ntc {
    /// Reference resistance, Ω.
    reference: f32,
    /// Coefficients a … d, 1/K.
    coefficients: [f32; 4],
}

impl Ntc {
    /// Vishay NTCLE100E3103 and others of the same material: 10 kΩ at 25 °C, B(25/85) = 3977 K. Coefficients A₁ … D₁ of
    /// its data sheet (29049), whose equation for R(T) this matches within 0.012 K.
    pub const VISHAY_10K_3977: Self = Self::extended(
        10_000.0,
        [3.354_016e-3, 2.569_850e-4, 2.620_131e-6, 6.383_091e-8],
    );

    /// From the resistance at 25 °C, Ω, and B, K: 1/T = 1/298.15 K + ln(R / R₂₅) / B.
    ///
    /// Exact at 25 °C and at the upper temperature of B, 85 °C for B(25/85); about 0.3 K off in between, more outside.
    #[must_use]
    pub const fn beta(at_25: f32, beta: f32) -> Self {
        Self::extended(at_25, [1.0 / (ZERO + 25.0), 1.0 / beta, 0.0, 0.0])
    }

    /// Steinhart–Hart: 1/T = A + B·ln R + C·(ln R)³, R in Ω.
    #[must_use]
    pub const fn steinhart_hart(a: f32, b: f32, c: f32) -> Self {
        Self::extended(1.0, [a, b, 0.0, c])
    }

    /// The form used by Vishay: with the square, and relative to a reference resistance, Ω.
    #[must_use]
    pub const fn extended(reference: f32, coefficients: [f32; 4]) -> Self {
        Self {
            reference,
            coefficients,
        }
    }
}

impl Curve for Ntc {
    fn celsius(&self, ohms: f32) -> Result<f32, SensorError> {
        if ohms == 0.0 {
            return Err(SensorError::Short);
        }
        let [a, b, c, d] = self.coefficients;
        // NaN for a negative value, infinity for infinity.
        let l = libm::logf(ohms / self.reference);
        let inverse = a + l * (b + l * (c + l * d));
        if inverse > COLDEST {
            Err(SensorError::Open)
        } else if inverse < HOTTEST {
            Err(SensorError::Short)
        } else if inverse.is_nan() {
            Err(SensorError::Implausible)
        } else {
            Ok(1.0 / inverse - ZERO)
        }
    }
}
