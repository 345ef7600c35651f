//! Covariances of error parameters as CSV.
//!
//! The header is `parameter` followed by the names of the parameters. Then there is one row for each, in the same
//! order, which begins with its name. Values are in the product of the units of both parameters (mm, rad, per mmᵏ or
//! radᵏ).

use super::Covariance;
use crate::errors::Parameter;
use crate::formats::csv::CsvTable;
use crate::source::FileError;
use nalgebra::DMatrix;
use std::fmt::Write;
use std::ops::Range;

/// Two numbers count as equal if they differ by less than this fraction; they have ten digits.
const SAME: f64 = 1e-9;
/// Eigenvalues of the correlations that are negative by no more than this are rounding.
const ROUNDING: f64 = 1e-9;

const LAYOUT: &str = "the header is parameter and the names of the parameters as in the error file (EB0A, EXY2, EXCc1, EAAb), then comes one row for each of them in the same order: its name and its covariances";
const VALUES: &str = "write one row for each parameter: its name, then its covariance with each, with a decimal point: 1.5e-12";

/// Reads covariances, and the place of each parameter's name in the header.
///
/// # Errors
/// [`FileError`] with line, column, cause and remedy: whatever [`CsvTable`] refuses, a name that is not a parameter,
/// rows in another order, a negative variance, a matrix that is not symmetric or not positive semidefinite.
pub fn read(text: &str) -> Result<(Covariance, Vec<Range<usize>>), FileError> {
    let table = CsvTable::open(text, 0, LAYOUT, VALUES)?;
    table.begins_with(&["parameter"])?;
    let parameters = table.columns(1, Parameter::parse)?;
    let places = table.header.cells[1..].iter().map(|cell| cell.span.clone());
    let places: Vec<Range<usize>> = places.collect();
    let n = parameters.len();
    let rows = rows(table, &parameters)?;
    let covariance = Covariance {
        parameters,
        matrix: DMatrix::from_fn(n, n, |i, j| rows[i][j].0),
    };
    is_covariance(&covariance, &rows)?;
    Ok((covariance, places))
}

/// The covariances of a parameter with all, each with its place.
type CovarianceRow = Vec<(f64, Range<usize>)>;

fn rows(table: CsvTable<'_>, parameters: &[Parameter]) -> Result<Vec<CovarianceRow>, FileError> {
    let n = parameters.len();
    let mut rows: Vec<CovarianceRow> = Vec::with_capacity(n);
    let mut last = 0..0;
    for row in table {
        let row = row?;
        let Some(parameter) = parameters.get(rows.len()) else {
            return Err(FileError::at(
                row.span,
                format!("there are more rows than the {n} parameters of the header"),
                "the first of them",
                LAYOUT,
            ));
        };
        let name = row.cells[0].text;
        if name != parameter.to_string() {
            let message = format!("this is the row of `{name}`, not of {parameter}");
            return Err(row.error(0, message, "here", LAYOUT));
        }
        let value = |column| Ok((row.number(column)?, row.cells[column].span.clone()));
        rows.push((1..=n).map(value).collect::<Result<_, FileError>>()?);
        last = row.span;
    }
    if rows.len() < n {
        return Err(FileError::at(
            last,
            format!(
                "there are {} rows, the header has {n} parameters",
                rows.len()
            ),
            "the last one",
            LAYOUT,
        ));
    }
    Ok(rows)
}

fn is_covariance(covariance: &Covariance, rows: &[CovarianceRow]) -> Result<(), FileError> {
    let n = rows.len();
    let name = |i: usize| covariance.parameters[i];
    for (i, row) in rows.iter().enumerate() {
        let (variance, span) = &row[i];
        if *variance < 0.0 {
            return Err(FileError::here(
                span.clone(),
                format!("the variance of {} is below 0", name(i)),
                "write the square of its standard uncertainty",
            ));
        }
    }
    pairs_agree(covariance, rows)?;
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

/// Checks that both rows of two parameters have the same covariance, and that it is possible.
fn pairs_agree(covariance: &Covariance, rows: &[CovarianceRow]) -> Result<(), FileError> {
    let name = |i: usize| covariance.parameters[i];
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
                return Err(FileError::here(
                    span.clone(),
                    format!(
                        "{} and {} would be correlated by more than 1",
                        name(i),
                        name(j)
                    ),
                    "a covariance is at most the product of both standard uncertainties",
                ));
            }
        }
    }
    Ok(())
}

/// Writes covariances with all digits.
#[must_use]
pub fn write(covariance: &Covariance) -> String {
    let mut text = String::from("parameter");
    for parameter in &covariance.parameters {
        let _ = write!(text, ",{parameter}");
    }
    text.push('\n');
    for (parameter, row) in (covariance.parameters.iter()).zip(covariance.matrix.row_iter()) {
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
    fn every_mistake_is_reported() {
        for (text, message) in [
            ("", "the file is empty"),
            ("a,EB0A\n", "does not begin with `parameter`"),
            ("parameter;EB0A\n", "separated by semicolons"),
            ("parameter,EB0Q\n", "column 2: `EB0Q` is not a known column"),
            ("parameter,EB0A,EB0A\n", "column 3: `EB0A` is listed twice"),
            ("parameter,EB0A\n", "there are no rows below the header"),
            ("parameter,EB0A,EC0A\nEB0A,1,0\n", "there are 1 rows"),
            ("parameter,EB0A\nEB0A,1\nEB0A,1\n", "more rows than the 1"),
            ("parameter,EB0A\nEC0A,1\n", "the row of `EC0A`, not of EB0A"),
            ("parameter,EB0A\nEB0A,1,2\n", "the row has 3 columns"),
            (
                "parameter,EB0A\nEB0A,inf\n",
                "column 2 (EB0A): `inf` is not a finite number",
            ),
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
