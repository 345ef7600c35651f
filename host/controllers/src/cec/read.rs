//! Converts the text of a file to tables.

use super::CecTable;
use super::axes::{NamedAxes, unknown_axis};
use super::multiplied::check_products;
use super::plausibility;
use super::raw::{HIGHEST, MISSING, Raw, number};
use super::reading::{LengthUnit, ReadOptions};
use super::statement::{CecStatement, statements};
use super::variable::{KnownVariable, VariableFamily, VariableKey};
use std::collections::BTreeMap;
use std::ops::Range;
use trueaxis_model::source::FileError;

/// Content of a file.
#[derive(Clone, Debug)]
pub struct CecContent {
    /// Tables in the order of their numbers, followed by those of encoders.
    pub tables: Vec<CecTable>,
    /// Unlikely values, and assumptions that were made.
    pub doubts: Vec<FileError>,
    /// Limits of the corrections, if the file contains their machine data.
    pub limits: Vec<CorrectionLimit>,
}

/// A limit of the correction of an axis in the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectionLimit {
    /// Index of the axis.
    pub axis: usize,
    /// What is limited.
    pub limited: Limited,
    /// The limit, in its unit.
    pub value: f64,
    /// Place in the file.
    pub span: Range<usize>,
}

impl CorrectionLimit {
    /// Lengths are converted like all of the file.
    fn convert(&mut self, axes: &NamedAxes, to_mm: f64) {
        if self.limited == Limited::Sum && !axes.is_rotary(self.axis) {
            self.value *= to_mm;
        }
    }
}

/// What a [`CorrectionLimit`] limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The sum of all tables (MD32720), in mm or degrees.
    Sum,
    /// The rate of change of the sum (MD32730), in per cent of the maximum speed of the axis.
    Velocity,
}

impl Limited {
    fn of(name: &str) -> Option<Self> {
        match name {
            "MA_CEC_MAX_SUM" => Some(Self::Sum),
            "MA_CEC_MAX_VELO" => Some(Self::Velocity),
            _ => None,
        }
    }
}

/// Largest number of tables in a blob.
const MOST_TABLES: usize = 255;

/// Reads a file.
///
/// # Errors
/// [`FileError`] at the first statement that is not understood, or if something is missing.
pub fn read(text: &str, reading: &ReadOptions<'_>) -> Result<CecContent, FileError> {
    let mut reader = CecReader {
        reading,
        units: None,
        raw: BTreeMap::new(),
        limits: Vec::new(),
        gap: None,
        end: None,
    };
    for (statement, span) in statements(text)? {
        reader.take(statement, span)?;
    }
    reader.finish()
}

struct CecReader<'t, 'r> {
    reading: &'r ReadOptions<'r>,
    units: Option<(LengthUnit, Range<usize>)>,
    raw: BTreeMap<VariableKey, Raw<'t>>,
    limits: Vec<CorrectionLimit>,
    /// Where values are first left out.
    gap: Option<Range<usize>>,
    /// The statement that ends the file.
    end: Option<Range<usize>>,
}

impl<'t> CecReader<'t, '_> {
    fn take(&mut self, statement: CecStatement<'t>, span: Range<usize>) -> Result<(), FileError> {
        if self.end.is_some() {
            return Err(FileError::at(
                span,
                "there is something after the end of the program",
                "here",
                "leave out the M17 or M30 in between, if it belongs to the tables",
            ));
        }
        match statement {
            CecStatement::Place => {}
            CecStatement::End => self.end = Some(span),
            CecStatement::Gap => {
                self.gap.get_or_insert(span);
            }
            CecStatement::Units(units) => self.set_units(units, span)?,
            CecStatement::Assignment {
                name,
                indices,
                value,
            } => self.assign(&name, &indices, value, span)?,
        }
        Ok(())
    }

    /// Stores the value assigned to a variable.
    fn assign(
        &mut self,
        name: &str,
        indices: &[&'t str],
        value: &'t str,
        span: Range<usize>,
    ) -> Result<(), FileError> {
        if let Some(limited) = Limited::of(name) {
            return self.limit(limited, name, indices, value, span);
        }
        let Some((kind, what)) = KnownVariable::of(name) else {
            return Err(FileError::at(
                span,
                format!("the variable ${name} is not one of the compensation"),
                "not understood",
                "leave nothing in the file but $AN_CEC…, $SN_CEC_TABLE_WEIGHT, $AA_ENC_COMP…, $MA_CEC_MAX_SUM and $MA_CEC_MAX_VELO",
            ));
        };
        let is_value = what == KnownVariable::Value;
        let Some((key, place)) = self.key(kind, is_value, indices, &span)? else {
            return Err(FileError::at(
                span,
                format!("these are not the indices of ${name}"),
                "here",
                "write $AN_CEC[table,point], $AN_CEC_STEP[table], $AA_ENC_COMP[encoder,point,axis], \
                 $AA_ENC_COMP_STEP[encoder,axis], with whole numbers from 0",
            ));
        };
        let first = || Raw::new(span.clone());
        let raw = self.raw.entry(key).or_insert_with(first);
        let before = match is_value {
            true => raw.values.insert(place, (value, span.clone())),
            false => raw.settings.insert(what, (value, span.clone())),
        };
        match before {
            None => Ok(()),
            Some(_) => Err(twice(span)),
        }
    }

    /// The table and the number of a value that a variable is of.
    fn key(
        &self,
        kind: VariableFamily,
        is_value: bool,
        indices: &[&str],
        span: &Range<usize>,
    ) -> Result<Option<(VariableKey, usize)>, FileError> {
        let number = |text: &str| text.parse::<usize>().ok().filter(|n| *n <= HIGHEST);
        let axis = |text: &str| {
            let axis = self.reading.axes.find(text);
            axis.ok_or_else(|| unknown_axis(text, span))
        };
        Ok(match (kind, is_value, indices) {
            (VariableFamily::Table, true, [table, k]) => number(table)
                .zip(number(k))
                .map(|(t, k)| (VariableKey::Table(t), k)),
            (VariableFamily::Table, false, [table]) => {
                number(table).map(|t| (VariableKey::Table(t), 0))
            }
            (VariableFamily::Encoder, true, [encoder, k, name]) => {
                let axis = axis(name)?;
                number(encoder)
                    .zip(number(k))
                    .map(|(encoder, k)| (VariableKey::Encoder { axis, encoder }, k))
            }
            (VariableFamily::Encoder, false, [encoder, name]) => {
                let axis = axis(name)?;
                number(encoder).map(|encoder| (VariableKey::Encoder { axis, encoder }, 0))
            }
            _ => None,
        })
    }

    /// METRIC or INCH, once and before the first table.
    fn set_units(&mut self, units: LengthUnit, span: Range<usize>) -> Result<(), FileError> {
        let (cause, remedy) = match &self.units {
            Some((known, _)) if *known != units => (
                "the file has said before that it is in the other unit",
                "leave one of METRIC and INCH",
            ),
            None if !self.raw.is_empty() => (
                "the unit is stated after the first table",
                "write METRIC or INCH at the begin of the file",
            ),
            _ => {
                self.units = Some((units, span));
                return Ok(());
            }
        };
        Err(FileError::at(span, cause, "here", remedy))
    }

    /// Stores a limit.
    fn limit(
        &mut self,
        limited: Limited,
        name: &str,
        indices: &[&str],
        value: &str,
        span: Range<usize>,
    ) -> Result<(), FileError> {
        let [axis] = indices else {
            return Err(FileError::at(
                span,
                format!("these are not the indices of ${name}"),
                "here",
                format!("write ${name}[AX1], with one axis"),
            ));
        };
        let axis = (self.reading.axes.find(axis)).ok_or_else(|| unknown_axis(axis, &span))?;
        let value = number(value).filter(|value| *value >= 0.0);
        let value = value.ok_or_else(|| {
            FileError::at(
                span.clone(),
                format!("this is not a limit: ${name} is a number from 0"),
                "here",
                "write a decimal number with a point, like 0.5",
            )
        })?;
        if (self.limits.iter()).any(|known| known.axis == axis && known.limited == limited) {
            return Err(twice(span));
        }
        self.limits.push(CorrectionLimit {
            axis,
            limited,
            value,
            span,
        });
        Ok(())
    }

    fn finish(mut self) -> Result<CecContent, FileError> {
        if self.raw.is_empty() {
            return Err(FileError::whole(
                "there is no table in the file",
                "give a file with $AN_CEC or $AA_ENC_COMP, as the controller archives it (_N_NC_CEC_INI)",
            ));
        }
        let mut doubts = Vec::new();
        let units = self.units.map(|(units, _)| units).or(self.reading.units);
        let mut tables = Vec::new();
        let keys: Vec<VariableKey> = self.raw.keys().copied().collect();
        for (key, raw) in &self.raw {
            let made = raw.table(*key, &keys, self.reading, units, &mut doubts);
            tables.push(made.map_err(|error| left_out(error, self.gap.as_ref()))?);
        }
        if let Some(gap) = self.gap {
            let cause = "this is not understood: no value is missing here";
            let remedy = "leave it out, or write the values";
            return Err(FileError::at(gap, cause, "here", remedy));
        }
        let count = tables.len();
        if count > MOST_TABLES {
            return Err(FileError::whole(
                format!("the file has {count} tables, and a compensation file at most 255"),
                "import the tables of some axes at a time",
            ));
        }
        let raw: Vec<&Raw<'_>> = self.raw.values().collect();
        check_products(&tables, &raw, self.reading, units)?;
        plausibility::doubts(&tables, &raw, self.reading.axes, &mut doubts);
        let to_mm = units.map_or(1.0, LengthUnit::mm);
        self.limits
            .iter_mut()
            .for_each(|limit| limit.convert(self.reading.axes, to_mm));
        Ok(CecContent {
            tables,
            doubts,
            limits: self.limits,
        })
    }
}

/// If values are left out, that is why they are missing.
fn left_out(error: FileError, gap: Option<&Range<usize>>) -> FileError {
    match gap {
        Some(gap) if error.label == MISSING => FileError {
            span: Some(gap.clone()),
            label: "left out here".to_owned(),
            ..error
        },
        _ => error,
    }
}

/// The error for a repeated assignment.
fn twice(span: Range<usize>) -> FileError {
    FileError::at(
        span,
        "this is assigned a second time",
        "here",
        "leave one of both; two tables have two numbers",
    )
}
