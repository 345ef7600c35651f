//! Why a sensor returned no temperature.

use core::fmt;

use embedded_hal::{i2c, spi};

use crate::Faults;

/// Why a sensor returned no temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorError {
    /// The I²C bus failed, or no device acknowledged.
    Bus(#[cfg_attr(feature = "defmt", defmt(Debug2Format))] i2c::ErrorKind),
    /// The SPI bus failed.
    Spi(#[cfg_attr(feature = "defmt", defmt(Debug2Format))] spi::ErrorKind),
    /// The analog-to-digital converter failed.
    Converter,
    /// Another device responds, or a bus line is stuck.
    Identity {
        /// The identity read.
        found: u16,
    },
    /// The sensor or a wire is open: the resistance is too high.
    Open,
    /// The sensor or its wires are shorted: the resistance is too low.
    Short,
    /// Faults reported by a MAX31865.
    Wiring(Faults),
    /// The temperature is outside the sensor's range.
    Implausible,
}

impl SensorError {
    /// Whether the sensor or a wire to it is open.
    #[must_use]
    pub fn is_open(self) -> bool {
        match self {
            Self::Wiring(faults) => faults.is_open(),
            other => other == Self::Open,
        }
    }

    /// Whether the sensor is shorted, or one of its wires touches ground.
    #[must_use]
    pub fn is_short(self) -> bool {
        match self {
            Self::Wiring(faults) => faults.is_short(),
            other => other == Self::Short,
        }
    }
}

impl fmt::Display for SensorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(kind) => write!(f, "I2C: {kind}"),
            Self::Spi(kind) => write!(f, "SPI: {kind}"),
            Self::Converter => f.write_str("the converter failed"),
            Self::Identity { found } => write!(f, "another device answers: {found:04X}"),
            Self::Open => f.write_str("open"),
            Self::Short => f.write_str("shorted"),
            Self::Wiring(faults) => faults.fmt(f),
            Self::Implausible => f.write_str("outside the range of the sensor"),
        }
    }
}

impl core::error::Error for SensorError {}
