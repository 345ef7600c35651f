//! `[thermal]`.

use super::{ErrorsFile, ThermalEntry, known};
use crate::errors::{
    ErrorModel, MAX_SENSORS, Parameter, ParameterKind, Thermal, in_three_digits, temperature_name,
};
use crate::machine::Machine;
use crate::source::FileError;
use std::ops::{Range, RangeInclusive};
use trueaxis::Sensor;
use trueaxis_kinematics::MAX_CHANGES;

/// Default range of temperature differences (K).
const RANGE_KELVIN: [f64; 2] = [-20.0, 20.0];
/// The largest possible temperature difference on a machine tool (K), and the largest reference temperature (°C) on
/// either side of zero.
const MAX_KELVIN: f64 = 200.0;
/// Permitted lags (s), within what a blob can store.
const LAGS: RangeInclusive<f64> = 1.0..=1e6;
/// Permitted rates (K/s): what a blob can store.
const RATES: RangeInclusive<f64> = 0.01..=10.0;
/// A machine that is at its reference temperature may also be this much (K) colder or warmer.
const SHOP_KELVIN: f64 = 10.0;
/// Largest plausible temperature on either side of zero (°C): what a blob can store.
const MOST_CELSIUS: f64 = 1000.0;

impl ErrorModel {
    pub(super) fn read_thermal(
        &mut self,
        file: &ErrorsFile,
        machine: &Machine,
    ) -> Result<(), FileError> {
        for (name, span, entry) in file.changes() {
            let parameter = known(name, machine)?;
            let at =
                |[message, remedy]: [String; 2]| FileError::here(span.clone(), message, remedy);
            checked(parameter, entry).map_err(at)?;
            if parameter.kind == ParameterKind::Backlash {
                return Err(FileError::here(
                    name.span(),
                    "backlash cannot depend on temperature",
                    "give the thermal change of an axis location or of a coefficient",
                ));
            }
            let mut same = self.sensors.iter().filter(|s| s.sensor == entry.sensor);
            if same.any(|s| s.reference_celsius != entry.reference_celsius) {
                return Err(two_references(span, &entry.sensor));
            }
            let thermal = followed(parameter, entry).map_err(at)?;
            let sensor = self.add_sensor(thermal).map_err(at)?;
            if !self.set_per_kelvin(machine, parameter, sensor, entry.per_kelvin) {
                return Err(FileError::at(
                    name.span(),
                    format!(
                        "more than {MAX_CHANGES} coefficients of this error motion change with temperature"
                    ),
                    "one too many",
                    "leave out those that change least",
                ));
            }
        }
        Ok(())
    }

    /// Adds a sensor with a lag, or widens its ranges if it is there; returns its place. An error has message and
    /// remedy.
    fn add_sensor(&mut self, new: Thermal) -> Result<usize, [String; 2]> {
        let is_like = |s: &Thermal| {
            s.sensor == new.sensor && in_three_digits(s.lag) == in_three_digits(new.lag)
        };
        if (self.sensors.iter()).any(|s| is_like(s) && s.lag != new.lag) {
            return Err([
                format!("sensor `{}` has two lags with the same first three digits", new.sensor),
                "give both the same lag, or lags that differ in the first three digits: they name the inputs".to_owned(),
            ]);
        }
        let is_it = |s: &Thermal| s.sensor == new.sensor && s.lag == new.lag;
        let known = self.sensors.iter().position(is_it);
        let sensor = known.unwrap_or(self.sensors.len());
        let wider = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        if let Some(known) = self.sensors.get_mut(sensor) {
            known.range_kelvin = wider(known.range_kelvin, new.range_kelvin);
            known.rate = known.rate.max(new.rate);
            known.range_celsius = wider(known.range_celsius, new.range_celsius);
            return Ok(sensor);
        }
        if sensor == MAX_SENSORS || !(1..=16).contains(&new.sensor.len()) {
            return Err([
                format!("sensor `{}` cannot be used", new.sensor),
                format!(
                    "use names of 1 to 16 bytes, and at most {MAX_SENSORS} sensors; each further lag of a sensor counts as one"
                ),
            ]);
        }
        self.sensors.push(new);
        Ok(sensor)
    }

    /// The largest difference (K) from its reference of the temperature that an entry refers to.
    pub(super) fn largest_kelvin(&self, entry: &ThermalEntry) -> f64 {
        let lag = entry.lag_s.unwrap_or(0.0);
        let is_it = |s: &&Thermal| s.sensor == entry.sensor && s.lag == lag;
        let sensor = self.sensors.iter().find(is_it);
        sensor.map_or(0.0, Thermal::largest_kelvin)
    }
}

fn two_references(span: Range<usize>, sensor: &str) -> FileError {
    FileError::at(
        span,
        format!("sensor `{sensor}` has two different reference temperatures"),
        "here the second",
        "give one reference per sensor",
    )
}

impl Thermal {
    /// Rate (K/s) of a sensor in a machine part, which takes minutes to warm up.
    pub const RATE: f64 = 0.1;
    /// Plausible readings (°C) if the file does not say: see [`Sensor::USUAL`].
    pub const RANGE_CELSIUS: [f64; 2] = [5.0, 120.0];

    /// How a servo follows it.
    #[must_use]
    pub fn following(&self) -> Sensor {
        Sensor {
            lag_rate: self.lag_rate(),
            rate: self.rate as f32,
            range: self.range_celsius.map(|t| t as f32),
        }
    }

    /// The largest difference (K) from the reference that a compensation must cover.
    #[must_use]
    pub(crate) fn largest_kelvin(&self) -> f64 {
        self.range_kelvin[1].max(-self.range_kelvin[0])
    }

    /// 1/τ of the lag as a blob stores it (1/s); 0 without a lag.
    #[must_use]
    pub fn lag_rate(&self) -> f32 {
        if self.lag == 0.0 {
            0.0
        } else {
            self.lag.recip() as f32
        }
    }

    /// Name as an input: that of the sensor, with the lag if there is one.
    #[must_use]
    pub fn name(&self) -> String {
        temperature_name(&self.sensor, self.lag_rate())
    }
}

fn within(value: f64) -> bool {
    value.abs() <= MAX_KELVIN
}

/// Refuses values that no machine has, with message and remedy.
fn checked(parameter: Parameter, entry: &ThermalEntry) -> Result<(), [String; 2]> {
    let range = entry.range_kelvin.map_or(RANGE_KELVIN, |range| range.0);
    if !entry.per_kelvin.is_finite() {
        return Err([
            format!("the change of {parameter} per kelvin is not a finite number"),
            "write per_kelvin in the parameter's unit per kelvin".to_owned(),
        ]);
    }
    if !within(entry.reference_celsius) {
        return Err([
            format!(
                "the reference temperature of {parameter} is not a finite number, or over {MAX_KELVIN} °C"
            ),
            "write reference_celsius = 20.0: the temperature of the sensor for which the parameters are written".to_owned(),
        ]);
    }
    if range[0] >= range[1] || !(range[0] <= 0.0 && range[1] >= 0.0) {
        return Err([
            format!("the temperature range of {parameter} is empty or does not contain 0"),
            "write range_kelvin = [below, above] around 0, as differences to the reference"
                .to_owned(),
        ]);
    }
    if !range.into_iter().all(within) {
        return Err([
            format!("the temperature range of {parameter} goes beyond {MAX_KELVIN} K"),
            format!(
                "write range_kelvin = [below, above] within ±{MAX_KELVIN} K: the differences to the reference that the machine sees"
            ),
        ]);
    }
    Ok(())
}

/// The sensor of an entry as a servo follows it; refusals have message and remedy.
fn followed(parameter: Parameter, entry: &ThermalEntry) -> Result<Thermal, [String; 2]> {
    let lag = entry.lag_s.unwrap_or(0.0);
    if entry.lag_s.is_some() && !LAGS.contains(&lag) {
        return Err([
            format!(
                "the lag of {parameter} is not a number from {} to {} s",
                LAGS.start(),
                LAGS.end()
            ),
            "write lag_s, the time in s after which 63 % of a step has arrived, or leave it out"
                .to_owned(),
        ]);
    }
    let rate = entry.rate_kelvin_per_s.unwrap_or(Thermal::RATE);
    if !RATES.contains(&rate) {
        return Err([
            format!(
                "the rate of the temperature of {parameter} is not a number from {} to {} K/s",
                RATES.start(),
                RATES.end()
            ),
            format!(
                "write rate_kelvin_per_s, the fastest change that a sensor on the machine can show, or leave it out: {} K/s",
                Thermal::RATE
            ),
        ]);
    }
    Ok(Thermal {
        sensor: entry.sensor.clone(),
        lag,
        reference_celsius: entry.reference_celsius,
        range_kelvin: entry.range_kelvin.map_or(RANGE_KELVIN, |range| range.0),
        rate,
        range_celsius: plausible(parameter, entry)?,
    })
}

/// The readings (°C) that are no fault of the sensor.
fn plausible(parameter: Parameter, entry: &ThermalEntry) -> Result<[f64; 2], [String; 2]> {
    let reference = entry.reference_celsius;
    let at = |kelvin: f64| reference + kelvin;
    let [low, high] = Thermal::RANGE_CELSIUS;
    let [low, high] = [low.min(at(-SHOP_KELVIN)), high.max(at(SHOP_KELVIN))];
    // Whoever states a range of differences knows that the machine sees them.
    let plausible = match (&entry.range_celsius, &entry.range_kelvin) {
        (Some(range), _) => range.0,
        (None, Some(range)) => [low.min(at(range.0[0])), high.max(at(range.0[1]))],
        (None, None) => [low, high],
    };
    let is_plausible = plausible[0] <= reference && reference <= plausible[1];
    if is_plausible && plausible.iter().all(|t| t.abs() <= MOST_CELSIUS) {
        return Ok(plausible);
    }
    Err([
        format!(
            "the reference of {parameter}, {reference} °C, is not within the plausible temperatures of its sensor, {} to {} °C",
            plausible[0], plausible[1]
        ),
        format!(
            "write range_celsius = [lowest, highest]: the readings that are not a fault of the sensor, within ±{MOST_CELSIUS} °C"
        ),
    ])
}
