//! `calibration.toml`: who calibrated the machine, with what, which limits it has to keep, and what readings do not show. Everything is optional.

use super::limits::{Limit, Quantity};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use toml::Spanned;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::{Exactly, FileError};

/// Longest text, in characters, and the longest description of the method: a report has four pages.
const LONGEST: usize = 48;
const LONGEST_METHOD: usize = 400;
/// Most instruments, temperatures and limits, for the same reason.
const MOST_LISTED: usize = 6;
const MOST_LIMITS: usize = 20;

/// The circumstances of a calibration, and the limits to judge by.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CalibrationRecord {
    /// Number of the report.
    pub number: Option<String>,
    /// Serial number of the machine.
    pub serial_number: Option<String>,
    /// Who measured.
    pub operator: Option<String>,
    /// Laboratory, company or workshop.
    pub laboratory: Option<String>,
    /// Date of the measurement, as written.
    pub date: Option<String>,
    /// How it was measured.
    pub method: Option<String>,
    /// What it was measured with.
    pub instruments: Vec<InstrumentRecord>,
    /// Temperatures during the measurement.
    pub temperatures: Vec<CalibrationTemperature>,
    /// What the machine has to keep.
    pub limits: Vec<Limit>,
    /// Uncertainties that the readings do not show.
    pub uncertainty: StatedUncertainty,
}

/// Standard uncertainties (µm) of a coordinate of the tip by what the readings do not show.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StatedUncertainty {
    /// Form and diameter of the ball, length of the bar, wavelength of the laser.
    pub artefact_um: Option<f64>,
    /// Difference of temperature between machine and artefact, and their coefficients of expansion.
    pub expansion_um: Option<f64>,
    /// Variation of the probe's pre-travel with direction.
    pub lobes_um: Option<f64>,
    /// Errors that repeat between the measured positions: pitch of a screw, teeth of a worm wheel.
    pub periodic_um: Option<f64>,
}

impl StatedUncertainty {
    /// All that are stated, combined (µm).
    pub(super) fn combined_um(&self) -> f64 {
        let all = [
            self.artefact_um,
            self.expansion_um,
            self.lobes_um,
            self.periodic_um,
        ];
        let squares = all.iter().flatten().map(|um| um * um);
        squares.sum::<f64>().sqrt()
    }

    /// True if that of the length reference is stated.
    pub(super) fn has_length(&self) -> bool {
        self.artefact_um.is_some() && self.expansion_um.is_some()
    }
}

/// An instrument or artefact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InstrumentRecord {
    /// Name of the instrument or artefact.
    pub name: String,
    /// Serial number of the instrument or artefact.
    pub serial_number: Option<String>,
    /// Own calibration certificate of the instrument or artefact.
    pub certificate: Option<String>,
    /// The last day on which that is valid, as written.
    pub valid_until: Option<String>,
    /// Lowest and highest temperature during the measurement (°C).
    pub celsius: Option<[f64; 2]>,
}

/// A temperature.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationTemperature {
    /// Where it was measured.
    pub place: String,
    /// Lowest and highest (°C).
    pub celsius: [f64; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationEntries {
    number: Option<Spanned<String>>,
    serial_number: Option<Spanned<String>>,
    operator: Option<Spanned<String>>,
    laboratory: Option<Spanned<String>>,
    date: Option<Spanned<Date>>,
    method: Option<Spanned<String>>,
    #[serde(default)]
    instrument: Vec<Spanned<InstrumentEntry>>,
    #[serde(default)]
    temperature: Vec<Spanned<TemperatureEntry>>,
    #[serde(default)]
    limit: Vec<Spanned<LimitEntry>>,
    #[serde(default)]
    uncertainty: StatedEntry,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedEntry {
    artefact_um: Option<Spanned<f64>>,
    expansion_um: Option<Spanned<f64>>,
    lobes_um: Option<Spanned<f64>>,
    periodic_um: Option<Spanned<f64>>,
}

/// A date in quotes or without.
#[derive(Deserialize)]
#[serde(untagged)]
enum Date {
    Written(String),
    Toml(toml::value::Datetime),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InstrumentEntry {
    name: Spanned<String>,
    serial_number: Option<Spanned<String>>,
    certificate: Option<Spanned<String>>,
    valid_until: Option<Spanned<Date>>,
    celsius: Option<Spanned<Exactly<2>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TemperatureEntry {
    place: Spanned<String>,
    celsius: Spanned<Exactly<2>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitEntry {
    test: Option<Spanned<String>>,
    quantity: Spanned<String>,
    zone: Option<Spanned<String>>,
    um: Option<Spanned<f64>>,
    urad: Option<Spanned<f64>>,
    um_per_m: Option<Spanned<f64>>,
}

impl CalibrationRecord {
    /// Parses the file for a machine.
    ///
    /// # Errors
    /// [`FileError`]: syntax, unknown keys, texts or lists that are too long for four pages, impossible
    /// temperatures, and limits of quantities that the machine does not have, or in another unit.
    pub fn from_toml(text: &str, machine: &Machine) -> Result<Self, FileError> {
        let file: CalibrationEntries =
            toml::from_str(text).map_err(|error| FileError::syntax(&error, text))?;
        few(&file.instrument, MOST_LISTED, "instruments")?;
        few(&file.temperature, MOST_LISTED, "temperatures")?;
        few(&file.limit, MOST_LIMITS, "limits")?;
        let text = |value: Option<Spanned<String>>| optional(value, LONGEST);
        let mut calibration = Self {
            number: text(file.number)?,
            serial_number: text(file.serial_number)?,
            operator: text(file.operator)?,
            laboratory: text(file.laboratory)?,
            date: date(file.date)?,
            method: optional(file.method, LONGEST_METHOD)?,
            uncertainty: StatedUncertainty {
                artefact_um: uncertainty(file.uncertainty.artefact_um)?,
                expansion_um: uncertainty(file.uncertainty.expansion_um)?,
                lobes_um: uncertainty(file.uncertainty.lobes_um)?,
                periodic_um: uncertainty(file.uncertainty.periodic_um)?,
            },
            ..Self::default()
        };
        for entry in file.instrument {
            calibration
                .instruments
                .push(instrument(entry.into_inner())?);
        }
        for entry in file.temperature {
            let entry = entry.into_inner();
            calibration.temperatures.push(CalibrationTemperature {
                place: short(entry.place, LONGEST)?,
                celsius: celsius(entry.celsius)?,
            });
        }
        for entry in file.limit {
            let limit = limit(entry, machine)?;
            calibration.limits.push(limit);
        }
        Ok(calibration)
    }
}

fn instrument(entry: InstrumentEntry) -> Result<InstrumentRecord, FileError> {
    Ok(InstrumentRecord {
        name: short(entry.name, LONGEST)?,
        serial_number: optional(entry.serial_number, LONGEST)?,
        certificate: optional(entry.certificate, LONGEST)?,
        valid_until: date(entry.valid_until)?,
        celsius: entry.celsius.map(celsius).transpose()?,
    })
}

fn few<T>(all: &[Spanned<T>], most: usize, what: &str) -> Result<(), FileError> {
    match all.get(most) {
        None => Ok(()),
        Some(next) => Err(FileError::at(
            next.span(),
            format!(
                "there are {} {what}, and a report has room for {most}",
                all.len()
            ),
            "one too many",
            "leave out those that matter least, or write a second report",
        )),
    }
}

fn short(text: Spanned<String>, longest: usize) -> Result<String, FileError> {
    let span = text.span();
    let text = text.into_inner();
    let bad = |message: String, remedy: &str| Err(FileError::here(span, message, remedy));
    if text.trim().is_empty() {
        return bad(
            "this text is empty".to_owned(),
            "leave it out if it is unknown",
        );
    }
    match text.chars().count() {
        n if n > longest => bad(
            format!("this text has {n} characters, and a report has room for {longest}"),
            "shorten it",
        ),
        _ => Ok(text),
    }
}

fn optional(text: Option<Spanned<String>>, longest: usize) -> Result<Option<String>, FileError> {
    text.map(|text| short(text, longest)).transpose()
}

fn date(date: Option<Spanned<Date>>) -> Result<Option<String>, FileError> {
    let Some(date) = date else { return Ok(None) };
    let span = date.span();
    let written = match date.into_inner() {
        Date::Written(text) => text,
        Date::Toml(date) => date.to_string(),
    };
    short(Spanned::new(span, written), LONGEST).map(Some)
}

fn uncertainty(um: Option<Spanned<f64>>) -> Result<Option<f64>, FileError> {
    let Some(um) = um else { return Ok(None) };
    let number = *um.get_ref();
    match number > 0.0 && number < 1e3 {
        true => Ok(Some(number)),
        false => Err(FileError::here(
            um.span(),
            format!("{number} µm is not a standard uncertainty"),
            "write it in µm, above 0: 0.3. Leave it out if it is unknown",
        )),
    }
}

fn celsius(range: Spanned<Exactly<2>>) -> Result<[f64; 2], FileError> {
    let [low, high] = range.get_ref().0;
    // Below any workshop and above any: a Fahrenheit or kelvin scale, or a slip.
    match (-40.0..=100.0).contains(&low) && (low..=100.0).contains(&high) {
        true => Ok([low, high]),
        false => Err(FileError::here(
            range.span(),
            format!("{low} to {high} °C is not a range of temperatures in a workshop"),
            "write the lowest and the highest in °C: [19.8, 20.6]",
        )),
    }
}

fn limit(entry: Spanned<LimitEntry>, machine: &Machine) -> Result<Limit, FileError> {
    let whole = entry.span();
    let entry = entry.into_inner();
    let span = entry.quantity.span();
    let quantity = Quantity::parse(entry.quantity.get_ref(), machine)
        .map_err(|(message, remedy)| FileError::here(span, message, remedy))?;
    let quantity = in_zone(quantity, entry.zone)?;
    let given = [
        ("um", entry.um),
        ("urad", entry.urad),
        ("um_per_m", entry.um_per_m),
    ];
    let mut given = given.into_iter().filter_map(|(key, at)| Some((key, at?)));
    let keys = quantity.keys();
    let each: Vec<String> = keys.iter().map(|key| format!("{key} = 10.0")).collect();
    let write = format!("write {}", each.join(" or "));
    let (key, at_most) = match (given.next(), given.next()) {
        (Some(one), None) => one,
        (None, _) => return Err(missing(whole, "a limit needs a number", &write)),
        (Some(_), Some((_, second))) => {
            return Err(missing(second.span(), "a limit has one number", &write));
        }
    };
    let number = *at_most.get_ref();
    let bad = |message: String| Err(missing(at_most.span(), &message, &write));
    if !keys.contains(&key) {
        return bad(format!("`{}` is not in {key}", entry.quantity.get_ref()));
    }
    if !(number > 0.0 && number < 1e6) {
        return bad(format!("{number} is not a limit"));
    }
    Ok(Limit {
        test: optional(entry.test, LONGEST)?,
        unit: quantity.unit(),
        quantity,
        at_most: number,
    })
}

/// The quantity in the zone that is stated: the travel by default.
fn in_zone(quantity: Quantity, zone: Option<Spanned<String>>) -> Result<Quantity, FileError> {
    let Some(zone) = zone else {
        return Ok(quantity);
    };
    let (span, name) = (zone.span(), zone.into_inner());
    let bad = |message: String, remedy: &str| Err(FileError::here(span, message, remedy));
    let probed = quantity.in_probed_zone();
    match (name.as_str(), probed) {
        ("probed", Some(probed)) => Ok(probed),
        ("travel", Some(_)) => Ok(quantity),
        (_, None) => bad(
            format!(
                "`{}` has no zone: its test says where it is",
                quantity.name()
            ),
            "leave out zone; tip and direction can have one",
        ),
        (other, _) => bad(
            format!("`{other}` is not a zone"),
            "write \"probed\", where every axis is within its calibrated range, or \"travel\"",
        ),
    }
}

fn missing(span: Range<usize>, message: &str, remedy: &str) -> FileError {
    FileError::here(span, message, remedy)
}
