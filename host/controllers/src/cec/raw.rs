//! The statements of a file about one table, and their validation.

use super::axes::unknown_axis;
use super::reading::{EncoderValues, LengthUnit, ReadOptions};
use super::variable::{KnownVariable, VariableKey};
use super::{CecTable, TravelDirection};
use std::collections::BTreeMap;
use std::ops::Range;
use trueaxis_model::source::FileError;

/// Label of the error for missing values.
pub(crate) const MISSING: &str = "values are missing";

/// A text from the file, and its bytes.
type RawText<'t> = (&'t str, Range<usize>);

/// All statements of a file about one table.
#[derive(Debug)]
pub struct Raw<'t> {
    /// First statement.
    pub span: Range<usize>,
    /// Values by their number.
    pub values: BTreeMap<usize, RawText<'t>>,
    /// All other settings.
    pub settings: BTreeMap<KnownVariable, RawText<'t>>,
}

/// A number in the controller's language: `0.005`, `-450`, `5EX-3`.
pub(super) fn number(text: &str) -> Option<f64> {
    let upper = text.to_ascii_uppercase();
    let (mantissa, exponent) = upper.split_once("EX").unwrap_or((&upper, "0"));
    let digits = mantissa.trim_start_matches(['+', '-']);
    let is_plain = digits.bytes().all(|b| b.is_ascii_digit() || b == b'.')
        && digits.bytes().any(|b| b.is_ascii_digit());
    exponent.parse::<i16>().ok()?;
    let value = format!("{mantissa}e{exponent}").parse::<f64>().ok()?;
    (is_plain && value.is_finite() && value.abs() <= MOST).then_some(value)
}

/// Largest magnitude of a number: far above any position, and any value that a blob can hold.
pub const MOST: f64 = 1e9;
/// Highest number of a table, a value or an encoder: far more than a controller has.
pub(super) const HIGHEST: usize = 99_999;

fn no_number((text, span): &RawText<'_>) -> FileError {
    FileError::at(
        span.clone(),
        format!("`{text}` is not a number that the controller knows"),
        "here",
        "write a decimal number with a point, like -0.0048; an exponent is written EX: 4.8EX-3",
    )
}

impl<'t> Raw<'t> {
    pub fn new(span: Range<usize>) -> Self {
        Self {
            span,
            values: BTreeMap::new(),
            settings: BTreeMap::new(),
        }
    }

    pub fn error(&self, message: String, label: &str, remedy: impl Into<String>) -> FileError {
        FileError::at(self.span.clone(), message, label, remedy)
    }

    /// The number assigned to a setting, and its place.
    fn set(&self, known: KnownVariable) -> Result<Option<(f64, Range<usize>)>, FileError> {
        let Some(written) = self.settings.get(&known) else {
            return Ok(None);
        };
        let text = match (known, written.0.to_ascii_uppercase().as_str()) {
            (KnownVariable::Modulo | KnownVariable::Enable, "TRUE") => "1",
            (KnownVariable::Modulo | KnownVariable::Enable, "FALSE") => "0",
            _ => written.0,
        };
        let value = number(text).ok_or_else(|| no_number(written))?;
        Ok(Some((value, written.1.clone())))
    }

    pub fn needed(
        &self,
        known: KnownVariable,
        key: VariableKey,
    ) -> Result<(f64, Range<usize>), FileError> {
        self.set(known)?.ok_or_else(|| {
            let name = known.name(key);
            self.error(
                format!("{} has no {name}", key.said()),
                "this table",
                format!("write {name} for it; is the file cut off?"),
            )
        })
    }

    /// The value of an optional setting, with a note if it is missing.
    fn otherwise(
        &self,
        known: KnownVariable,
        key: VariableKey,
        doubts: &mut Vec<FileError>,
    ) -> Result<(f64, Range<usize>), FileError> {
        if let Some(set) = self.set(known)? {
            return Ok(set);
        }
        let name = known.name(key);
        doubts.push(self.error(
            format!("{} has no {name}: taken as 0", key.said()),
            "this table",
            "a controller keeps the old value: state it",
        ));
        Ok((0.0, self.span.clone()))
    }

    fn axis(
        &self,
        known: KnownVariable,
        key: VariableKey,
        reading: &ReadOptions<'_>,
    ) -> Result<usize, FileError> {
        let Some((name, span)) = self.settings.get(&known) else {
            let known = known.name(key);
            return Err(self.error(
                format!("{} has no {known}", key.said()),
                "this table",
                format!("write {known} for it; is the file cut off?"),
            ));
        };
        reading
            .axes
            .find(name)
            .ok_or_else(|| unknown_axis(name, span))
    }

    /// The complete table.
    pub fn table(
        &self,
        key: VariableKey,
        keys: &[VariableKey],
        reading: &ReadOptions<'_>,
        units: Option<LengthUnit>,
        doubts: &mut Vec<FileError>,
    ) -> Result<CecTable, FileError> {
        let (input, output) = match key {
            VariableKey::Table(_) => (
                self.axis(KnownVariable::Input, key, reading)?,
                self.axis(KnownVariable::Output, key, reading)?,
            ),
            VariableKey::Encoder { axis, .. } => (axis, axis),
        };
        let mm = |axis: usize| match (reading.axes.is_rotary(axis), units) {
            (true, _) => Ok(1.0),
            (false, Some(units)) => Ok(units.mm()),
            (false, None) => Err(self.error(
                "the file does not say whether it is metric".to_owned(),
                "the first table with a length",
                "write METRIC or INCH at its begin, or give --units",
            )),
        };
        let (of_input, of_output) = (mm(input)?, mm(output)?);
        let (modulo, _) = self.flag(KnownVariable::Modulo, key, doubts)?;
        let spacing = self.spacing(key, modulo, of_input, doubts)?;
        if modulo {
            self.check_period(key, &spacing, input, reading)?;
        }
        let sign = self.sign(key, keys, reading)?;
        let values = self.scaled_values(key, sign * of_output, modulo)?;
        let (mut travel, mut times, mut weight) = (TravelDirection::Both, None, 1.0);
        if matches!(key, VariableKey::Table(_)) {
            travel = self.travel(key, doubts)?;
            times = self.times(key, keys, doubts)?;
            if let Some((value, _)) = self.set(KnownVariable::Weight)? {
                weight = value as f32;
            }
            self.check_enabled(key)?;
        }
        Ok(CecTable {
            input,
            output,
            spacing,
            values,
            travel,
            weight,
            times,
        })
    }

    /// The values in mm or degrees; those of a period without its end.
    fn scaled_values(
        &self,
        key: VariableKey,
        scale: f64,
        modulo: bool,
    ) -> Result<Vec<f32>, FileError> {
        let mut values = Vec::with_capacity(self.values.len());
        for written in self.values.values() {
            let value = number(written.0).map(|value| scale * value);
            let value = value.filter(|value| value.abs() <= MOST);
            values.push(value.ok_or_else(|| no_number(written))? as f32);
        }
        if modulo {
            let last = values.pop();
            if last != values.first().copied() {
                let span = self.values.values().last().map(|(_, span)| span.clone());
                return Err(FileError {
                    span,
                    ..self.error(
                        format!("the first and the last value of {} differ", key.said()),
                        "the last",
                        "with IS_MODULO=1 both are the same position: make them equal",
                    )
                });
            }
        }
        Ok(values)
    }

    /// A table must not be switched off.
    fn check_enabled(&self, key: VariableKey) -> Result<(), FileError> {
        match self.set(KnownVariable::Enable)? {
            Some((value, span)) if value != 1.0 => Err(FileError::at(
                span,
                format!("{} is switched off in the file", key.said()),
                "here",
                "leave the table out, or write 1",
            )),
            _ => Ok(()),
        }
    }

    /// True if a table is modulo. Generators write −1 for *no*.
    fn flag(
        &self,
        known: KnownVariable,
        key: VariableKey,
        doubts: &mut Vec<FileError>,
    ) -> Result<(bool, Range<usize>), FileError> {
        let (value, span) = self.otherwise(known, key, doubts)?;
        if value == -1.0 {
            doubts.push(FileError::at(
                span.clone(),
                format!("{}=-1 is taken as 0", known.name(key)),
                "here",
                "write 0 if the table does not repeat, 1 if it does",
            ));
        }
        match value {
            1.0 => Ok((true, span)),
            0.0 | -1.0 => Ok((false, span)),
            _ => Err(FileError::at(
                span,
                format!("{} is neither 0 nor 1", known.name(key)),
                "here",
                "write 1 if the table repeats, otherwise 0",
            )),
        }
    }

    fn travel(
        &self,
        key: VariableKey,
        doubts: &mut Vec<FileError>,
    ) -> Result<TravelDirection, FileError> {
        let (value, span) = self.otherwise(KnownVariable::Direction, key, doubts)?;
        match value {
            0.0 => Ok(TravelDirection::Both),
            1.0 => Ok(TravelDirection::Positive),
            -1.0 => Ok(TravelDirection::Negative),
            _ => Err(FileError::at(
                span,
                "$AN_CEC_DIRECTION is none of 0, 1 and -1",
                "here",
                "write 0 for both directions of travel, 1 or -1 for one",
            )),
        }
    }

    /// Index of the table that this one is multiplied by.
    fn times(
        &self,
        key: VariableKey,
        keys: &[VariableKey],
        doubts: &mut Vec<FileError>,
    ) -> Result<Option<usize>, FileError> {
        let (value, span) = self.otherwise(KnownVariable::Times, key, doubts)?;
        if value == 0.0 {
            return Ok(None);
        }
        let is_number = value > 0.0 && value.fract() == 0.0;
        let index = is_number
            .then_some(value as usize)
            .map(|n| VariableKey::Table(n - 1));
        match index.and_then(|index| keys.iter().position(|k| *k == index)) {
            Some(place) => Ok(Some(place)),
            None => Err(FileError::at(
                span,
                match index {
                    Some(index) => format!(
                        "{} is multiplied by {}, which is not in the file",
                        key.said(),
                        index.said()
                    ),
                    None => "$AN_CEC_MULT_BY_TABLE is not a number of a table".to_owned(),
                },
                "here",
                "write 0, or the number of a table of the file, which is its index + 1",
            )),
        }
    }

    /// The sign of values of encoders.
    fn sign(
        &self,
        key: VariableKey,
        keys: &[VariableKey],
        reading: &ReadOptions<'_>,
    ) -> Result<f64, FileError> {
        let VariableKey::Encoder { axis, .. } = key else {
            return Ok(1.0);
        };
        let is_of_axis =
            |k: &&VariableKey| matches!(k, VariableKey::Encoder { axis: a, .. } if *a == axis);
        if keys.iter().filter(is_of_axis).count() > 1 {
            return Err(self.error(
                "both encoders of an axis have a compensation, and one is in use at a time"
                    .to_owned(),
                "one of them",
                "leave the one in the file that the machine runs with",
            ));
        }
        match reading.encoder {
            Some(EncoderValues::Corrections) => Ok(1.0),
            Some(EncoderValues::Opposite) => Ok(-1.0),
            None => Err(self.error(
                "the meaning of the values of $AA_ENC_COMP is not stated".to_owned(),
                "the first of them",
                "give --encoder-values corrections if they are to be added to the command, or opposite if the \
                 position that is read is corrected by them",
            )),
        }
    }
}
