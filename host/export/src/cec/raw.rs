//! The statements of a file about one table, and their validation.

use super::axes::unknown_axis;
use super::reading::{EncoderValues, LengthUnit, ReadOptions};
use super::variable::{Setting, TableKey};
use super::{CecTable, TravelDirection};
use std::collections::BTreeMap;
use std::ops::Range;
use trueaxis_model::source::FileError;

/// A text from the file, and its bytes.
pub(super) type RawText<'t> = (&'t str, Range<usize>);

/// All statements of a file about one table.
#[derive(Debug)]
pub struct Raw<'t> {
    pub key: TableKey,
    /// First statement.
    pub span: Range<usize>,
    /// Values by their number.
    pub values: BTreeMap<usize, RawText<'t>>,
    /// All other settings.
    pub settings: BTreeMap<Setting, RawText<'t>>,
}

/// A number in the controller's language: `0.005`, `-450`, `5EX-3`.
pub(super) fn number((text, span): &RawText<'_>) -> Result<f64, FileError> {
    let upper = text.to_ascii_uppercase();
    let (mantissa, exponent) = upper.split_once("EX").unwrap_or((&upper, "0"));
    let digits = mantissa.trim_start_matches(['+', '-']);
    let is_plain = digits.bytes().all(|b| b.is_ascii_digit() || b == b'.')
        && digits.bytes().any(|b| b.is_ascii_digit())
        && exponent.parse::<i16>().is_ok();
    let value = format!("{mantissa}e{exponent}").parse::<f64>().ok();
    let value = value.filter(|value| is_plain && value.abs() <= MOST);
    value.ok_or_else(|| {
        FileError::here(
            span.clone(),
            format!("`{text}` is not a number that the controller knows"),
            "write a decimal number with a point, like -0.0048; an exponent is written EX: 4.8EX-3",
        )
    })
}

/// Largest magnitude of a number: far above any position, and any value that a blob can hold.
pub const MOST: f64 = 1e9;
/// Highest number of a table, a value or an encoder: far more than a controller has.
pub(super) const HIGHEST: usize = 99_999;

impl<'t> Raw<'t> {
    pub fn new(key: TableKey, span: Range<usize>) -> Self {
        Self {
            key,
            span,
            values: BTreeMap::new(),
            settings: BTreeMap::new(),
        }
    }

    pub fn error(&self, message: impl Into<String>, remedy: impl Into<String>) -> FileError {
        FileError::at(self.span.clone(), message, "this table", remedy)
    }

    fn missing(&self, setting: Setting) -> FileError {
        let name = setting.name(self.key);
        self.error(
            format!("{} has no {name}", self.key),
            format!("write {name} for it; is the file cut off?"),
        )
    }

    /// The number assigned to a setting, and its place.
    fn set(&self, setting: Setting) -> Result<Option<(f64, Range<usize>)>, FileError> {
        let Some((text, span)) = self.settings.get(&setting) else {
            return Ok(None);
        };
        let text = match (setting, text.to_ascii_uppercase().as_str()) {
            (Setting::Modulo | Setting::Enable, "TRUE") => "1",
            (Setting::Modulo | Setting::Enable, "FALSE") => "0",
            _ => text,
        };
        Ok(Some((number(&(text, span.clone()))?, span.clone())))
    }

    pub fn needed(&self, setting: Setting) -> Result<(f64, Range<usize>), FileError> {
        self.set(setting)?.ok_or_else(|| self.missing(setting))
    }

    /// The value of an optional setting, with a note if it is missing.
    fn otherwise(
        &self,
        setting: Setting,
        doubts: &mut Vec<FileError>,
    ) -> Result<(f64, Range<usize>), FileError> {
        if let Some(set) = self.set(setting)? {
            return Ok(set);
        }
        let (table, name) = (self.key, setting.name(self.key));
        doubts.push(self.error(
            format!("{table} has no {name}: taken as 0"),
            "a controller keeps the old value: state it",
        ));
        Ok((0.0, self.span.clone()))
    }

    /// True if its weight is stated, or if it can have none.
    pub fn has_weight(&self) -> bool {
        !matches!(self.key, TableKey::Table(_)) || self.settings.contains_key(&Setting::Weight)
    }

    fn axis(&self, setting: Setting, reading: &ReadOptions<'_>) -> Result<usize, FileError> {
        let written = self.settings.get(&setting);
        let (name, span) = written.ok_or_else(|| self.missing(setting))?;
        let found = reading.axes.find(name);
        found.ok_or_else(|| unknown_axis(name, span))
    }

    /// The input and the output.
    fn axes(&self, reading: &ReadOptions<'_>) -> Result<[usize; 2], FileError> {
        let input = match self.key {
            TableKey::Table(_) => self.axis(Setting::Input, reading)?,
            TableKey::Encoder { axis, .. } => return Ok([axis, axis]),
        };
        Ok([input, self.axis(Setting::Output, reading)?])
    }

    /// The complete table, in a file with these tables.
    pub fn table(
        &self,
        keys: &[TableKey],
        reading: &ReadOptions<'_>,
        units: Option<LengthUnit>,
        doubts: &mut Vec<FileError>,
    ) -> Result<CecTable, FileError> {
        let [input, output] = self.axes(reading)?;
        let mm = |axis: usize| match (reading.axes.is_rotary(axis), units) {
            (true, _) => Ok(1.0),
            (false, Some(units)) => Ok(units.mm()),
            (false, None) => Err(self.error(
                "the file does not say whether it is metric",
                "write METRIC or INCH at its begin, or give --units",
            )),
        };
        let (of_input, of_output) = (mm(input)?, mm(output)?);
        let modulo = self.modulo(doubts)?;
        let spacing = self.spacing(modulo, of_input, doubts)?;
        if modulo {
            self.check_period(&spacing, input, reading)?;
        }
        let sign = self.sign(keys, reading)?;
        let mut table = CecTable {
            input,
            output,
            spacing,
            values: self.scaled_values(sign * of_output, modulo)?,
            travel: TravelDirection::Both,
            times: None,
            weight: self.set(Setting::Weight)?.map_or(1.0, |(w, _)| w as f32),
        };
        if matches!(self.key, TableKey::Table(_)) {
            table.travel = self.travel(doubts)?;
            table.times = self.times(keys, doubts)?;
        }
        match self.set(Setting::Enable)? {
            Some((value, span)) if value != 1.0 => Err(FileError::here(
                span,
                format!("{} is switched off in the file", self.key),
                "leave the table out, or write 1",
            )),
            _ => Ok(table),
        }
    }

    /// The values in mm or degrees; those of a period without its end.
    fn scaled_values(&self, scale: f64, modulo: bool) -> Result<Vec<f32>, FileError> {
        let values = self.values.values();
        let values = values.clone().map(|v| Ok((scale * number(v)?) as f32));
        let mut values = values.collect::<Result<Vec<f32>, FileError>>()?;
        if modulo && values.pop() != values.first().copied() {
            let last = self.values.values().next_back();
            return Err(FileError::at(
                last.map_or(&self.span, |(_, span)| span).clone(),
                format!("the first and the last value of {} differ", self.key),
                "the last",
                "with IS_MODULO=1 both are the same position: make them equal",
            ));
        }
        Ok(values)
    }

    /// Whether the table repeats. Generators write −1 for *no*.
    fn modulo(&self, doubts: &mut Vec<FileError>) -> Result<bool, FileError> {
        let (value, span) = self.otherwise(Setting::Modulo, doubts)?;
        let name = Setting::Modulo.name(self.key);
        match value {
            1.0 => Ok(true),
            0.0 => Ok(false),
            -1.0 => {
                doubts.push(FileError::here(
                    span,
                    format!("{name}=-1 is taken as 0"),
                    "write 0 if the table does not repeat, 1 if it does",
                ));
                Ok(false)
            }
            _ => Err(FileError::here(
                span,
                format!("{name} is neither 0 nor 1"),
                "write 1 if the table repeats, otherwise 0",
            )),
        }
    }

    fn travel(&self, doubts: &mut Vec<FileError>) -> Result<TravelDirection, FileError> {
        let (value, span) = self.otherwise(Setting::Direction, doubts)?;
        match value {
            0.0 => Ok(TravelDirection::Both),
            1.0 => Ok(TravelDirection::Positive),
            -1.0 => Ok(TravelDirection::Negative),
            _ => Err(FileError::here(
                span,
                "$AN_CEC_DIRECTION is none of 0, 1 and -1",
                "write 0 for both directions of travel, 1 or -1 for one",
            )),
        }
    }

    /// Index of the table that this one is multiplied by.
    fn times(
        &self,
        keys: &[TableKey],
        doubts: &mut Vec<FileError>,
    ) -> Result<Option<usize>, FileError> {
        let (value, span) = self.otherwise(Setting::Times, doubts)?;
        if value == 0.0 {
            return Ok(None);
        }
        let is_number = value > 0.0 && value.fract() == 0.0;
        let factor = is_number.then(|| TableKey::Table(value as usize - 1));
        let place = factor.and_then(|factor| keys.iter().position(|key| *key == factor));
        if place.is_some() {
            return Ok(place);
        }
        let message = match factor {
            Some(factor) => format!(
                "{} is multiplied by {factor}, which is not in the file",
                self.key
            ),
            None => "$AN_CEC_MULT_BY_TABLE is not a number of a table".to_owned(),
        };
        let remedy = "write 0, or the number of a table of the file, which is its index + 1";
        Err(FileError::here(span, message, remedy))
    }

    /// The sign of values of encoders.
    fn sign(&self, keys: &[TableKey], reading: &ReadOptions<'_>) -> Result<f64, FileError> {
        let TableKey::Encoder { axis: own, .. } = self.key else {
            return Ok(1.0);
        };
        let is_of_axis =
            |key: &&TableKey| matches!(key, TableKey::Encoder { axis, .. } if *axis == own);
        if keys.iter().filter(is_of_axis).count() > 1 {
            return Err(self.error(
                "both encoders of an axis have a compensation, and one is in use at a time",
                "leave the one in the file that the machine runs with",
            ));
        }
        match reading.encoder {
            Some(EncoderValues::Corrections) => Ok(1.0),
            Some(EncoderValues::Opposite) => Ok(-1.0),
            None => Err(self.error(
                "the meaning of the values of $AA_ENC_COMP is not stated",
                "give --encoder-values corrections if they are to be added to the command, or opposite if the \
                 position that is read is corrected by them",
            )),
        }
    }
}
