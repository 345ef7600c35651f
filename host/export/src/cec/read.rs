//! Converts the text of a file to tables.

use super::CecTable;
use super::axes::unknown_axis;
use super::limit::{CorrectionLimit, Limited};
use super::multiplied::{self, check_products};
use super::plausibility;
use super::raw::{HIGHEST, Raw, RawText};
use super::reading::{LengthUnit, ReadOptions};
use super::statement::{CecStatement, statements};
use super::variable::{Setting, TableKey, VariableFamily};
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
        has_ended: false,
    };
    for (statement, span) in statements(text)? {
        reader.take(statement, span)?;
    }
    reader.finish()
}

struct CecReader<'t, 'r> {
    reading: &'r ReadOptions<'r>,
    units: Option<LengthUnit>,
    raw: BTreeMap<TableKey, Raw<'t>>,
    limits: Vec<CorrectionLimit>,
    has_ended: bool,
}

impl<'t> CecReader<'t, '_> {
    fn take(&mut self, statement: CecStatement<'t>, span: Range<usize>) -> Result<(), FileError> {
        if self.has_ended {
            return Err(FileError::here(
                span,
                "there is something after the end of the program",
                "leave out the M17 or M30 in between, if it belongs to the tables",
            ));
        }
        match statement {
            CecStatement::Place => {}
            CecStatement::End => self.has_ended = true,
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
            return self.limit(limited, name, indices, (value, span));
        }
        let Some((setting, family)) = Setting::of(name) else {
            return Err(FileError::at(
                span,
                format!("the variable {name} is not one of the compensation"),
                "not understood",
                "leave nothing in the file but $AN_CEC…, $SN_CEC_TABLE_WEIGHT, $AA_ENC_COMP…, $MA_CEC_MAX_SUM and \
                 $MA_CEC_MAX_VELO",
            ));
        };
        let is_value = setting == Setting::Value;
        let Some((key, k)) = self.key(family, is_value, indices, &span)? else {
            return Err(FileError::here(
                span,
                format!("these are not the indices of {name}"),
                "write $AN_CEC[table,point], $AN_CEC_STEP[table], $AA_ENC_COMP[encoder,point,axis], \
                 $AA_ENC_COMP_STEP[encoder,axis], with whole numbers from 0",
            ));
        };
        let new = || Raw::new(key, span.clone());
        let raw = self.raw.entry(key).or_insert_with(new);
        let written = (value, span.clone());
        let before = match is_value {
            true => raw.values.insert(k, written),
            false => raw.settings.insert(setting, written),
        };
        before.map_or(Ok(()), |_| Err(twice(span)))
    }

    /// The table of a variable, and the number of the value.
    fn key(
        &self,
        family: VariableFamily,
        is_value: bool,
        indices: &[&str],
        span: &Range<usize>,
    ) -> Result<Option<(TableKey, usize)>, FileError> {
        let number = |text: &str| text.parse::<usize>().ok().filter(|n| *n <= HIGHEST);
        let (table, k, axis) = match (family, is_value, indices) {
            (VariableFamily::Table, true, [table, k]) => (table, *k, None),
            (VariableFamily::Table, false, [table]) => (table, "0", None),
            (VariableFamily::Encoder, true, [encoder, k, axis]) => (encoder, *k, Some(axis)),
            (VariableFamily::Encoder, false, [encoder, axis]) => (encoder, "0", Some(axis)),
            _ => return Ok(None),
        };
        let axis = axis.map(|name| {
            let found = self.reading.axes.find(name);
            found.ok_or_else(|| unknown_axis(name, span))
        });
        let axis = axis.transpose()?;
        let key = number(table).map(|number| match axis {
            None => TableKey::Table(number),
            Some(axis) => TableKey::Encoder {
                axis,
                encoder: number,
            },
        });
        Ok(key.zip(number(k)))
    }

    fn limit(
        &mut self,
        limited: Limited,
        name: &str,
        indices: &[&str],
        written: RawText<'t>,
    ) -> Result<(), FileError> {
        let new = CorrectionLimit::read(limited, name, indices, written, self.reading.axes)?;
        let is_known = |known: &CorrectionLimit| known.axis == new.axis && known.limited == limited;
        if self.limits.iter().any(is_known) {
            return Err(twice(new.span));
        }
        self.limits.push(new);
        Ok(())
    }

    /// METRIC or INCH, once and before the first table.
    fn set_units(&mut self, units: LengthUnit, span: Range<usize>) -> Result<(), FileError> {
        let (cause, remedy) = match self.units {
            Some(known) if known != units => (
                "the file has said before that it is in the other unit",
                "leave one of METRIC and INCH",
            ),
            None if !self.raw.is_empty() => (
                "the unit is stated after the first table",
                "write METRIC or INCH at the begin of the file",
            ),
            _ => {
                self.units = Some(units);
                return Ok(());
            }
        };
        Err(FileError::here(span, cause, remedy))
    }

    fn finish(mut self) -> Result<CecContent, FileError> {
        let reading = self.reading;
        let count = self.raw.len();
        if count == 0 {
            return Err(FileError::whole(
                "there is no table in the file",
                "give a file with $AN_CEC or $AA_ENC_COMP, as the controller archives it (_N_NC_CEC_INI)",
            ));
        }
        let mut doubts = Vec::new();
        if !self.has_ended {
            doubts.push(FileError::whole(
                "the file ends without M17",
                "check that it is whole: the controller ends its archives with M17",
            ));
        }
        let mut unweighted = self.raw.values().filter(|raw| !raw.has_weight());
        if let Some(raw) = unweighted.next() {
            let (table, name) = (raw.key, Setting::Weight.name(raw.key));
            let more = match unweighted.count() {
                0 => String::new(),
                more => format!(", and {more} more"),
            };
            doubts.push(raw.error(
                format!("{table} has no {name}{more}: taken as 1"),
                "a controller keeps the old value: state it",
            ));
        }
        let units = self.units.or(reading.units);
        let keys: Vec<TableKey> = self.raw.keys().copied().collect();
        let raw: Vec<&Raw<'_>> = self.raw.values().collect();
        let tables = raw
            .iter()
            .map(|raw| raw.table(&keys, reading, units, &mut doubts));
        let tables = tables.collect::<Result<Vec<CecTable>, _>>()?;
        if count > MOST_TABLES {
            return Err(FileError::whole(
                format!("the file has {count} tables, and a compensation file at most 255"),
                "import the tables of some axes at a time",
            ));
        }
        check_products(&tables, &raw, reading, units)?;
        multiplied::doubts(&tables, &raw, &mut doubts);
        plausibility::doubts(&tables, &raw, reading.axes, &mut doubts);
        let is_length = |limit: &&mut CorrectionLimit| {
            limit.limited == Limited::Sum && !reading.axes.is_rotary(limit.axis)
        };
        let to_mm = units.map_or(1.0, LengthUnit::mm);
        for limit in self.limits.iter_mut().filter(is_length) {
            limit.value *= to_mm;
        }
        Ok(CecContent {
            tables,
            doubts,
            limits: self.limits,
        })
    }
}

/// The error for a repeated assignment.
fn twice(span: Range<usize>) -> FileError {
    FileError::here(
        span,
        "this is assigned a second time",
        "leave one of both; two tables have two numbers",
    )
}
