//! `[tabulated.EXX]`.

use super::{
    ErrorsFile, MAX_POSITION, TabulatedEntry, Uncertainty, beside, limit, no_such_axis, unphysical,
};
use crate::errors::{ErrorModel, Parameter, Table};
use crate::formats::{measured, units};
use crate::machine::Machine;
use crate::source::{FileError, right_case};
use std::ops::Range;
use toml::Spanned;

/// Largest number of points of one table: every 0.1 mm over a metre.
const MAX_POINTS: usize = 10_000;

impl ErrorModel {
    pub(super) fn read_tabulated(
        &mut self,
        file: &ErrorsFile,
        machine: &Machine,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<(), FileError> {
        for (name, spanned) in &file.tabulated {
            let (index, component) = motion(name, machine)?;
            let motion = &self.motions[index][component];
            if !(motion.coefficients.is_empty()
                && motion.harmonics.is_empty()
                && motion.thermal.is_empty())
            {
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
            let table = table(name.get_ref(), spanned, component, read)?;
            let entry = spanned.get_ref();
            let uncertainty = entry.uncertainty(name.get_ref(), component, table.at.len())?;
            let uncertainty = uncertainty.map(|values| ((index, component), values));
            self.table_uncertainty.extend(uncertainty);
            let axis = &machine.axes[index];
            let at = table.at.iter().map(|at| axis.to_kinematic(*at)).collect();
            let table = Table { at, ..table };
            self.tabulate(index, component, table);
        }
        Ok(())
    }
}

impl TabulatedEntry {
    /// The place to point to: its positions, its file, or the whole table.
    pub(super) fn place(&self, spanned: &Spanned<Self>) -> Range<usize> {
        let at = self.at.as_ref().map(Spanned::span);
        let file = self.file.as_ref().map(Spanned::span);
        at.or(file).unwrap_or(spanned.span())
    }

    /// The standard uncertainty (mm or rad) of each of `count` values, if it is given.
    fn uncertainty(
        &self,
        name: &str,
        component: usize,
        count: usize,
    ) -> Result<Option<Vec<f64>>, FileError> {
        let Some(given) = &self.standard_uncertainty else {
            return Ok(None);
        };
        let values = match given.get_ref() {
            Uncertainty::All(value) => vec![*value; count],
            Uncertainty::Each(values) => values.clone(),
        };
        let stated = values.len();
        if stated != count {
            return Err(FileError::here(
                given.span(),
                format!("{name} has {count} positions and {stated} standard uncertainties"),
                "write one for each position, or one number for all",
            ));
        }
        let factor = self.factor(component)?;
        let values: Vec<f64> = values.into_iter().map(|v| v * factor).collect();
        let wrong = values.iter().position(|v| v.is_nan() || *v < 0.0);
        if let Some(number) = wrong.map(|k| k + 1) {
            return Err(FileError::here(
                given.span(),
                format!("standard uncertainty {number} of {name} is negative or not a number"),
                "write values of 0 or more, in the unit of the values",
            ));
        }
        if values.iter().any(|v| *v > limit(component)) {
            return Err(unphysical(
                given.span(),
                &format!("the standard uncertainty of {name}"),
                component,
            ));
        }
        Ok(Some(values))
    }

    /// Size of its unit in mm or rad.
    fn factor(&self, component: usize) -> Result<f64, FileError> {
        let Some(unit) = &self.unit else {
            return Ok(1.0);
        };
        units::factor(unit.get_ref(), component >= 3).map_err(|(message, remedy)| {
            FileError::at(unit.span(), message, "the unit of the values", remedy)
        })
    }
}

/// The axis and the component of a motion.
fn motion(name: &Spanned<String>, machine: &Machine) -> Result<(usize, usize), FileError> {
    let Some((component, letter)) = Parameter::parse_motion(name.get_ref()) else {
        return Err(FileError::at(
            name.span(),
            format!("`{}` is not an error motion", name.get_ref()),
            "unknown name",
            match right_case(name.get_ref(), |n| Parameter::parse_motion(n).is_some()) {
                Some(right) => format!("write [tabulated.{right}]"),
                None => "write E, the direction (X Y Z A B C) and the axis, as in [tabulated.EXX]"
                    .to_owned(),
            },
        ));
    };
    let Some(index) = machine.index(letter) else {
        return Err(no_such_axis(name.span(), letter, machine));
    };
    Ok((index, component))
}

/// Reads one table: positions in mm or degrees, values in mm or rad.
fn table(
    name: &str,
    spanned: &Spanned<TabulatedEntry>,
    component: usize,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<Table, FileError> {
    let entry = spanned.get_ref();
    let factor = entry.factor(component)?;
    let mut table = match &entry.file {
        Some(file) => from_file(name, entry, file, read)?,
        None => written(name, entry, spanned)?,
    };
    let place = entry.place(spanned);
    are_positions(name, &table.at, &place)?;
    let spans = [&entry.value, &entry.positive, &entry.negative];
    let written: Vec<Range<usize>> = spans.into_iter().flatten().map(Spanned::span).collect();
    let values = std::iter::once(&mut table.positive).chain(&mut table.negative);
    for (k, values) in values.enumerate() {
        let span = written.get(k).unwrap_or(&place);
        if values.len() != table.at.len() || table.at.len() < 2 {
            let (positions, values) = (table.at.len(), values.len());
            return Err(FileError::here(
                span.clone(),
                format!("{name} has {positions} positions and {values} values"),
                "write as many values as positions, at least two, with decimal points",
            ));
        }
        for value in values {
            *value *= factor;
            if value.is_nan() || value.abs() > limit(component) {
                let mut error = unphysical(span.clone(), name, component);
                if entry.file.is_some() || entry.unit.is_some() {
                    error.remedy = format!("check unit, the unit of the values; {}", error.remedy);
                }
                return Err(error);
            }
        }
    }
    Ok(table)
}

fn are_positions(name: &str, at: &[f64], place: &Range<usize>) -> Result<(), FileError> {
    if at.len() > MAX_POINTS {
        return Err(FileError::at(
            place.clone(),
            format!("{name} has {} positions", at.len()),
            format!("more than {MAX_POINTS}"),
            "leave out positions between which the error is a straight line within its uncertainty",
        ));
    }
    let increases = |w: &[f64]| w[0] < w[1];
    if let Some(k) = at.windows(2).position(|w| !increases(w)) {
        return Err(FileError::here(
            place.clone(),
            format!("the positions of {name} do not increase at entry {}", k + 2),
            "sort the positions and give each only once",
        ));
    }
    if at.iter().any(|a| a.is_nan() || a.abs() > MAX_POSITION) {
        return Err(FileError::here(
            place.clone(),
            format!("a position of {name} is not a finite number, or over {MAX_POSITION}"),
            "positions are in mm and degrees",
        ));
    }
    Ok(())
}

/// The values from a file.
fn from_file(
    name: &str,
    entry: &TabulatedEntry,
    file: &Spanned<String>,
    read: &dyn Fn(&str) -> Result<String, String>,
) -> Result<Table, FileError> {
    let others = [&entry.at, &entry.value, &entry.positive, &entry.negative];
    if let Some(other) = others.into_iter().flatten().next() {
        return Err(FileError::here(
            other.span(),
            format!("{name} is given both in a file and here"),
            "keep one of the two",
        ));
    }
    if entry.unit.is_none() {
        return Err(FileError::at(
            file.span(),
            format!(
                "the unit of the values in `{}` is not given",
                file.get_ref()
            ),
            "this file",
            "add unit = \"um\" (or mm), of an angle unit = \"arcsec\" (or urad, mrad, rad)",
        ));
    }
    let text = beside(file, read)?;
    let measured = measured::read(&text).map_err(|e| e.within(file.get_ref(), &text))?;
    Ok(Table {
        at: measured.at,
        positive: measured.positive,
        negative: measured.negative,
    })
}

/// The values written in the table itself.
fn written(
    name: &str,
    entry: &TabulatedEntry,
    spanned: &Spanned<TabulatedEntry>,
) -> Result<Table, FileError> {
    let Some(at) = &entry.at else {
        return Err(FileError::here(
            spanned.span(),
            format!("{name} has no positions"),
            "write at = […] and value = […], or file = \"….csv\" and unit = \"um\"",
        ));
    };
    let get = |values: &Spanned<Vec<f64>>| values.get_ref().clone();
    let refused =
        |at: &Spanned<Vec<f64>>, why: &str| Err(directions(at.span(), format!("{name} has {why}")));
    let (positive, negative) = match (&entry.value, &entry.positive, &entry.negative) {
        (Some(value), None, None) => (get(value), None),
        (None, Some(positive), Some(negative)) => (get(positive), Some(get(negative))),
        (Some(_), Some(other), _) | (Some(_), None, Some(other)) => {
            return refused(other, "values for both directions and for one");
        }
        (None, Some(one), None) | (None, None, Some(one)) => {
            return refused(one, "values for one direction of travel only");
        }
        (None, None, None) => return refused(at, "positions without values"),
    };
    Ok(Table {
        at: get(at),
        positive,
        negative,
    })
}

fn directions(span: Range<usize>, message: String) -> FileError {
    FileError::here(
        span,
        message,
        "write value = […], or positive = […] and negative = […] for the two directions of travel",
    )
}
