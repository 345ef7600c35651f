//! Numbers written by the command `trueaxis` and by LinuxCNC: a header, then rows.

use std::str::FromStr;

/// The rows, each with the cells of these columns.
///
/// # Errors
/// If a column is missing, or a cell is not a number.
pub fn columns<T: FromStr>(text: &str, names: &[impl AsRef<str>]) -> Result<Vec<Vec<T>>, String> {
    let header: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let place = |name: &str| {
        let found = header.iter().position(|h| *h == name);
        found.ok_or_else(|| format!("there is no column {name} in {header:?}"))
    };
    let places: Vec<usize> = names
        .iter()
        .map(|name| place(name.as_ref()))
        .collect::<Result<_, _>>()?;
    rows(text, |cells| {
        places.iter().map(|&k| cells.get(k).copied()).collect()
    })
}

/// All numbers, row by row.
///
/// # Errors
/// If a cell is not a number, or there is no row.
pub fn numbers(text: &str) -> Result<Vec<Vec<f64>>, String> {
    let rows = rows(text, |cells| Some(cells.to_vec()))?;
    match rows.is_empty() {
        true => Err(format!("no numbers:\n{text}")),
        false => Ok(rows),
    }
}

/// The rows, each with the cells selected by `chosen`.
fn rows<'t, T: FromStr>(
    text: &'t str,
    chosen: impl Fn(&[&'t str]) -> Option<Vec<&'t str>>,
) -> Result<Vec<Vec<T>>, String> {
    let row = |line: &'t str| -> Option<Vec<T>> {
        let cells: Vec<&str> = line.split(',').collect();
        let cells = chosen(&cells)?;
        cells.iter().map(|cell| cell.trim().parse().ok()).collect()
    };
    let rows = text.lines().skip(1);
    rows.map(|line| row(line).ok_or_else(|| format!("not a row of numbers: {line}")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name_and_given_in_the_order_asked_for() {
        let text = "ball,dX,dZ\nlow,1.5, -2\nhigh,3,4e-3\n";
        let rows = columns::<f32>(text, &["dZ", "dX"]);
        assert_eq!(rows, Ok(vec![vec![-2.0, 1.5], vec![4e-3, 3.0]]));
        assert!(columns::<f32>(text, &["dX", "dY"]).is_err());
        assert!(columns::<f32>(text, &["ball"]).is_err());
    }

    #[test]
    fn a_row_without_numbers_is_an_error() {
        assert_eq!(numbers("X,Y\n1, 2\n"), Ok(vec![vec![1.0, 2.0]]));
        assert!(numbers("X,Y\n1,low\n").is_err());
        assert!(numbers("X,Y\n").is_err());
    }
}
