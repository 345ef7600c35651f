//! A resistive sensor with a resistor across the reference of an analog-to-digital converter.

use crate::{Curve, SensorError};

/// Position of the sensor in the divider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Between the input of the converter and ground; the resistor goes to the reference.
    Low,
    /// Between the reference and the input of the converter; the resistor goes to ground.
    High,
}

/// A sensor and a resistor in series across the reference of the converter.
///
/// Only the ratio of the voltage between them to the reference matters, so the reference and its drift cancel. The
/// divider must be fed from that same reference.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Divider {
    /// Resistance of the resistor, Ω.
    pub resistor: f32,
    /// Position of the sensor.
    pub sensor: Side,
}

impl Divider {
    /// The resistance of the sensor, Ω, from a ratio 0 … 1 of the reference; above 0 and finite.
    ///
    /// # Errors
    /// [`SensorError::Short`] and [`SensorError::Open`] at the ends, [`SensorError::Implausible`] outside, and if the
    /// value of the resistor is not possible.
    pub fn ohms(&self, ratio: f32) -> Result<f32, SensorError> {
        if !(0.0..=1.0).contains(&ratio) {
            return Err(SensorError::Implausible);
        }
        let (sensor, resistor) = match self.sensor {
            Side::Low => (ratio, 1.0 - ratio),
            Side::High => (1.0 - ratio, ratio),
        };
        if sensor == 0.0 {
            return Err(SensorError::Short);
        }
        if resistor == 0.0 {
            return Err(SensorError::Open);
        }
        let ohms = self.resistor * (sensor / resistor);
        if ohms > 0.0 && ohms < f32::INFINITY {
            Ok(ohms)
        } else {
            Err(SensorError::Implausible)
        }
    }
}

/// A sensor in a [`Divider`], an NTC or platinum, whose voltage is read by `R`.
///
/// `R` returns the converter's count divided by its full scale, 0 … 1; `None` if there is no new value, and
/// [`SensorError::Converter`] on failure. `embedded-hal` has no trait for this.
///
/// ```
/// use trueaxis_sensors::{Divider, Ntc, Resistive, Side};
///
/// let mut count = || 2048_u16; // the converter, 12 bits
/// let divider = Divider { resistor: 10_000.0, sensor: Side::Low };
/// let ratio = || Ok(Some(f32::from(count()) / 4096.0));
/// let mut bed = Resistive::new(ratio, divider, Ntc::beta(10_000.0, 3977.0));
/// let celsius = bed.celsius()?.unwrap();
/// assert!((celsius - 25.0).abs() < 0.001);
/// # Ok::<(), trueaxis_sensors::SensorError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Resistive<R, C> {
    ratio: R,
    divider: Divider,
    curve: C,
}

impl<R: FnMut() -> Result<Option<f32>, SensorError>, C: Curve> Resistive<R, C> {
    /// A sensor with this characteristic.
    pub const fn new(ratio: R, divider: Divider, curve: C) -> Self {
        Self {
            ratio,
            divider,
            curve,
        }
    }

    /// The temperature, °C; `None` if the converter has no new value.
    ///
    /// # Errors
    /// Errors of the converter, or a fault of the sensor.
    pub fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        let Some(ratio) = (self.ratio)()? else {
            return Ok(None);
        };
        let ohms = self.divider.ohms(ratio)?;
        self.curve.celsius(ohms).map(Some)
    }
}
