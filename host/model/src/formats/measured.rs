//! A measured error motion as CSV: position and deviation, or position and the deviations after
//! positive and after negative travel. The first line may be a header; empty lines are skipped.

use super::cells::{cells, lines, separated};
use crate::source::FileError;

/// What was measured, in the units of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Positions, increasing.
    pub at: Vec<f64>,
    /// Deviations after positive travel, or in both directions.
    pub positive: Vec<f64>,
    /// Deviations after negative travel, if there are.
    pub negative: Option<Vec<f64>>,
}

const REMEDY: &str = "write position,deviation or position,after positive travel,after negative travel in each line, with decimal points";

/// Reads it.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: another separator, another number of columns than two or
/// three, or than in the first row, what is not a finite number, positions that do not increase, fewer
/// than two rows.
pub fn read(text: &str) -> Result<Measured, FileError> {
    let mut found = Measured::default();
    let mut columns = None;
    for (number, (line, start)) in lines(text).enumerate() {
        let whole = start..start + line.len();
        if let Some(error) = separated(line, start) {
            return Err(error);
        }
        let cells = cells(line, start);
        let header = number == 0 && cells.iter().all(|(cell, _)| cell.parse::<f64>().is_err());
        if header {
            continue;
        }
        let wanted = *columns.get_or_insert(cells.len());
        if cells.len() != wanted || !(2..=3).contains(&wanted) {
            return Err(FileError::at(
                whole,
                match wanted {
                    2 | 3 => format!(
                        "the row has {} columns, the first one {wanted}",
                        cells.len()
                    ),
                    _ => format!("the row has {wanted} columns, not two or three"),
                },
                "here",
                REMEDY,
            ));
        }
        let mut row = [0.0; 3];
        for (value, (cell, span)) in row.iter_mut().zip(&cells) {
            match cell.parse::<f64>() {
                Ok(number) if number.is_finite() => *value = number,
                _ => {
                    let span = if span.is_empty() { &whole } else { span };
                    return Err(FileError::at(
                        span.clone(),
                        format!("`{cell}` is not a finite number"),
                        "not a number",
                        REMEDY,
                    ));
                }
            }
        }
        if found.at.last().is_some_and(|last| *last >= row[0]) {
            return Err(FileError::at(
                cells[0].1.clone(),
                format!("the positions do not increase at {}", row[0]),
                "here",
                "sort the rows by position and give each only once; the mean of repeated runs, if there are",
            ));
        }
        found.at.push(row[0]);
        found.positive.push(row[1]);
        if wanted == 3 {
            found.negative.get_or_insert_default().push(row[2]);
        }
    }
    if found.at.len() < 2 {
        return Err(FileError::whole(
            format!(
                "there are {} rows with a position, not at least two",
                found.at.len()
            ),
            REMEDY,
        ));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_or_three_columns_are_read_with_a_header_or_without() {
        let two = read("\u{feff}position,\"deviation\"\r\n-10, 0.5\r\n\r\n20,1e-1\r\n").unwrap();
        assert_eq!(two.at, [-10.0, 20.0]);
        assert_eq!(two.positive, [0.5, 0.1]);
        assert_eq!(two.negative, None);
        let three = read("0,1,2\n1,3,4\n").unwrap();
        assert_eq!(three.positive, [1.0, 3.0]);
        assert_eq!(three.negative, Some(vec![2.0, 4.0]));
    }

    #[test]
    fn every_mistake_is_told_with_its_line() {
        for (text, line, message) in [
            (
                "0;1\n1;2\n",
                Some(1),
                "the columns are separated by semicolons",
            ),
            ("0\t1\n1\t2\n", Some(1), "the columns are separated by tabs"),
            (
                "x,y\n0,1\n1,2,3\n",
                Some(3),
                "the row has 3 columns, the first one 2",
            ),
            (
                "0,0,5,1\n",
                Some(1),
                "the row has 4 columns, not two or three",
            ),
            ("0,1\n1,two\n", Some(2), "`two` is not a finite number"),
            ("0,1\n1,nan\n", Some(2), "`nan` is not a finite number"),
            ("0,1\n1,\n", Some(2), "`` is not a finite number"),
            (
                "0,1\n5,1\n5,2\n",
                Some(3),
                "the positions do not increase at 5",
            ),
            (
                "0,1\n",
                None,
                "there are 1 rows with a position, not at least two",
            ),
            (
                "",
                None,
                "there are 0 rows with a position, not at least two",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert_eq!(error.message, message, "{text}");
            assert_eq!(error.line(text), line, "{text}");
            assert!(!error.remedy.is_empty());
        }
    }
}
