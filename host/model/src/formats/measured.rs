//! A measured error motion as CSV: position and deviation, or position and the deviations after positive and after
//! negative travel. The first line may be a header; empty lines are skipped.

use super::csv::CsvTable;
use crate::source::FileError;

/// A measured motion, in the units of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredMotion {
    /// Positions, increasing.
    pub at: Vec<f64>,
    /// Deviations after positive travel, or for both directions.
    pub positive: Vec<f64>,
    /// Deviations after negative travel, if given.
    pub negative: Option<Vec<f64>>,
}

const REMEDY: &str = "write position,deviation or position,after positive travel,after negative travel in each line, with decimal points";

/// Reads a file.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: whatever [`CsvTable`] refuses, neither two nor three columns, positions
/// that do not increase, fewer than two rows.
pub fn read(text: &str) -> Result<MeasuredMotion, FileError> {
    let table = CsvTable::open(text, 0, REMEDY, REMEDY)?;
    let is_number = |text: &str| text.parse::<f64>().is_ok();
    let header = &table.header.cells;
    // A single cell is a title.
    let named = Some(header.len()).filter(|count| *count > 1);
    let (start, named) = match header.iter().any(|cell| is_number(cell.text)) {
        true => (0, None),
        false => (table.header.span.end, named),
    };
    let mut found = MeasuredMotion::default();
    for row in CsvTable::without_header(text, start, &[], REMEDY) {
        let row = row?;
        let columns = row.cells.len();
        if !(2..=3).contains(&columns) {
            let message = format!("the row has {columns} columns, not two or three");
            return Err(FileError::here(row.span, message, REMEDY));
        }
        if let Some(named) = named.filter(|named| *named != columns) {
            let message = format!("the row has {columns} columns, the header {named}");
            return Err(FileError::here(row.span, message, REMEDY));
        }
        let at = row.increasing(
            0,
            found.at.last().copied(),
            "sort the rows by position and give each only once; the mean of repeated runs, if there are",
        )?;
        found.at.push(at);
        found.positive.push(row.number(1)?);
        if columns == 3 {
            let negative = row.number(2)?;
            found.negative.get_or_insert_default().push(negative);
        }
    }
    if found.at.len() < 2 {
        let message = format!("two positions are needed, the file has {}", found.at.len());
        return Err(FileError::whole(message, REMEDY));
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
    fn every_mistake_is_reported_with_its_line() {
        for (text, line, message) in [
            (
                "0;1\n1;2\n",
                Some(1),
                "the columns are separated by semicolons",
            ),
            ("0\t1\n1\t2\n", Some(1), "the columns are separated by tabs"),
            ("x,y\n0,1\n1,2,3\n", Some(3), "the row has 3 columns, not 2"),
            (
                "position,deviation\n100,1,2\n200,1,5\n",
                Some(2),
                "the row has 3 columns, the header 2",
            ),
            (
                "0,0,5,1\n",
                Some(1),
                "the row has 4 columns, not two or three",
            ),
            (
                "0,1\n1,two\n",
                Some(2),
                "column 2: `two` is not a finite number",
            ),
            (
                "0,1\n1,nan\n",
                Some(2),
                "column 2: `nan` is not a finite number",
            ),
            ("0,1\n1,\n", Some(2), "column 2: the value is missing"),
            (
                "0,1\n5,1\n5,2\n",
                Some(3),
                "column 1: the values must increase, but 5 follows 5",
            ),
            ("0,1\n", None, "two positions are needed, the file has 1"),
            ("x,y\n", None, "two positions are needed, the file has 0"),
            ("", None, "the file is empty"),
        ] {
            let error = read(text).unwrap_err();
            assert_eq!(error.message, message, "{text}");
            assert_eq!(error.line(text), line, "{text}");
            assert!(!error.remedy.is_empty());
        }
    }
}
