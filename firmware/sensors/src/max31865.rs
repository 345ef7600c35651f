//! Maxim MAX31865: platinum sensors over SPI, 15 bits of a reference resistor.
//!
//! Registers and faults are taken from its data sheet (19-6478, revision 3).

use core::fmt;

use embedded_hal::spi::{Error, Operation, SpiDevice};

use crate::{Curve, Platinum, SensorError};

/// Registers, from 0: configuration, result, high and low threshold (two each), faults.
const REGISTERS: usize = 8;
const CONFIGURATION: usize = 0;
const RESULT: usize = 1;
const THRESHOLDS: usize = 3;
const FAULTS: usize = 7;
/// Added to a register number for writing.
const WRITE: u8 = 0x80;

/// Supplies the sensor. Always on, because there is no time to wait for it to settle.
const BIAS: u8 = 0x80;
const AUTOMATIC: u8 = 0x40;
const ONE_SHOT: u8 = 0x20;
const THREE_WIRES: u8 = 0x10;
/// A check of the wires with automatic timing; 0 again when it is complete.
const CHECK: u8 = 0x04;
const CHECKING: u8 = 0x0C;
const CLEAR: u8 = 0x02;
const NOTCH_50: u8 = 0x01;
/// Configuration bits that stay as written.
const STAYS: u8 = BIAS | AUTOMATIC | THREE_WIRES | NOTCH_50;

/// Result for a sensor resistance equal to the reference resistor.
const FULL_SCALE: f32 = 32768.0;

/// Faults detected by a MAX31865: bits of its fault register. For their causes see tables 10 to 12 of the data sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Faults(u8);

impl Faults {
    /// The resistance is above the high threshold: the sensor is open.
    pub const HIGH: Self = Self(0x80);
    /// The resistance is below the low threshold: the sensor is shorted.
    pub const LOW: Self = Self(0x40);
    /// REFIN− is too high: the sensor or a force wire is open, or a wire touches the supply.
    pub const REFERENCE_HIGH: Self = Self(0x20);
    /// REFIN− is too low with FORCE− open: a wire touches ground.
    pub const REFERENCE_LOW: Self = Self(0x10);
    /// RTDIN− is too low with FORCE− open: a wire touches ground.
    pub const INPUT_LOW: Self = Self(0x08);
    /// An input is above the supply or below ground.
    pub const VOLTAGE: Self = Self(0x04);

    const NAMED: [(Self, &'static str); 6] = [
        (Self::HIGH, "open: resistance above the threshold"),
        (Self::LOW, "shorted: resistance below the threshold"),
        (Self::REFERENCE_HIGH, "open: REFIN- high"),
        (Self::REFERENCE_LOW, "shorted to ground: REFIN- low"),
        (Self::INPUT_LOW, "shorted to ground: RTDIN- low"),
        (Self::VOLTAGE, "voltage outside the supply"),
    ];

    /// The register; 0 means no fault.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether any of `others` is set.
    #[must_use]
    pub const fn any_of(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }

    /// Whether the sensor or a wire to it is open.
    #[must_use]
    pub const fn is_open(self) -> bool {
        self.any_of(Self(Self::HIGH.0 | Self::REFERENCE_HIGH.0))
    }

    /// Whether the sensor is shorted, or a wire to it is shorted to ground.
    #[must_use]
    pub const fn is_short(self) -> bool {
        self.any_of(Self(
            Self::LOW.0 | Self::REFERENCE_LOW.0 | Self::INPUT_LOW.0,
        ))
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut between = "";
        for (fault, name) in Self::NAMED {
            if self.any_of(fault) {
                write!(f, "{between}{name}")?;
                between = ", ";
            }
        }
        Ok(())
    }
}

/// How the sensor is wired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wires {
    /// Two wires, whose resistance is measured with the sensor.
    Two,
    /// Three equal wires: the converter subtracts the resistance of one.
    Three,
    /// Four wires, whose resistance does not matter.
    Four,
}

/// The mains frequency, which the filter rejects together with its harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mains {
    /// A conversion takes up to 66 ms; consecutive ones 21 ms each.
    Hz50,
    /// A conversion takes up to 55 ms; consecutive ones 17.6 ms each.
    Hz60,
}

/// Conversion mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Conversion {
    /// Continuous: a reading with every call. All wires are checked at the start and after a fault.
    Automatic,
    /// On command: a reading with every second call. All wires are checked before each.
    OneShot,
}

/// A MAX31865 on an SPI bus, mode 1 or 3, at most 5 MHz.
///
/// Nothing waits: a call reads what is available and starts what comes next. At least 70 ms must pass between two
/// calls; the main loop leaves a second.
#[derive(Debug)]
pub struct Max31865<S> {
    bus: S,
    sensor: Platinum,
    /// Resistance of the reference resistor, Ω.
    reference: f32,
    /// Configuration bits that are always set.
    base: u8,
    conversion: Conversion,
    thresholds: [u8; 4],
    /// The current persistent configuration bits; 0 before the first call.
    mode: u8,
    converting: bool,
}

impl<S: SpiDevice> Max31865<S> {
    /// Nothing is sent yet, so the converter may be connected later.
    ///
    /// `reference`: its resistor, Ω; four times the sensor's resistance at 0 °C.
    pub fn new(
        bus: S,
        sensor: Platinum,
        reference: f32,
        wires: Wires,
        mains: Mains,
        conversion: Conversion,
    ) -> Self {
        let wires = match wires {
            Wires::Two | Wires::Four => 0,
            Wires::Three => THREE_WIRES,
        };
        let notch = match mains {
            Mains::Hz50 => NOTCH_50,
            Mains::Hz60 => 0,
        };
        let [low, high] = sensor.limits().map(|ohms| threshold(ohms / reference));
        let ([a, b], [c, d]) = (high, low);
        Self {
            bus,
            sensor,
            reference,
            base: BIAS | wires | notch,
            conversion,
            thresholds: [a, b, c, d],
            mode: 0,
            converting: false,
        }
    }

    /// Returns the bus.
    pub fn release(self) -> S {
        self.bus
    }

    fn read(&mut self) -> Result<[u8; REGISTERS], SensorError> {
        let mut registers = [0; REGISTERS];
        self.bus
            .transaction(&mut [
                Operation::Write(&[CONFIGURATION as u8]),
                Operation::Read(&mut registers),
            ])
            .map_err(|error| SensorError::Spi(error.kind()))?;
        Ok(registers)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), SensorError> {
        self.bus
            .write(bytes)
            .map_err(|error| SensorError::Spi(error.kind()))
    }

    fn command(&mut self, bits: u8) -> Result<(), SensorError> {
        let configuration = self.base | bits;
        self.mode = configuration & STAYS;
        self.write(&[WRITE | CONFIGURATION as u8, configuration])
    }

    /// Writes all settings, clears faults and checks the wires.
    fn start(&mut self) -> Result<(), SensorError> {
        self.converting = false;
        let [a, b, c, d] = self.thresholds;
        self.write(&[WRITE | THRESHOLDS as u8, a, b, c, d])?;
        // The data sheet forbids doing both at once.
        self.command(CLEAR)?;
        self.command(CHECK)
    }

    fn is_ours(&self, registers: &[u8; REGISTERS]) -> bool {
        registers[CONFIGURATION] & STAYS == self.mode
            && registers[THRESHOLDS..FAULTS] == self.thresholds
    }

    /// The temperature, °C; `None` if there is no new reading. At most four short transfers.
    ///
    /// # Errors
    /// [`SensorError::Spi`], [`SensorError::Identity`] if no MAX31865 responds, [`SensorError::Wiring`] with its
    /// faults, or errors due to the resistance.
    pub fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        let registers = self.read()?;
        if !self.is_ours(&registers) {
            // It is new, or has lost power meanwhile; or it is absent, in which case this does not change.
            self.start()?;
            let registers = self.read()?;
            if self.is_ours(&registers) {
                return Ok(None);
            }
            let found = [registers[CONFIGURATION], registers[THRESHOLDS]];
            return Err(SensorError::Identity {
                found: u16::from_be_bytes(found),
            });
        }
        let faults = Faults(registers[FAULTS] & 0xFC);
        if faults.bits() != 0 {
            self.start()?;
            return Err(SensorError::Wiring(faults));
        }
        if !self.converting {
            if registers[CONFIGURATION] & CHECKING == 0 {
                self.command(match self.conversion {
                    Conversion::Automatic => AUTOMATIC,
                    Conversion::OneShot => ONE_SHOT,
                })?;
                self.converting = true;
            }
            return Ok(None);
        }
        if self.conversion == Conversion::OneShot {
            self.converting = false;
            self.command(CHECK)?;
        }
        let result = u16::from_be_bytes([registers[RESULT], registers[RESULT + 1]]) >> 1;
        if result == 0 {
            // As after power-up: no conversion is complete. A short would be a fault.
            return Ok(None);
        }
        let ohms = f32::from(result) / FULL_SCALE * self.reference;
        self.sensor.celsius(ohms).map(Some)
    }
}

/// A threshold register; limited to full scale, which an open sensor reads.
fn threshold(ratio: f32) -> [u8; 2] {
    // The cast saturates; NaN becomes 0.
    let code = (ratio * FULL_SCALE) as u16;
    (code.min(0x7FFF) << 1).to_be_bytes()
}
