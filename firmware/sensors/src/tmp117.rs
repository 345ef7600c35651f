//! Texas Instruments TMP117: ±0.1 °C, 16 bits over I²C.
//!
//! Registers and conversion times are taken from its datasheet (SNOSD82).

use embedded_hal::i2c::{Error, I2c};

use crate::SensorError;

const TEMPERATURE: u8 = 0x00;
const CONFIGURATION: u8 = 0x01;
const IDENTITY: u8 = 0x0F;

/// Bits 11 … 0 of the identity register; the rest is the revision.
const TMP117: u16 = 0x117;
/// Unit of the temperature register, °C.
const UNIT: f32 = 0.007_812_5;
/// Measuring range of the sensor, °C.
const RANGE: core::ops::RangeInclusive<f32> = -55.0..=150.0;

/// Continuous conversion, one result per second, the mean of eight.
const CONTINUOUS: u16 = 0x0220;
/// Conversion mode, cycle and averaging within the configuration.
const MODE: u16 = 0x0FE0;
/// There is an unread result.
const DATA_READY: u16 = 1 << 13;

/// How the address pin is wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Tmp117Address {
    /// To ground: address 48.
    #[default]
    Ground = 0x48,
    /// To the supply: address 49.
    Supply = 0x49,
    /// To the data line: address 4A.
    Data = 0x4A,
    /// To the clock line: address 4B.
    Clock = 0x4B,
}

/// A TMP117 on a bus, or on its share of one (`embedded-hal-bus`).
#[derive(Debug)]
pub struct Tmp117<I> {
    bus: I,
    address: Tmp117Address,
}

impl<I: I2c> Tmp117<I> {
    /// Nothing is sent yet, so the sensor may be connected later.
    pub const fn new(bus: I, address: Tmp117Address) -> Self {
        Self { bus, address }
    }

    /// Returns the bus.
    pub fn release(self) -> I {
        self.bus
    }

    fn read(&mut self, register: u8) -> Result<u16, SensorError> {
        let mut bytes = [0; 2];
        self.bus
            .write_read(self.address as u8, &[register], &mut bytes)
            .map_err(|error| SensorError::Bus(error.kind()))?;
        Ok(u16::from_be_bytes(bytes))
    }

    fn configure(&mut self) -> Result<(), SensorError> {
        let [high, low] = CONTINUOUS.to_be_bytes();
        self.bus
            .write(self.address as u8, &[CONFIGURATION, high, low])
            .map_err(|error| SensorError::Bus(error.kind()))
    }

    /// The temperature, °C; `None` if there is no new reading. Three short transfers: the identity is read
    /// every time, because with a stuck data line a temperature of 0 °C would look right.
    ///
    /// # Errors
    /// [`SensorError::Bus`], [`SensorError::Identity`] if another device responds, [`SensorError::Implausible`].
    pub fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        let found = self.read(IDENTITY)?;
        if found & 0xFFF != TMP117 {
            return Err(SensorError::Identity { found });
        }
        let configuration = self.read(CONFIGURATION)?;
        if configuration & MODE != CONTINUOUS & MODE {
            // It is new, or has lost power meanwhile.
            self.configure()?;
            return Ok(None);
        }
        if configuration & DATA_READY == 0 {
            return Ok(None);
        }
        let celsius = f32::from(self.read(TEMPERATURE)?.cast_signed()) * UNIT;
        if RANGE.contains(&celsius) {
            Ok(Some(celsius))
        } else {
            Err(SensorError::Implausible)
        }
    }
}
