//! `errors.toml`.

mod calibrated;
mod covariance;
mod place;
mod seam;
mod size;
mod tabulated;
mod thermal;

use super::{ErrorModel, Parameter, ParameterKind};
use crate::machine::Machine;
use crate::source::{Exactly, FileError, FileKind, right_case};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use trueaxis_kinematics::{MAX_DEGREE, MAX_HARMONIC};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ErrorsFile {
    machine: Spanned<String>,
    #[serde(default)]
    slopes_beside_squareness: bool,
    #[serde(default)]
    parameters: BTreeMap<Spanned<String>, Spanned<f64>>,
    #[serde(default)]
    standard_uncertainty: BTreeMap<Spanned<String>, Spanned<f64>>,
    #[serde(default)]
    unseen: BTreeMap<Spanned<String>, Spanned<f64>>,
    #[serde(default)]
    calibrated: BTreeMap<Spanned<String>, Spanned<Exactly<2>>>,
    uncertainty: Option<UncertaintyEntry>,
    #[serde(default)]
    thermal: BTreeMap<Spanned<String>, Spanned<ThermalEntries>>,
    #[serde(default)]
    tabulated: BTreeMap<Spanned<String>, Spanned<TabulatedEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UncertaintyEntry {
    /// Name of the covariance file.
    covariance: Option<Spanned<String>>,
    /// What [thermal] leaves of another warm-up or cool-down (µm, 95 % of coordinates).
    thermal_um: Option<Spanned<f64>>,
    /// Standard deviation of a coordinate of the tip by errors that the model lacks (µm).
    misfit_um: Option<Spanned<f64>>,
    /// Like `misfit_um`, of a component of the tool's direction (µrad).
    misfit_urad: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ThermalEntry {
    per_kelvin: f64,
    sensor: String,
    lag_s: Option<f64>,
    reference_celsius: f64,
    range_kelvin: Option<Exactly<2>>,
    rate_kelvin_per_s: Option<f64>,
    range_celsius: Option<Exactly<2>>,
}

/// The changes of one parameter: one `{ … }`, or a list of them.
enum ThermalEntries {
    One(ThermalEntry),
    Several(Vec<Spanned<ThermalEntry>>),
}

impl<'de> Deserialize<'de> for ThermalEntries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = ThermalEntries;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("{ per_kelvin, sensor, reference_celsius }, or a list of them")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<ThermalEntries, A::Error> {
                ThermalEntry::deserialize(MapAccessDeserializer::new(map)).map(ThermalEntries::One)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<ThermalEntries, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(ThermalEntries::Several)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl ErrorsFile {
    /// Every change with temperature: its parameter, its place, and what is written there.
    fn changes(&self) -> impl Iterator<Item = (&Spanned<String>, Range<usize>, &ThermalEntry)> {
        self.thermal.iter().flat_map(|(name, changes)| {
            let all = match changes.get_ref() {
                ThermalEntries::One(entry) => vec![(changes.span(), entry)],
                ThermalEntries::Several(all) => {
                    all.iter().map(|e| (e.span(), e.get_ref())).collect()
                }
            };
            all.into_iter()
                .map(move |(span, entry)| (name, span, entry))
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TabulatedEntry {
    at: Option<Spanned<Vec<f64>>>,
    value: Option<Spanned<Vec<f64>>>,
    positive: Option<Spanned<Vec<f64>>>,
    negative: Option<Spanned<Vec<f64>>>,
    /// A file with positions and deviations, as an alternative to the values above.
    file: Option<Spanned<String>>,
    /// The unit of the values and of their uncertainty.
    unit: Option<Spanned<String>>,
    /// Of each value, or of all values.
    standard_uncertainty: Option<Spanned<Uncertainty>>,
}

/// One number for all values, or one for each.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a number, or a list of as many as positions"
)]
enum Uncertainty {
    All(f64),
    Each(Vec<f64>),
}

/// Largest physically possible error; beyond it the small-error model is invalid.
const MAX_ANGLE: f64 = 0.1;
const MAX_LENGTH: f64 = 100.0;
/// Largest position (mm or deg); no travel is longer.
const MAX_POSITION: f64 = 1e5;

impl ErrorModel {
    /// Reads an error file and validates it against its machine.
    ///
    /// # Errors
    /// [`FileError`] with place, cause and remedy: syntax, unknown keys and names, the name of another machine, an
    /// error of an axis that the machine does not have, a value that is not physically possible everywhere in the
    /// travel at all temperatures, a table whose positions do not increase, a calibrated range with almost nothing
    /// of the travel, an error motion of an axis without limits that does not close over the turn. Files with
    /// measured values or covariances are not read; see [`Self::with_files`].
    pub fn from_toml(text: &str, machine: &Machine) -> Result<Self, FileError> {
        Self::with_files(text, machine, &|name| {
            Err(format!(
                "`{name}` is not read here: errors from text alone have no folder"
            ))
        })
    }

    /// Like `from_toml`, with measured values and covariances in other files. `read` returns the content of a file named in
    /// the error file, or the reason why it cannot.
    ///
    /// # Errors
    /// Those of [`Self::from_toml`], and errors in these files.
    pub fn with_files(
        text: &str,
        machine: &Machine,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, FileError> {
        let file: ErrorsFile = toml::from_str(text).map_err(|error| {
            FileError::swapped(text, FileKind::Machine).unwrap_or_else(|| {
                let mut error = FileError::syntax(&error, text);
                if has_unit(text, error.span.as_ref()) {
                    error.remedy = format!("write a number without unit and quotes: {MM_AND_RAD}");
                }
                error
            })
        })?;
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
        model.slopes_beside_squareness = file.slopes_beside_squareness;
        model.read_parameters(&file, machine)?;
        model.read_thermal(&file, machine)?;
        model.read_tabulated(&file, machine, read)?;
        model.read_calibrated(&file, machine)?;
        model.read_covariance(&file, read)?;
        model.check_size(&file, machine)?;
        model.check_seams(&file, machine)?;
        Ok(model)
    }

    fn read_parameters(&mut self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, value) in &file.parameters {
            let parameter = known(name, machine)?;
            let limit = limit(parameter.component);
            let v = *value.get_ref();
            let alone = !matches!(parameter.kind, ParameterKind::Degree(k) if k > 0);
            if !v.is_finite() || (alone && v.abs() > limit) {
                return Err(unphysical(
                    value.span(),
                    name.get_ref(),
                    parameter.component,
                ));
            }
            self.set(machine, parameter, v);
        }
        for (name, value) in &file.standard_uncertainty {
            let parameter = known(name, machine)?;
            let v = *value.get_ref();
            if !v.is_finite() || v < 0.0 {
                return Err(FileError::here(
                    value.span(),
                    format!("the standard uncertainty of {parameter} is negative or not a number"),
                    "write a value of 0 or more, in the parameter's unit",
                ));
            }
            self.standard_uncertainty.insert(parameter, v);
        }
        self.read_unseen(file, machine)
    }

    fn read_unseen(&mut self, file: &ErrorsFile, machine: &Machine) -> Result<(), FileError> {
        for (name, effect) in &file.unseen {
            let parameter = known(name, machine)?;
            let um = *effect.get_ref();
            let bad = |message: String, remedy: &str| {
                Err(FileError::here(effect.span(), message, remedy))
            };
            if !um.is_finite() || um < 0.0 {
                return bad(
                    format!("what {parameter} changes is negative or not a number"),
                    "write how far 10 µm (10 µrad, 10 µm/m) of it moves the tip, in µm",
                );
            }
            if self.parameters.contains_key(&parameter) {
                return bad(
                    format!("{parameter} has a value and is also listed as not seen"),
                    "remove one of the two",
                );
            }
            self.unseen.insert(parameter, um);
        }
        Ok(())
    }
}

/// The text of a CSV file that is named in the error file.
fn beside(
    name: &Spanned<String>,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<String, FileError> {
    read(name.get_ref()).map_err(|cause| {
        FileError::at(
            name.span(),
            cause,
            "this file",
            "give the path of a CSV file, as seen from the folder of the error file",
        )
    })
}

/// Parses the name of a parameter that the machine can have.
fn known(name: &Spanned<String>, machine: &Machine) -> Result<Parameter, FileError> {
    let Some(parameter) = Parameter::parse(name.get_ref()) else {
        return Err(FileError::at(
            name.span(),
            format!("`{}` is not an error parameter", name.get_ref()),
            "unknown name",
            match right_case(name.get_ref(), |n| Parameter::parse(n).is_some()) {
                Some(right) => {
                    format!("write {right}: lower-case letters are c, s and b after the axis")
                }
                None => format!(
                    "write EB0A (inter-axis), EXY2 (coefficient, degree 0 to {MAX_DEGREE}), EXCc1 or EXCs1 (cosine, sine of 1 to {MAX_HARMONIC} times the angle of a rotary axis) or EAAb (backlash)"
                ),
            },
        ));
    };
    if parameter.axis == 'S' {
        return Ok(parameter);
    }
    let Some(index) = machine.index(parameter.axis) else {
        return Err(no_such_axis(name.span(), parameter.axis, machine));
    };
    let harmonic = matches!(
        parameter.kind,
        ParameterKind::Cosine(_) | ParameterKind::Sine(_)
    );
    if harmonic && !machine.axes[index].letter.is_rotary() {
        let whole = &name.get_ref()[..3];
        return Err(FileError::at(
            name.span(),
            format!(
                "axis {} is linear: harmonics are error motions of rotary axes",
                parameter.axis
            ),
            "cosine or sine of a length",
            format!("write coefficients ({whole}1, {whole}2 …) or a table ([tabulated.{whole}])"),
        ));
    }
    Ok(parameter)
}

/// Parses the name of an axis of the machine.
fn axis(name: &Spanned<String>, machine: &Machine) -> Result<usize, FileError> {
    let mut letters = name.get_ref().chars();
    match (letters.next(), letters.next()) {
        (Some(letter), None) => machine
            .index(letter)
            .ok_or_else(|| no_such_axis(name.span(), letter, machine)),
        _ => Err(FileError::at(
            name.span(),
            format!("`{}` is not an axis", name.get_ref()),
            "unknown axis",
            "write one axis letter",
        )),
    }
}

fn no_such_axis(span: Range<usize>, letter: char, machine: &Machine) -> FileError {
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    if machine.index(letter.to_ascii_uppercase()).is_some() {
        let right = letter.to_ascii_uppercase();
        return FileError::at(
            span,
            format!("the machine has no axis {letter}"),
            "unknown axis",
            format!("write {right}: axes have capital letters"),
        );
    }
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

/// The largest physically possible error of a component (mm or rad).
fn limit(component: usize) -> f64 {
    if component >= 3 {
        MAX_ANGLE
    } else {
        MAX_LENGTH
    }
}

/// `mm` or `rad`.
fn unit(component: usize) -> &'static str {
    if component >= 3 { "rad" } else { "mm" }
}

fn unphysical(span: Range<usize>, name: &str, component: usize) -> FileError {
    let (limit, unit) = (limit(component), unit(component));
    FileError::here(
        span,
        format!("{name} cannot be physical: not a finite number, or over {limit} {unit}"),
        format!("{MM_AND_RAD}; coefficients are per mm or rad to their degree"),
    )
}

/// How values are written.
const MM_AND_RAD: &str =
    "values are in mm and rad: 30 µm is 30e-3, 30 µrad (30 µm/m) is 30e-6, 1 arcsec is 4.85e-6";

/// True if the value at a place is a number with a unit, with or without quotes.
fn has_unit(text: &str, span: Option<&Range<usize>>) -> bool {
    let value = span.and_then(|span| text.get(span.start..)).unwrap_or("");
    let value = value.lines().next().unwrap_or("").trim_start_matches('"');
    let is_number = |c: char| c.is_ascii_digit() || "+-.eE_".contains(c);
    let unit = value.trim_start_matches(is_number).trim_start();
    value.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && [
            "um", "µm", "μm", "mm", "nm", "urad", "µrad", "μrad", "mrad", "rad", "arcsec", "deg",
            "°",
        ]
        .into_iter()
        .any(|known| unit.starts_with(known))
}

/// A part of an error motion, as written in the file.
struct MotionPart<'f> {
    /// Name of the part.
    name: String,
    /// Place in the file.
    span: Range<usize>,
    /// Contribution (mm or rad).
    kind: PartKind<'f>,
}

enum PartKind<'f> {
    /// A coefficient.
    Coefficient(ParameterKind, f64),
    /// A coefficient's change with a sensor over its range of temperatures.
    Change(ParameterKind, f64),
    /// A table.
    Table(&'f super::Table),
}

impl PartKind<'_> {
    /// Contribution (mm or rad) at a position (mm or rad), at the end of the range of temperatures and after
    /// positive travel.
    fn value(&self, q: f64) -> f64 {
        match self {
            Self::Coefficient(kind, value) | Self::Change(kind, value) => value * kind.basis(q),
            Self::Table(table) => table.value(q, 1.0),
        }
    }
}

impl ErrorModel {
    /// The position itself, or the end of the known range where a motion holds its value beyond it.
    fn at_known(&self, index: usize, component: usize, q: f64) -> f64 {
        let [low, high] = self.calibrated[index];
        match self.motions[index][component].holds() {
            true => q.max(low).min(high),
            false => q,
        }
    }

    /// The parts of one error motion.
    fn parts(
        &self,
        file: &ErrorsFile,
        machine: &Machine,
        index: usize,
        component: usize,
    ) -> Vec<MotionPart<'_>> {
        let letter = machine.axes[index].letter.char();
        let of = |name: &Spanned<String>| {
            Parameter::parse(name.get_ref()).filter(|p| {
                p.component == component && p.axis == letter && p.kind != ParameterKind::Inter
            })
        };
        let coefficients = file.parameters.iter().filter_map(|(name, value)| {
            let p = of(name)?;
            Some(MotionPart {
                name: p.to_string(),
                span: value.span(),
                kind: PartKind::Coefficient(p.kind, *value.get_ref()),
            })
        });
        let changes = file.changes().filter_map(|(name, span, entry)| {
            let p = of(name)?;
            Some(MotionPart {
                name: format!("the thermal change of {p}"),
                span,
                kind: PartKind::Change(p.kind, entry.per_kelvin * self.largest_kelvin(entry)),
            })
        });
        let tables = file.tabulated.iter().filter_map(|(name, entry)| {
            let table = self.motions[index][component].table.as_ref()?;
            let motion = Parameter::parse_motion(name.get_ref());
            (motion == Some((component, letter))).then(|| MotionPart {
                name: name.get_ref().clone(),
                span: entry.get_ref().place(entry),
                kind: PartKind::Table(table),
            })
        });
        coefficients.chain(changes).chain(tables).collect()
    }
}

#[cfg(test)]
mod tests;
