//! Drivers for temperature sensors over `embedded-hal` 1.0.
//!
//! Each driver has a method `celsius`, which never waits for a conversion: it returns the available reading, or `None`,
//! and starts the next one. Call it about once per second from the main loop.
//!
//! | | |
//! |---|---|
//! | [`Tmp117`] | digital sensor on I²C |
//! | [`Max31865`] | converter on SPI for a [`Platinum`] sensor |
//! | [`Resistive`] | [`Ntc`] or [`Platinum`] in a voltage [`Divider`], read by any converter |
//! | [`SoftI2c`] | I²C on two pins, for chips whose hardware driver could block for ever |
#![no_std]
#![forbid(unsafe_code)]

mod divider;
mod error;
mod max31865;
mod ntc;
mod platinum;
mod soft_i2c;
mod tmp117;

#[cfg(test)]
extern crate std;
#[cfg(test)]
mod tests;

pub use divider::{Divider, Resistive, Side};
pub use error::SensorError;
pub use max31865::{Conversion, Faults, Mains, Max31865, Wires};
pub use ntc::Ntc;
pub use platinum::Platinum;
pub use soft_i2c::SoftI2c;
pub use tmp117::{Tmp117, Tmp117Address};

/// The characteristic of a resistive sensor.
pub trait Curve {
    /// The temperature, °C, at a resistance in Ω.
    ///
    /// # Errors
    /// [`SensorError::Open`] or [`SensorError::Short`] beyond the resistances of the sensor's temperature range;
    /// [`SensorError::Implausible`] if the resistance is negative or NaN.
    fn celsius(&self, ohms: f32) -> Result<f32, SensorError>;
}

/// Compiles the code in the manual.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/src/temperatures.md")]
struct Manual;
