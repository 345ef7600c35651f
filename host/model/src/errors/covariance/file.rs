//! Covariances of error parameters as CSV.
//!
//! The header is `parameter` and the names of the parameters; then one row for each, in the same order, that
//! begins with its name: in the units of two parameters (mm, rad, per mmᵏ or radᵏ), multiplied.

use super::Covariance;
use crate::errors::Parameter;
use crate::formats::cells::{cells, lines, separated};
use crate::source::FileError;
use nalgebra::DMatrix;
use std::fmt::Write;
use std::ops::Range;

/// Two numbers that are meant to be the same differ by less than this part, if they have ten digits.
const SAME: f64 = 1e-9;
/// Eigenvalues of the correlations that are below 0 by no more than this are rounding.
const ROUNDING: f64 = 1e-9;

const REMEDY: &str = "the header is parameter and the names of the parameters, then comes one row for each of them in the same order: its name and its covariances";

/// Reads them, and where the name of each parameter stands in the header.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: another separator, a name that is none or is listed twice,
/// rows in another order, what is not a finite number, a variance below 0, a matrix that is not symmetric, or none
/// of a covariance (not positive semidefinite).
pub fn read(text: &str) -> Result<(Covariance, Vec<Range<usize>>), FileError> {
    let mut lines = lines(text);
    let Some((first, start)) = lines.next() else {
        return Err(FileError::whole("the file is empty", REMEDY));
    };
    if let Some(error) = separated(first, start) {
        return Err(error);
    }
    let (parameters, places) = header(first, start)?;
    let n = parameters.len();
    let mut rows: Vec<Vec<(f64, Range<usize>)>> = Vec::with_capacity(n);
    let mut last = start..start + first.len();
    for (line, start) in lines {
        last = start..start + line.len();
        if let Some(error) = separated(line, start) {
            return Err(error);
        }
        let Some(parameter) = parameters.get(rows.len()) else {
            return Err(FileError::at(
                last,
                format!("there are more rows than the {n} parameters of the header"),
                "the first of them",
                REMEDY,
            ));
        };
        rows.push(row(line, start, *parameter, n)?);
    }
    if rows.len() < n {
        return Err(FileError::at(
            last,
            format!(
                "there are {} rows, the header has {n} parameters",
                rows.len()
            ),
            "the last one",
            REMEDY,
        ));
    }
    let covariance = Covariance {
        parameters,
        matrix: DMatrix::from_fn(n, n, |i, j| rows[i][j].0),
    };
    is_covariance(&covariance, &rows)?;
    Ok((covariance, places))
}

fn header(line: &str, start: usize) -> Result<(Vec<Parameter>, Vec<Range<usize>>), FileError> {
    let mut names = cells(line, start).into_iter();
    let whole = start..start + line.len();
    if names.next().is_none_or(|(name, _)| name != "parameter") {
        return Err(FileError::at(
            whole,
            "the header does not begin with `parameter`",
            "the header",
            REMEDY,
        ));
    }
    let mut parameters = Vec::new();
    let mut places = Vec::new();
    for (name, span) in names {
        let span = if span.is_empty() { whole.clone() } else { span };
        let Some(parameter) = Parameter::parse(name) else {
            return Err(FileError::at(
                span,
                format!("`{name}` is not an error parameter"),
                "unknown name",
                "write names as in the error file: EB0A, EXY2, EXCc1, EAAb",
            ));
        };
        if parameters.contains(&parameter) {
            return Err(FileError::at(
                span,
                format!("{parameter} is listed twice"),
                "the second one",
                "give every parameter once",
            ));
        }
        parameters.push(parameter);
        places.push(span);
    }
    Ok((parameters, places))
}

fn row(
    line: &str,
    start: usize,
    parameter: Parameter,
    n: usize,
) -> Result<Vec<(f64, Range<usize>)>, FileError> {
    let whole = start..start + line.len();
    let cells = cells(line, start);
    if cells.len() != n + 1 {
        return Err(FileError::at(
            whole,
            format!(
                "the row has {} columns, the header has {}",
                cells.len(),
                n + 1
            ),
            "here",
            REMEDY,
        ));
    }
    let name = parameter.to_string();
    if cells[0].0 != name {
        return Err(FileError::at(
            whole,
            format!("this is the row of `{}`, not of {name}", cells[0].0),
            "here",
            REMEDY,
        ));
    }
    let value = |(text, span): &(&str, Range<usize>)| match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((value, span.clone())),
        _ => Err(FileError::at(
            if span.is_empty() {
                whole.clone()
            } else {
                span.clone()
            },
            format!("`{text}` is not a finite number"),
            "not a number",
            "write numbers with a decimal point: 1.5e-12",
        )),
    };
    cells[1..].iter().map(value).collect()
}

fn is_covariance(
    covariance: &Covariance,
    rows: &[Vec<(f64, Range<usize>)>],
) -> Result<(), FileError> {
    let n = rows.len();
    let name = |i: usize| covariance.parameters[i];
    for (i, row) in rows.iter().enumerate() {
        let (variance, span) = &row[i];
        if *variance < 0.0 {
            return Err(FileError::at(
                span.clone(),
                format!("the variance of {} is below 0", name(i)),
                "here",
                "write the square of its standard uncertainty",
            ));
        }
    }
    for (i, row) in rows.iter().enumerate() {
        for (j, other) in rows.iter().enumerate().take(i) {
            let ((a, span), (b, _)) = (&row[j], &other[i]);
            let largest = row[i].0.sqrt() * other[j].0.sqrt();
            if (a - b).abs() > SAME * largest {
                return Err(FileError::at(
                    span.clone(),
                    format!(
                        "the covariance of {} and {} is {a:e} here and {b:e} in the other row",
                        name(i),
                        name(j)
                    ),
                    "not symmetric",
                    "write the same number in both rows",
                ));
            }
            if a.abs() > largest * (1.0 + SAME) {
                return Err(FileError::at(
                    span.clone(),
                    format!(
                        "{} and {} would be correlated by more than 1",
                        name(i),
                        name(j)
                    ),
                    "here",
                    "a covariance is at most the product of both standard uncertainties",
                ));
            }
        }
    }
    let (correlation, _) = covariance.correlation();
    let least = match n {
        0 => 0.0,
        _ => correlation.symmetric_eigenvalues().min(),
    };
    if least < -ROUNDING * n as f64 {
        return Err(FileError::whole(
            format!(
                "these are no covariances: a combination of parameters would have a variance below 0 ({least:.1e} of theirs)"
            ),
            "use the file as identify has written it, with all its digits",
        ));
    }
    Ok(())
}

/// Writes them, with all digits.
#[must_use]
pub fn write(covariance: &Covariance) -> String {
    let mut text = String::from("parameter");
    for parameter in &covariance.parameters {
        let _ = write!(text, ",{parameter}");
    }
    text.push('\n');
    for (parameter, row) in covariance
        .parameters
        .iter()
        .zip(covariance.matrix.row_iter())
    {
        let _ = write!(text, "{parameter}");
        for value in row.iter() {
            let _ = write!(text, ",{value:e}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let names = ["EB0A", "EXX1"].map(|n| Parameter::parse(n).unwrap());
        let covariance = Covariance {
            parameters: names.to_vec(),
            matrix: DMatrix::from_row_slice(2, 2, &[1e-12 / 3.0, -0.1e-12, -0.1e-12, 0.7e-12]),
        };
        assert_eq!(read(&write(&covariance)).unwrap().0, covariance);
    }

    #[test]
    fn every_mistake_is_told() {
        for (text, message) in [
            ("", "the file is empty"),
            ("a,EB0A\n", "does not begin with `parameter`"),
            ("parameter;EB0A\n", "separated by semicolons"),
            ("parameter,EB0Q\n", "`EB0Q` is not an error parameter"),
            ("parameter,EB0A,EB0A\n", "EB0A is listed twice"),
            ("parameter,EB0A\n", "there are 0 rows"),
            ("parameter,EB0A\nEB0A,1\nEB0A,1\n", "more rows than the 1"),
            ("parameter,EB0A\nEC0A,1\n", "the row of `EC0A`, not of EB0A"),
            ("parameter,EB0A\nEB0A,1,2\n", "the row has 3 columns"),
            ("parameter,EB0A\nEB0A,inf\n", "`inf` is not a finite number"),
            (
                "parameter,EB0A\nEB0A,-1\n",
                "the variance of EB0A is below 0",
            ),
            (
                "parameter,EB0A,EC0A\nEB0A,1,0.5\nEC0A,0.4,1\n",
                "4e-1 here and 5e-1",
            ),
            (
                "parameter,EB0A,EC0A\nEB0A,1,1.5\nEC0A,1.5,1\n",
                "correlated by more than 1",
            ),
            (
                "parameter,EB0A,EC0A,EA0C\nEB0A,1,-0.9,-0.9\nEC0A,-0.9,1,-0.9\nEA0C,-0.9,-0.9,1\n",
                "a variance below 0",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {error}");
        }
    }
}
