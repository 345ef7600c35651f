//! Maxim MAX31865: platinum sensors over SPI, 15 bits of a reference resistor.
//!
//! Registers and faults are those of its data sheet (19-6478, revision 3).

use core::fmt;

use embedded_hal::spi::{Error, Operation, SpiDevice};

use crate::{Curve, Platinum, SensorError};

/// Registers that it has, from 0: configuration, result, high and low threshold (two each), faults.
const REGISTERS: usize = 8;
const CONFIGURATION: usize = 0;
const RESULT: usize = 1;
const THRESHOLDS: usize = 3;
const FAULTS: usize = 7;
/// Added to the number of a register that is written.
const WRITE: u8 = 0x80;

/// The sensor is fed. Always: there is no time to wait for it to settle.
const BIAS: u8 = 0x80;
const AUTOMATIC: u8 = 0x40;
const ONE_SHOT: u8 = 0x20;
const THREE_WIRES: u8 = 0x10;
/// A check of the wires with its own timing; 0 again when it has ended.
const CHECK: u8 = 0x04;
const CHECKING: u8 = 0x0C;
const CLEAR: u8 = 0x02;
const NOTCH_50: u8 = 0x01;
/// What of the configuration stays as it was written.
const STAYS: u8 = BIAS | AUTOMATIC | THREE_WIRES | NOTCH_50;

/// A sensor as large as the reference resistor, in units of the result.
const FULL_SCALE: f32 = 32768.0;

/// What a MAX31865 finds wrong: bits of its fault register. What each is caused by: tables 10 to 12 of the data
/// sheet.
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

    /// The register; 0 is no fault.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether one of `others` is among these.
    #[must_use]
    pub const fn any_of(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }

    /// The sensor or a wire to it is open.
    #[must_use]
    pub const fn is_open(self) -> bool {
        self.any_of(Self(Self::HIGH.0 | Self::REFERENCE_HIGH.0))
    }

    /// The sensor is shorted, or a wire to it to ground.
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
    /// Their resistance is measured with the sensor.
    Two,
    /// Alike: the converter takes off the resistance of one.
    Three,
    /// Their resistance does not matter.
    Four,
}

/// The frequency of the mains, which the filter takes out with its multiples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mains {
    /// A conversion takes up to 66 ms; in a row 21 ms each.
    Hz50,
    /// A conversion takes up to 55 ms; in a row 17.6 ms each.
    Hz60,
}

/// When it converts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Conversion {
    /// Always: a reading with every call. All wires are checked at the start and after a fault.
    Automatic,
    /// On command: a reading with every second call. All wires are checked before each.
    OneShot,
}

/// A MAX31865 on an SPI bus, mode 1 or 3, at most 5 MHz.
///
/// Nothing waits: a call takes what is there and starts what comes next. Between two calls there have to be
/// 70 ms; the main loop leaves a second.
#[derive(Debug)]
pub struct Max31865<S> {
    bus: S,
    sensor: Platinum,
    /// Ω
    reference: f32,
    /// What the configuration always is.
    base: u8,
    conversion: Conversion,
    thresholds: [u8; 4],
    /// What the configuration is now, as far as it stays; 0 before the first call.
    mode: u8,
    converting: bool,
}

impl<S: SpiDevice> Max31865<S> {
    /// Nothing is sent yet: the converter may come later.
    ///
    /// `reference`: its resistor, Ω; four times that of the sensor at 0 °C.
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

    /// Gives the bus back.
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

    /// Sets everything, forgets faults and checks the wires.
    fn start(&mut self) -> Result<(), SensorError> {
        self.converting = false;
        let [a, b, c, d] = self.thresholds;
        self.write(&[WRITE | THRESHOLDS as u8, a, b, c, d])?;
        // Not both at once, says the data sheet.
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
    /// [`SensorError::Spi`], [`SensorError::Identity`] if no MAX31865 answers, [`SensorError::Wiring`] with its
    /// faults, or what the resistance says.
    pub fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        let registers = self.read()?;
        if !self.is_ours(&registers) {
            // New, or it has lost its supply meanwhile; or it is not there, for then it does not change.
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
            // As after power-up: no conversion has ended yet. A short would be a fault.
            return Ok(None);
        }
        let ohms = f32::from(result) / FULL_SCALE * self.reference;
        self.sensor.celsius(ohms).map(Some)
    }
}

/// A threshold register; at most full scale, which an open sensor reads.
fn threshold(ratio: f32) -> [u8; 2] {
    // The cast saturates; not a number becomes 0.
    let code = (ratio * FULL_SCALE) as u16;
    (code.min(0x7FFF) << 1).to_be_bytes()
}
