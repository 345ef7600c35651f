//! Sensors become the temperature inputs of a compensation.
//!
//! Each sensor is read about once per second and filtered; each input follows with a bounded rate,
//! as K difference to its reference. Without a reading, the last value is held and the input is
//! reported as lost.
//!
//! ```text
//! sensor ──median of 3──low-pass──▶ °C ──minus reference──bounded rate──▶ K, input of the tables
//! ```

mod divider;
mod filter;
mod max31865;
mod ntc;
mod platinum;
mod soft_i2c;
mod tmp117;

#[cfg(test)]
mod tests;

pub use divider::{Divider, Resistive, Side};
pub use filter::Filter;
pub use max31865::{Conversion, Faults, Mains, Max31865, Wires};
pub use ntc::Ntc;
pub use platinum::Platinum;
pub use soft_i2c::{Failed, SoftI2c};
pub use tmp117::{Tmp117, Tmp117Address};

use core::fmt;
use embedded_hal::{i2c, spi};
use trueaxis::{AUXILIARIES, Auxiliary, AuxiliaryKind};

/// A temperature sensor.
pub trait Thermometer {
    /// The temperature in °C; `None` if there is no reading since the last one.
    ///
    /// # Errors
    /// Why there is none.
    fn celsius(&mut self) -> Result<Option<f32>, SensorError>;
}

/// So that sensors of different kinds stand in one array, as `&mut dyn Thermometer`.
impl<T: Thermometer + ?Sized> Thermometer for &mut T {
    fn celsius(&mut self) -> Result<Option<f32>, SensorError> {
        T::celsius(self)
    }
}

/// What the temperature of a resistor is.
pub trait Curve {
    /// The temperature, °C, of so many Ω.
    ///
    /// # Errors
    /// [`SensorError::Open`] or [`SensorError::Short`] where no temperature that the sensor is made for has
    /// this resistance; [`SensorError::Implausible`] if it is negative or no number.
    fn celsius(&self, ohms: f32) -> Result<f32, SensorError>;
}

/// Why a sensor gave no temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SensorError {
    /// The I²C bus, or nobody answers.
    Bus(#[cfg_attr(feature = "defmt", defmt(Debug2Format))] i2c::ErrorKind),
    /// The SPI bus.
    Spi(#[cfg_attr(feature = "defmt", defmt(Debug2Format))] spi::ErrorKind),
    /// The analog-to-digital converter gave no value.
    Converter,
    /// Another device answers, or a line of the bus is stuck.
    Identity {
        /// What it says it is.
        found: u16,
    },
    /// The sensor or a wire to it is open: more resistance than it can have.
    Open,
    /// The sensor or its wires are shorted: less resistance than it can have.
    Short,
    /// What a MAX31865 finds wrong with the sensor and its wires.
    Wiring(Faults),
    /// The temperature is not one that the sensor can measure.
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

    /// Whether the sensor is shorted, or a wire to it to ground.
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
            Self::Bus(kind) => write!(f, "bus: {kind}"),
            Self::Spi(kind) => write!(f, "bus: {kind}"),
            Self::Converter => f.write_str("no value from the converter"),
            Self::Identity { found } => write!(f, "not the sensor: it says it is {found:04X}"),
            Self::Open => f.write_str("open"),
            Self::Short => f.write_str("shorted"),
            Self::Wiring(faults) => faults.fmt(f),
            Self::Implausible => f.write_str("a temperature that cannot be"),
        }
    }
}

impl core::error::Error for SensorError {}

/// How readings become inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Time constant of the low-pass, s.
    pub time_constant: f32,
    /// Largest rate of change of an input, K/s.
    pub rate: f32,
    /// Time without a reading after which a sensor is lost, s.
    pub patience: f32,
}

impl Settings {
    /// For machine parts, which take minutes to warm: 5 s, 0.1 K/s (2 µm/s where 20 µm depend on
    /// one kelvin), 5 s.
    pub const MACHINE: Self = Self {
        time_constant: 5.0,
        rate: 0.1,
        patience: 5.0,
    };
}

/// A sensor with its filter.
#[derive(Debug)]
struct Sensor<T> {
    name: &'static str,
    thermometer: T,
    filter: Filter,
}

/// A temperature input of the compensation.
#[derive(Clone, Copy, Debug)]
struct Input {
    /// Number of its sensor, if there is one of its name.
    sensor: Option<usize>,
    /// °C
    reference: f32,
    /// K difference to the reference.
    value: f32,
}

/// `N` sensors, and the temperature inputs of a compensation.
///
/// In the main loop: [`poll`](Self::poll) about once per second, [`advance`](Self::advance) as
/// often as is convenient, then [`values`](Self::values) and [`lost`](Self::lost) to the servo.
#[derive(Debug)]
pub struct Temperatures<T, const N: usize> {
    sensors: [Sensor<T>; N],
    inputs: [Option<Input>; AUXILIARIES],
    settings: Settings,
}

impl<T: Thermometer, const N: usize> Temperatures<T, N> {
    /// These sensors, by the names that compensations call them; no inputs yet.
    pub fn new(sensors: [(&'static str, T); N], settings: Settings) -> Self {
        Self {
            sensors: sensors.map(|(name, thermometer)| Sensor {
                name,
                thermometer,
                filter: Filter::new(settings.time_constant, settings.patience),
            }),
            inputs: [None; AUXILIARIES],
            settings,
        }
    }

    /// Takes the inputs of a compensation. Those of before keep their values where the sensor is the
    /// same, and move on to another reference like to another temperature; the others start at 0.
    ///
    /// An input whose sensor does not exist stays 0 and is lost.
    pub fn assign(&mut self, auxiliaries: &[Auxiliary]) {
        let before = self.inputs;
        let wanted = auxiliaries.iter().map(Some).chain(core::iter::repeat(None));
        for ((input, before), auxiliary) in self.inputs.iter_mut().zip(before).zip(wanted) {
            let temperature = auxiliary.filter(|a| a.kind == AuxiliaryKind::Temperature);
            *input = temperature.map(|auxiliary| {
                let named = |sensor: &Sensor<T>| sensor.name == auxiliary.name;
                let sensor = self.sensors.iter().position(named);
                let reference = auxiliary.reference;
                let same = |old: &Input| old.sensor == sensor;
                let old = before.filter(same);
                Input {
                    sensor,
                    reference,
                    value: old.map_or(0.0, |old| old.value),
                }
            });
        }
    }

    /// Reads every sensor once; `elapsed` seconds after the last time.
    ///
    /// As long as the bus driver takes: the main loop calls it, never the servo interrupt.
    pub fn poll(&mut self, elapsed: f32) {
        for sensor in &mut self.sensors {
            let reading = sensor.thermometer.celsius();
            sensor.filter.take(reading, elapsed);
        }
    }

    /// Moves the inputs towards the filtered temperatures; `elapsed` seconds after the last time.
    ///
    /// `free`: corrections are zero, so that an input may jump; otherwise its rate is bounded.
    pub fn advance(&mut self, elapsed: f32, free: bool) {
        let step = self.settings.rate * elapsed;
        for input in self.inputs.iter_mut().flatten() {
            let sensor = input.sensor.and_then(|number| self.sensors.get(number));
            let Some(celsius) = sensor.and_then(|sensor| sensor.filter.celsius()) else {
                continue;
            };
            let target = celsius - input.reference;
            let change = target - input.value;
            input.value = if free || (-step..=step).contains(&change) {
                target
            } else if change > 0.0 && step > 0.0 {
                input.value + step
            } else if change < 0.0 && step > 0.0 {
                input.value - step
            } else {
                input.value
            };
        }
    }

    /// Number of each temperature input among the auxiliaries, and its value: K difference to the
    /// reference.
    pub fn values(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        let inputs = self.inputs.iter().enumerate();
        inputs.filter_map(|(number, input)| input.map(|input| (number, input.value)))
    }

    /// The inputs that hold a value because their sensor has none; bit 0 is the first auxiliary.
    #[must_use]
    pub fn lost(&self) -> u8 {
        const { assert!(AUXILIARIES <= 8, "one bit each") };
        let mut lost = 0;
        for (number, input) in self.inputs.iter().enumerate() {
            let Some(input) = input else { continue };
            let sensor = input.sensor.and_then(|sensor| self.sensors.get(sensor));
            if sensor.is_none_or(|sensor| sensor.filter.lost()) {
                lost |= 1 << number;
            }
        }
        lost
    }

    /// Each sensor: its name, its filtered temperature in °C, whether it is lost, and the last
    /// error since its last reading.
    pub fn sensors(
        &self,
    ) -> impl Iterator<Item = (&'static str, Option<f32>, bool, Option<SensorError>)> + '_ {
        self.sensors.iter().map(|sensor| {
            let filter = &sensor.filter;
            (sensor.name, filter.celsius(), filter.lost(), filter.error())
        })
    }
}
