//! `errors.toml`.

use super::{
    ErrorModel, MAX_SENSORS, Parameter, ParameterKind, Situation, Switches, Table, Thermal,
};
use crate::machine::Machine;
use crate::source::FileError;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use trueaxis_kinematics::{MAX_CHANGES, MAX_DEGREE};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ErrorsFile {
    machine: Spanned<String>,
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, Spanned<f64>>,
    #[serde(default)]
    standard_uncertainty: BTreeMap<Spanned<String>, Spanned<f64>>,
    #[serde(default)]
    calibrated: BTreeMap<Spanned<String>, Spanned<[f64; 2]>>,
    #[serde(default)]
    thermal: BTreeMap<Spanned<String>, Spanned<ThermalEntry>>,
    #[serde(default)]
    tabulated: BTreeMap<Spanned<String>, Spanned<TabulatedEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ThermalEntry {
    per_kelvin: f64,
    sensor: String,
    reference_celsius: f64,
    range_kelvin: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TabulatedEntry {
    at: Spanned<Vec<f64>>,
    value: Spanned<Vec<f64>>,
}

/// Largest error that can be physical: beyond it the small-error model means nothing.
const MAX_ANGLE: f64 = 0.1;
const MAX_LENGTH: f64 = 100.0;
/// Temperature difference covered unless the file says otherwise (K).
const RANGE_KELVIN: [f64; 2] = [-20.0, 20.0];

impl ErrorModel {
    /// Reads and checks an error file against its machine.
    ///
    /// # Errors
    /// [`FileError`] with place, cause and remedy: syntax, unknown keys and names, another
    /// machine's name, an error of an axis that the machine does not have, a value that cannot
    /// be physical, a table that does not increase.
    pub fn from_toml(text: &str, machine: &Machine) -> Result<Self, FileError> {
        let file: ErrorsFile = toml::from_str(text)?;
        if *file.machine.get_ref() != machine.name {
            return Err(FileError::at(
                file.machine.span(),
                format!(
                    "these errors belong to `{}`, the machine is `{}`",
                    file.machine.get_ref(),
                    machine.name
                ),
                "another machine",
                "use the machine file of this name, or correct the name if it is the same machine",
            ));
        }
        let mut model = ErrorModel::perfect(machine);
        let mut places: BTreeMap<Parameter, Range<usize>> = BTreeMap::new();
        for (name, value) in &file.parameters {
            let parameter = known(name, machine)?;
            let limit = if parameter.is_angular() {
                MAX_ANGLE
            } else {
                MAX_LENGTH
            };
            let v = *value.get_ref();
            let alone = !matches!(parameter.kind, ParameterKind::Degree(k) if k > 0);
            if !v.is_finite() || (alone && v.abs() > limit) {
                return Err(unphysical(
                    value.span(),
                    &parameter.to_string(),
                    limit,
                    parameter.is_angular(),
                ));
            }
            model.set(machine, parameter, v);
            places.insert(parameter, value.span());
        }
        for (name, value) in &file.standard_uncertainty {
            let parameter = known(name, machine)?;
            if !value.get_ref().is_finite() || *value.get_ref() < 0.0 {
                return Err(FileError::at(
                    value.span(),
                    format!("the standard uncertainty of {parameter} is negative or not a number"),
                    "here",
                    "write a value of 0 or more, in the parameter's unit",
                ));
            }
            model
                .standard_uncertainty
                .insert(parameter, *value.get_ref());
        }
        model.read_calibrated(&file, machine)?;
        model.read_thermal(&file, machine)?;
        model.read_tabulated(&file, machine)?;
        model.check_size(machine, &places, &file)?;
        Ok(model)
    }

    fn read_calibrated(&mut self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, range) in &file.calibrated {
            let index = axis(name, machine)?;
            let axis = &machine.axes[index];
            let [low, high] = *range.get_ref();
            if !(low.is_finite() && high.is_finite() && low < high) {
                return Err(FileError::at(
                    range.span(),
                    format!("the calibrated range of axis {} is empty", axis.letter),
                    "lower limit not below upper limit",
                    format!("write [lower, upper] in {}", axis.unit()),
                ));
            }
            self.calibrated[index] = [axis.to_kinematic(low), axis.to_kinematic(high)];
        }
        Ok(())
    }

    fn read_thermal(&mut self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, spanned) in &file.thermal {
            let parameter = known(name, machine)?;
            let entry = spanned.get_ref();
            let range = entry.range_kelvin.unwrap_or(RANGE_KELVIN);
            let numbers = [
                entry.per_kelvin,
                entry.reference_celsius,
                range[0],
                range[1],
            ];
            if numbers.iter().any(|v| !v.is_finite())
                || range[0] >= range[1]
                || range[0] > 0.0
                || range[1] < 0.0
            {
                return Err(FileError::at(
                    spanned.span(),
                    format!(
                        "the thermal entry of {parameter} has a value that is not finite, or a range without 0"
                    ),
                    "here",
                    "write finite numbers, and range_kelvin = [below, above] around 0",
                ));
            }
            let sensor = match self.sensors.iter().position(|s| s.sensor == entry.sensor) {
                Some(index) => {
                    let known = &mut self.sensors[index];
                    if known.reference_celsius != entry.reference_celsius {
                        return Err(FileError::at(
                            spanned.span(),
                            format!(
                                "sensor `{}` has two different reference temperatures",
                                entry.sensor
                            ),
                            "here the second",
                            "give one reference per sensor",
                        ));
                    }
                    known.range_kelvin = [
                        known.range_kelvin[0].min(range[0]),
                        known.range_kelvin[1].max(range[1]),
                    ];
                    index
                }
                None => {
                    if self.sensors.len() == MAX_SENSORS
                        || entry.sensor.is_empty()
                        || entry.sensor.len() > 16
                    {
                        return Err(FileError::at(
                            spanned.span(),
                            format!("sensor `{}` cannot be used", entry.sensor),
                            "here",
                            format!(
                                "use at most {MAX_SENSORS} sensors with names of 1 to 16 bytes"
                            ),
                        ));
                    }
                    self.sensors.push(Thermal {
                        sensor: entry.sensor.clone(),
                        reference_celsius: entry.reference_celsius,
                        range_kelvin: range,
                    });
                    self.sensors.len() - 1
                }
            };
            if parameter.kind == ParameterKind::Backlash {
                return Err(FileError::at(
                    name.span(),
                    "backlash cannot depend on temperature",
                    "here",
                    "give the thermal change of an axis location or of a coefficient",
                ));
            }
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

    fn read_tabulated(&mut self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, spanned) in &file.tabulated {
            let Some((component, letter)) = Parameter::parse_motion(name.get_ref()) else {
                return Err(FileError::at(
                    name.span(),
                    format!("`{}` is no error motion", name.get_ref()),
                    "unknown name",
                    "write E, the direction (X Y Z A B C) and the axis, as in [tabulated.EXX]",
                ));
            };
            let Some(index) = machine.index(letter) else {
                return Err(no_such_axis(name.span(), letter, machine));
            };
            let motion = &mut self.motions[index][component];
            if !motion.coefficients.is_empty() || !motion.thermal.is_empty() {
                return Err(FileError::at(
                    name.span(),
                    format!(
                        "{} is given both as a table and as coefficients",
                        name.get_ref()
                    ),
                    "the table",
                    "keep one of the two",
                ));
            }
            let TabulatedEntry { at, value } = spanned.get_ref();
            let (a, v) = (at.get_ref(), value.get_ref());
            if a.len() != v.len() || a.len() < 2 {
                return Err(FileError::at(
                    value.span(),
                    format!(
                        "{} has {} positions and {} values",
                        name.get_ref(),
                        a.len(),
                        v.len()
                    ),
                    "here",
                    "write as many values as positions, at least two",
                ));
            }
            if let Some(k) = a
                .windows(2)
                .position(|w| w[0].is_nan() || w[1].is_nan() || w[0] >= w[1])
            {
                return Err(FileError::at(
                    at.span(),
                    format!(
                        "the positions of {} do not increase at entry {}",
                        name.get_ref(),
                        k + 2
                    ),
                    "here",
                    "sort the positions and give each only once",
                ));
            }
            let (limit, angular) = if component >= 3 {
                (MAX_ANGLE, true)
            } else {
                (MAX_LENGTH, false)
            };
            if v.iter().any(|v| !v.is_finite() || v.abs() > limit) {
                return Err(unphysical(value.span(), name.get_ref(), limit, angular));
            }
            let axis = &machine.axes[index];
            let at = a.iter().map(|a| axis.to_kinematic(*a)).collect();
            motion.table = Some(Table {
                at,
                positive: v.clone(),
                negative: None,
            });
        }
        Ok(())
    }

    /// Refuses motions that leave the small-error range anywhere in the travel.
    fn check_size(
        &self,
        machine: &Machine,
        places: &BTreeMap<Parameter, Range<usize>>,
        file: &ErrorsFile,
    ) -> Result<(), FileError> {
        let cold = Situation::default();
        for (index, axis) in machine.axes.iter().enumerate() {
            let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
            for step in 0..=100 {
                let q = low + (high - low) * f64::from(step) / 100.0;
                let Some(error) = self.intra_at(machine, index, q, &cold, &Switches::ALL) else {
                    break;
                };
                for (component, e) in error.iter().enumerate() {
                    let (limit, angular) = if component >= 3 {
                        (MAX_ANGLE, true)
                    } else {
                        (MAX_LENGTH, false)
                    };
                    if e.abs() <= limit {
                        continue;
                    }
                    // Point to the coefficient that contributes most at this place.
                    let degree_of = |p: &Parameter| match p.kind {
                        ParameterKind::Degree(k) => Some(i32::from(k)),
                        _ => None,
                    };
                    let worst = places
                        .iter()
                        .filter(|(p, _)| p.component == component && p.axis == axis.letter.char())
                        .filter_map(|(p, span)| {
                            let share = (self.parameters[p] * q.powi(degree_of(p)?)).abs();
                            Some((share, p, span))
                        })
                        .max_by(|a, b| a.0.total_cmp(&b.0));
                    let (span, name) = match worst {
                        Some((_, p, span)) => (span.clone(), p.to_string()),
                        None => (file.machine.span(), format!("an error of {}", axis.letter)),
                    };
                    let mut error = unphysical(span, &name, limit, angular);
                    error.label = format!(
                        "at {} = {:.1} {}",
                        axis.letter,
                        axis.to_command(q),
                        axis.unit()
                    );
                    error.remedy.push_str("; if it is a polynomial known in a part of the travel only, say where under [calibrated]");
                    return Err(error);
                }
            }
        }
        Ok(())
    }
}

fn known(name: &Spanned<String>, machine: &Machine) -> Result<Parameter, FileError> {
    let Some(parameter) = Parameter::parse(name.get_ref()) else {
        return Err(FileError::at(
            name.span(),
            format!("`{}` is no error parameter", name.get_ref()),
            "unknown name",
            format!(
                "write EB0A (inter-axis), EXY2 (coefficient, degree 0 to {MAX_DEGREE}) or EAAb (backlash)"
            ),
        ));
    };
    if parameter.axis != 'S' && machine.index(parameter.axis).is_none() {
        return Err(no_such_axis(name.span(), parameter.axis, machine));
    }
    Ok(parameter)
}

fn axis(name: &Spanned<String>, machine: &Machine) -> Result<usize, FileError> {
    let mut letters = name.get_ref().chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => machine
            .index(letter)
            .ok_or_else(|| no_such_axis(name.span(), letter, machine)),
        _ => Err(FileError::at(
            name.span(),
            format!("`{}` is no axis", name.get_ref()),
            "unknown axis",
            "write one axis letter",
        )),
    }
}

fn no_such_axis(span: Range<usize>, letter: char, machine: &Machine) -> FileError {
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    FileError::at(
        span,
        format!("the machine has no axis {letter}"),
        "unknown axis",
        format!(
            "{} has the axes {} and the spindle S (inter-axis errors only)",
            machine.name,
            letters.join(" ")
        ),
    )
}

fn unphysical(span: Range<usize>, name: &str, limit: f64, angular: bool) -> FileError {
    let unit = if angular { "rad" } else { "mm" };
    FileError::at(
        span,
        format!("{name} cannot be physical: not a finite number, or over {limit} {unit}"),
        "here",
        "parameters are in mm and rad (1 mrad = 1e-3), coefficients per mm or rad to their degree",
    )
}
