//! Rows of X, Y and Z, and bCNC's `.probe`, which begins with three lines about the grid.

use super::{Format, SurfacePoint};
use crate::text_lines::{TextLine, lines};
use trueaxis_model::source::FileError;

/// Distance (in the unit of the file) within which bCNC's six digits are a corner of its grid.
const CORNER: f64 = 1e-2;

/// The points, and who wrote them.
pub fn read(text: &str) -> Result<(Vec<SurfacePoint>, Format), FileError> {
    let all = lines(text);
    let mut all = (all.iter()).filter(|line| !is_remark(line.text)).peekable();
    all.next_if(|line| is_heading(line.text));
    let rows: Vec<(&TextLine<'_>, Vec<f64>)> = all
        .map(|line| Ok((line, numbers(line)?)))
        .collect::<Result<_, FileError>>()?;
    let (points, format) = match counted(&rows) {
        None => (&rows[..], Format::Rows),
        Some(count) if rows.len() == 3 + count => (&rows[3..], Format::Bcnc),
        Some(count) => {
            return Err(rows[0].0.bad(
                format!(
                    "bCNC's first lines say {count} points, and {} follow",
                    rows.len() - 3
                ),
                "probe the whole grid, and save it again",
            ));
        }
    };
    let point = |(line, values): &(&TextLine<'_>, Vec<f64>)| {
        ([values[0], values[1], values[2]], line.span.clone())
    };
    Ok((points.iter().map(point).collect(), format))
}

fn is_remark(line: &str) -> bool {
    let line = line.trim_start_matches('\u{feff}').trim_start();
    line.is_empty() || line.starts_with(['#', ';', '(', '%'])
}

/// True if a line names columns in the order X, Y, Z.
fn is_heading(line: &str) -> bool {
    let words: Vec<&str> = words(line).collect();
    let begins =
        |(word, letter): (&&str, char)| word.starts_with([letter, letter.to_ascii_uppercase()]);
    words.len() >= 3
        && words.iter().zip("xyz".chars()).all(begins)
        && !line.contains(|c: char| c.is_ascii_digit())
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    let words = line.split([' ', '\t', ',']);
    words.filter(|word| !word.is_empty())
}

/// Three numbers or more: LinuxCNC logs those of all nine axes.
fn numbers(line: &TextLine<'_>) -> Result<Vec<f64>, FileError> {
    let text = line.text.trim_start_matches('\u{feff}');
    if has_decimal_commas(text) {
        return Err(line.bad(
            "decimal commas: this would be read as twice as many numbers",
            "write decimal points",
        ));
    }
    let found: Vec<f64> = words(text)
        .map(|word| line.number(word))
        .collect::<Result<_, _>>()?;
    match found.len() {
        3.. => Ok(found),
        count => Err(line.bad(
            format!("{count} numbers, where X, Y and Z belong"),
            "write X, Y and Z with spaces between them, or give a map of bCNC, Candle or OpenCNCPilot",
        )),
    }
}

/// True if words with spaces between them have commas within.
fn has_decimal_commas(text: &str) -> bool {
    let has_comma = |word: &str| {
        let (whole, part) = word.split_once(',').unwrap_or_default();
        whole.ends_with(|c: char| c.is_ascii_digit())
            && part.starts_with(|c: char| c.is_ascii_digit())
    };
    let mut words = text.split_whitespace();
    text.split_whitespace().count() > 1 && words.any(has_comma)
}

/// The number of points that bCNC's three lines say, if these are the first ones: two ranges with counts, a range of Z and
/// a feed; the first point is at the corner.
fn counted(rows: &[(&TextLine<'_>, Vec<f64>)]) -> Option<usize> {
    let [x, y, z, first, ..] = rows else {
        return None;
    };
    let head = [x, y, z].map(|(_, values)| values);
    if head
        .iter()
        .any(|values| values.len() != 3 || values[0] >= values[1])
    {
        return None;
    }
    let [x, y, _] = head;
    let is_count = |n: f64| n.fract() == 0.0 && (2.0..=1000.0).contains(&n);
    let is_corner = |k: usize, low: f64| (first.1[k] - low).abs() < CORNER;
    let is_one = is_count(x[2]) && is_count(y[2]) && is_corner(0, x[0]) && is_corner(1, y[0]);
    is_one.then(|| (x[2] * y[2]) as usize)
}
