//! Candle's `.map`: since version 3 of the format the first line names it. Then place and size of the rectangle, since
//! version 3 the origin of heights, the numbers of points with the travel of Z, the interpolation, and a row of heights for
//! each position of Y, from the lowest on.

use crate::height_map::HeightMap;
use crate::sampled::{Nodes, SampledGrid};
use crate::text_lines::{TextLine, lines};
use trueaxis_model::source::FileError;

/// How the first line begins, if it names the format.
const SIGNATURE: &str = "candle map v";
/// The version that this module reads, beside files without a signature.
const VERSION: &str = "candle map v3";

/// Whether a text begins like one.
pub fn is_one(text: &str) -> bool {
    let first = text.lines().next().unwrap_or("");
    first.starts_with(SIGNATURE) || first.split(';').count() == 4
}

pub fn read(text: &str) -> Result<HeightMap, FileError> {
    let all = lines(text);
    let mut lines = all.iter();
    let signed = text.trim_start_matches('\u{feff}').starts_with(SIGNATURE);
    if signed {
        check_version(next(&mut lines)?)?;
    }
    let [x, y, width, height] = numbers(next(&mut lines)?)?;
    if signed {
        // Where heights are zero.
        numbers::<2>(next(&mut lines)?)?;
    }
    let line = next(&mut lines)?;
    let words: Vec<&str> = line.text.split(';').map(str::trim).collect();
    let [columns, rows] = [0, 1].map(|k| line.count(words.get(k).unwrap_or(&"")));
    let (columns, rows) = (columns?, rows?);
    if !(width > 0.0 && height > 0.0) {
        return Err(line.bad(
            format!("the rectangle is {width} × {height}"),
            "give a map with points along X and along Y",
        ));
    }
    // The interpolation.
    next(&mut lines)?;
    let mut values = Vec::with_capacity(columns * rows);
    for _ in 0..rows {
        values.extend(row(next(&mut lines)?, columns)?);
    }
    Ok(HeightMap::new(SampledGrid {
        nodes: vec![
            Nodes::over([x, x + width], columns),
            Nodes::over([y, y + height], rows),
        ],
        values,
    }))
}

/// The heights of a position of Y.
fn row(line: &TextLine<'_>, columns: usize) -> Result<Vec<[f64; 1]>, FileError> {
    let words: Vec<&str> = line.text.split(';').map(str::trim).collect();
    if words.len() != columns {
        return Err(line.bad(
            format!("{} heights, where {columns} belong", words.len()),
            "give the file as Candle writes it",
        ));
    }
    let height = |word: &str| match word {
        "" => Err(line.bad("a point was not probed", "probe the whole map")),
        word => Ok([line.number(word)?]),
    };
    words.into_iter().map(height).collect()
}

fn next<'l, 't>(
    lines: &mut impl Iterator<Item = &'l TextLine<'t>>,
) -> Result<&'l TextLine<'t>, FileError> {
    lines.next().ok_or_else(|| {
        FileError::whole(
            "this is not a whole map of Candle: it ends too early",
            "give the file as Candle writes it, with all points probed",
        )
    })
}

/// The line that names the format must name this one.
fn check_version(line: &TextLine<'_>) -> Result<(), FileError> {
    match line.text.trim_start_matches('\u{feff}') == VERSION {
        true => Ok(()),
        false => Err(line.bad(
            format!("only the format `{VERSION}` is known"),
            "save the map with a Candle that writes it",
        )),
    }
}

/// Numbers between semicolons.
fn numbers<const N: usize>(line: &TextLine<'_>) -> Result<[f64; N], FileError> {
    let words = line.text.split(';').map(str::trim);
    let found: Vec<f64> = words
        .map(|word| line.number(word.trim_start_matches('\u{feff}')))
        .collect::<Result<_, _>>()?;
    let count = found.len();
    found.try_into().map_err(|_| {
        line.bad(
            format!("{count} numbers, where {N} belong"),
            "give the file as Candle writes it",
        )
    })
}
