//! `[tabulated.EXX]`.

use super::{ErrorsFile, MAX_POSITION, TabulatedEntry, limit, no_such_axis, unphysical};
use crate::errors::{ErrorModel, Parameter, Table};
use crate::machine::Machine;
use crate::source::FileError;
use std::ops::Range;
use toml::Spanned;

/// The most points of one table: every 0.1 mm of a metre.
const MAX_POINTS: usize = 10_000;

impl ErrorModel {
    pub(super) fn read_tabulated(
        &mut self,
        file: &ErrorsFile,
        machine: &Machine,
    ) -> Result<(), FileError> {
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
            let table = table(name.get_ref(), spanned, component, |at| {
                machine.axes[index].to_kinematic(at)
            })?;
            self.tabulate(index, component, table);
        }
        Ok(())
    }
}

/// Reads one table; `to_kinematic` turns its positions into mm or rad.
fn table(
    name: &str,
    spanned: &Spanned<TabulatedEntry>,
    component: usize,
    to_kinematic: impl Fn(f64) -> f64,
) -> Result<Table, FileError> {
    let entry = spanned.get_ref();
    let a = entry.at.get_ref();
    if a.len() > MAX_POINTS {
        return Err(FileError::at(
            entry.at.span(),
            format!("{name} has {} positions", a.len()),
            format!("more than {MAX_POINTS}"),
            "leave out positions between which the error is a straight line within its uncertainty",
        ));
    }
    let increases = |w: &[f64]| w[0] < w[1];
    if let Some(k) = a.windows(2).position(|w| !increases(w)) {
        return Err(FileError::at(
            entry.at.span(),
            format!("the positions of {name} do not increase at entry {}", k + 2),
            "here",
            "sort the positions and give each only once",
        ));
    }
    if a.iter().any(|a| a.is_nan() || a.abs() > MAX_POSITION) {
        return Err(FileError::at(
            entry.at.span(),
            format!("a position of {name} is not a finite number, or over {MAX_POSITION}"),
            "here",
            "positions are in mm and degrees",
        ));
    }
    let read = |values: &Spanned<Vec<f64>>| {
        let v = values.get_ref();
        if v.len() != a.len() || a.len() < 2 {
            return Err(FileError::at(
                values.span(),
                format!("{name} has {} positions and {} values", a.len(), v.len()),
                "here",
                "write as many values as positions, at least two",
            ));
        }
        if v.iter().any(|v| v.is_nan() || v.abs() > limit(component)) {
            return Err(unphysical(values.span(), name, component));
        }
        Ok(v.clone())
    };
    let (positive, negative) = match (&entry.value, &entry.positive, &entry.negative) {
        (Some(value), None, None) => (read(value)?, None),
        (None, Some(positive), Some(negative)) => (read(positive)?, Some(read(negative)?)),
        (Some(_), Some(other), _) | (Some(_), None, Some(other)) => {
            return Err(directions(
                other.span(),
                format!("{name} has values for both directions and for one"),
            ));
        }
        (None, Some(one), None) | (None, None, Some(one)) => {
            return Err(directions(
                one.span(),
                format!("{name} has values for one direction of travel only"),
            ));
        }
        (None, None, None) => {
            return Err(directions(
                entry.at.span(),
                format!("{name} has positions without values"),
            ));
        }
    };
    Ok(Table {
        at: a.iter().map(|a| to_kinematic(*a)).collect(),
        positive,
        negative,
    })
}

fn directions(span: Range<usize>, message: String) -> FileError {
    FileError::at(
        span,
        message,
        "here",
        "write value = […], or positive = […] and negative = […] for the two directions of travel",
    )
}
