//! Turns sensor readings into the temperature inputs of a compensation.
//!
//! Each sensor is read about once per second and filtered. Each input follows with a bounded rate, as the difference
//! from its reference in K. Without a reading, the last value is held and the input is reported as lost; without any since
//! the start, it becomes 0.
//!
//! ```text
//! sensor ──median of 3──low-pass──▶ °C ──minus reference──bounded rate──▶ K, input of the tables
//! ```

mod filter;

#[cfg(test)]
mod tests;

pub use filter::Filter;

use trueaxis::{AUXILIARIES, Auxiliary, AuxiliaryKind};

/// A temperature sensor: any closure that reads one.
///
/// ```
/// use trueaxis_firmware::temperature::{Settings, Temperatures};
///
/// // With a driver of `trueaxis-sensors`: `|| bed.celsius()`.
/// let bed = || Ok::<_, core::convert::Infallible>(Some(21.5));
/// let mut temperatures = Temperatures::new([("bed", bed)], Settings::MACHINE);
/// for _ in 0..3 {
///     temperatures.poll(1.0);
/// }
/// assert_eq!(temperatures.sensors().next(), Some(("bed", Some(21.5), false, None)));
/// ```
///
/// Sensors of different kinds fit into one array as `&mut dyn FnMut() -> Result<Option<f32>, E>`.
pub trait Thermometer {
    /// Why there is no reading.
    type Error: Copy;

    /// The temperature in °C; `None` if there is no new reading.
    ///
    /// # Errors
    /// The reason why the sensor cannot be read.
    fn celsius(&mut self) -> Result<Option<f32>, Self::Error>;
}

impl<F: FnMut() -> Result<Option<f32>, E>, E: Copy> Thermometer for F {
    type Error = E;

    fn celsius(&mut self) -> Result<Option<f32>, E> {
        self()
    }
}

/// Settings for turning readings into inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Time constant of the low-pass, s.
    pub time_constant: f32,
    /// Largest rate of change of an input, K/s.
    pub rate: f32,
    /// Time without a reading after which a sensor counts as lost, s.
    pub patience: f32,
}

impl Settings {
    /// For machine parts, which take minutes to warm up: 5 s, 0.1 K/s (2 µm/s at 20 µm per kelvin), 5 s.
    pub const MACHINE: Self = Self {
        time_constant: 5.0,
        rate: 0.1,
        patience: 5.0,
    };
}

/// A sensor with its filter.
struct Sensor<T: Thermometer> {
    name: &'static str,
    thermometer: T,
    filter: Filter<T::Error>,
}

/// A temperature input of the compensation.
#[derive(Clone, Copy, Debug)]
struct Input {
    /// Index of its sensor; that after the last one if none has its name.
    sensor: usize,
    /// Reference, °C.
    reference: f32,
    /// Difference from the reference, K; NaN: not known yet.
    value: f32,
}

/// `N` sensors, and the temperature inputs of a compensation.
///
/// In the main loop, call [`poll`](Self::poll) about once per second and [`advance`](Self::advance) as often as is
/// convenient, then pass [`values`](Self::values) and [`lost`](Self::lost) to the servo.
pub struct Temperatures<T: Thermometer, const N: usize> {
    sensors: [Sensor<T>; N],
    inputs: [Option<Input>; AUXILIARIES],
    settings: Settings,
}

impl<T: Thermometer, const N: usize> Temperatures<T, N> {
    /// These sensors, with the names used in compensations; no inputs yet.
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

    /// Adopts the inputs of a compensation. Existing inputs keep their values if the sensor is the same, and move to
    /// another reference as they would to another temperature; the others start at the temperature of their sensor.
    ///
    /// An input whose sensor does not exist is 0 and lost.
    pub fn assign(&mut self, auxiliaries: &[Auxiliary]) {
        let before = self.inputs;
        let wanted = auxiliaries.iter().map(Some).chain(core::iter::repeat(None));
        for ((input, before), auxiliary) in self.inputs.iter_mut().zip(before).zip(wanted) {
            let temperature = auxiliary.filter(|a| a.kind == AuxiliaryKind::Temperature);
            *input = temperature.map(|auxiliary| {
                let named = |sensor: &Sensor<T>| sensor.name == auxiliary.name;
                let sensor = self.sensors.iter().position(named).unwrap_or(N);
                let reference = auxiliary.reference;
                let same = |old: &Input| old.sensor == sensor;
                let old = before.filter(same);
                Input {
                    sensor,
                    reference,
                    value: old.map_or(f32::NAN, |old| old.value),
                }
            });
        }
    }

    /// Reads every sensor once, `elapsed` seconds after the last call.
    ///
    /// Takes as long as the bus driver does, so the main loop calls it, never the servo interrupt.
    pub fn poll(&mut self, elapsed: f32) {
        for sensor in &mut self.sensors {
            let reading = sensor.thermometer.celsius();
            sensor.filter.take(reading, elapsed);
        }
    }

    /// Moves the inputs towards the filtered temperatures, `elapsed` seconds after the last call.
    ///
    /// `free`: corrections are zero, so an input may jump; otherwise its rate is bounded. The first temperature is taken
    /// at once. An input whose sensor is lost before that becomes 0.
    pub fn advance(&mut self, elapsed: f32, free: bool) {
        let step = if elapsed > 0.0 {
            self.settings.rate * elapsed
        } else {
            0.0
        };
        for input in self.inputs.iter_mut().flatten() {
            let filter = self.sensors.get(input.sensor).map(|sensor| &sensor.filter);
            let target = match filter.and_then(Filter::celsius) {
                Some(celsius) => celsius - input.reference,
                None if filter.is_none_or(Filter::is_silent) => 0.0,
                None => continue,
            };
            let change = target - input.value;
            // NaN fails the comparison: the first value is taken as it is.
            input.value = if !free && change.abs() > step {
                input.value + step.copysign(change)
            } else {
                target
            };
        }
    }

    /// Index of each temperature input among the auxiliaries, and its value: the difference from the reference in K; NaN
    /// until the first filtered temperature, or until its sensor counts as absent.
    pub fn values(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        let inputs = self.inputs.iter().enumerate();
        inputs.filter_map(|(number, input)| input.map(|input| (number, input.value)))
    }

    /// The inputs that hold a value because their sensor gives no reading; bit 0 is the first auxiliary.
    #[must_use]
    pub fn lost(&self) -> u8 {
        const { assert!(AUXILIARIES <= 8, "one bit each") };
        let mut lost = 0;
        for (number, input) in self.inputs.iter().enumerate() {
            let Some(input) = input else { continue };
            let sensor = self.sensors.get(input.sensor);
            if sensor.is_none_or(|sensor| sensor.filter.lost()) {
                lost |= 1 << number;
            }
        }
        lost
    }

    /// Each sensor: its name, its filtered temperature in °C, whether it is lost, and the last error since its last
    /// reading.
    pub fn sensors(
        &self,
    ) -> impl Iterator<Item = (&'static str, Option<f32>, bool, Option<T::Error>)> + '_ {
        self.sensors.iter().map(|sensor| {
            let filter = &sensor.filter;
            (sensor.name, filter.celsius(), filter.lost(), filter.error())
        })
    }
}
