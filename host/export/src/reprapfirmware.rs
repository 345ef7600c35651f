//! `heightmap.csv` of RepRapFirmware.
//!
//! The first line names the format, the second the parameters of the grid, the third has them; then one row of heights
//! for each position of the second axis. A zero without decimal point was not probed. Up to 3.3-beta1 the axes are always
//! X and Y (`xmin,xmax,ymin,…`); since then two letters come first (`axis0,axis1,min0,…`), and the older second line is
//! still read. Positions are minimum + index × spacing, the maximum has no effect. Source: `GridDefinition` and `HeightMap`
//! of RepRapFirmware.

use crate::height_map::{HIGHEST, HeightMap, check_height, rows};
use crate::sampled::{Nodes, SampledGrid};
use crate::text_lines::{TextLine, lines};
use trueaxis_model::source::FileError;

/// Start of the first line.
const FIRST: &str = "RepRapFirmware height map file v2";
/// Like `FIRST`, of firmware 1.16 and before, whose maps have one spacing.
const FIRST_V1: &str = "RepRapFirmware height map file v1";
/// The second line of each generation.
const LABELS: [&str; 3] = [
    "xmin,xmax,ymin,ymax,radius,spacing,xnum,ynum",
    "xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum",
    "axis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1",
];
/// Largest number of points along the first axis.
const MOST_ALONG: usize = 41;
/// Largest number of points of a Duet 2; a Duet 3 has 961.
const MOST_POINTS: usize = 441;
/// Smallest spacing (mm).
const LEAST_SPACING: f64 = 0.1;
/// The last cell ends this much (mm) before the last point.
const BEFORE_LAST: f64 = 0.01;

/// Writes a map with the second line that all versions with this format read. Heights have four decimals: a longer row
/// would not fit into the line that the firmware reads.
#[must_use]
pub fn print(map: &HeightMap) -> String {
    let heights = map.grid.values.iter().map(|[value]| *value);
    let [low, high] = heights
        .clone()
        .fold([f64::MAX, f64::MIN], |[low, high], v| {
            [low.min(v), high.max(v)]
        });
    let mean = heights.clone().sum::<f64>() / map.grid.values.len() as f64;
    let variance = heights.map(|v| (v - mean).powi(2)).sum::<f64>() / map.grid.values.len() as f64;
    let [x, y] = [0, 1].map(|axis| map.grid.nodes[axis]);
    let mut text = format!(
        "{FIRST}, min error {low:.3}, max error {high:.3}, mean {mean:.3}, deviation {:.3}\n{}\n",
        variance.sqrt(),
        LABELS[1]
    );
    text += &format!(
        "{:.3},{:.3},{:.3},{:.3},-1.00,{:.6},{:.6},{},{}\n",
        x.start,
        x.at(x.count - 1),
        y.start,
        y.at(y.count - 1),
        x.step,
        y.step,
        x.count,
        y.count
    );
    for row in rows(&map.grid, 4) {
        text += &row.replace(' ', "");
        text.push('\n');
    }
    text
}

/// Whether the firmware accepts a map.
///
/// # Errors
/// The reason.
pub fn check(map: &HeightMap) -> Result<(), String> {
    let [x, y] = [0, 1].map(|axis| map.grid.nodes[axis]);
    if x.count > MOST_ALONG || x.count * y.count > MOST_POINTS {
        return Err(format!(
            "{} × {} points are more than the firmware has room for: at most {MOST_ALONG} along the first axis and {MOST_POINTS} in \
             all",
            x.count, y.count
        ));
    }
    if x.step < LEAST_SPACING || y.step < LEAST_SPACING {
        return Err("the points are closer together than 0.1 mm".to_owned());
    }
    match map
        .grid
        .values
        .iter()
        .flatten()
        .find(|v| v.abs() >= HIGHEST)
    {
        Some(large) => Err(format!("a correction of {large} mm is no height of a map")),
        None => Ok(()),
    }
}

/// Reads a map.
///
/// # Errors
/// [`FileError`]: a format or a number that the firmware does not read, or reads differently from what the grid says.
pub fn read(text: &str) -> Result<HeightMap, FileError> {
    let all = lines(text);
    let mut lines = all.iter();
    let missing = || {
        FileError::whole(
            "this is not a whole height map: it ends too early",
            "give heightmap.csv as the firmware writes it (G29 S3), without cutting it",
        )
    };
    let first = lines.next().ok_or_else(missing)?;
    if !first.text.starts_with(FIRST) && !first.text.starts_with(FIRST_V1) {
        return Err(first.bad(
            format!("the first line does not begin with `{FIRST}`"),
            "give heightmap.csv as the firmware writes it (G29 S3)",
        ));
    }
    let label = lines.next().ok_or_else(missing)?;
    let version = LABELS.iter().position(|l| label.text.starts_with(l));
    let version = version.ok_or_else(|| {
        label.bad(
            "the firmware does not know these parameters",
            "keep the line as the firmware writes it, like `xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum`",
        )
    })?;
    let nodes = parameters(lines.next().ok_or_else(missing)?, version)?;
    let (mut values, mut probed) = (Vec::new(), Vec::new());
    for _ in 0..nodes[1].count {
        let line = lines.next().ok_or_else(missing)?;
        for word in row(line, nodes[0].count)? {
            let height = line.number(word)?;
            check_height(line, height)?;
            values.push([height]);
            probed.push(word != "0");
        }
    }
    if let Some(line) = lines.find(|line| !line.text.trim().is_empty()) {
        return Err(line.bad(
            format!(
                "more rows of heights than the {} of the third line",
                nodes[1].count
            ),
            "give the file as the firmware writes it",
        ));
    }
    let grid = SampledGrid {
        nodes: nodes.to_vec(),
        values,
    };
    Ok(HeightMap { grid, probed })
}

/// The heights of a position of the second axis.
fn row<'t>(line: &TextLine<'t>, count: usize) -> Result<Vec<&'t str>, FileError> {
    let words: Vec<&str> = line.text.split(',').map(str::trim).collect();
    match words.len() {
        found if found == count => Ok(words),
        found => Err(line.bad(
            format!("{found} heights, where the third line says {count}"),
            "give the file as the firmware writes it",
        )),
    }
}

/// The third line: nodes along each axis.
fn parameters(line: &TextLine<'_>, version: usize) -> Result<[Nodes; 2], FileError> {
    let words: Vec<&str> = line.text.split(',').map(str::trim).collect();
    let count = LABELS[version].split(',').count();
    if words.len() < count {
        return Err(line.bad(
            format!(
                "{} parameters, where the line above names {count}",
                words.len()
            ),
            "give the file as the firmware writes it",
        ));
    }
    let letters = if version == 2 { 2 } else { 0 };
    if letters == 2 && words[..2] != ["X", "Y"] {
        return Err(line.bad(
            format!("a map over `{}` and `{}`", words[0], words[1]),
            "give a map of Z over X and Y",
        ));
    }
    let words = &words[letters..];
    let [low_0, _, low_1, _] = [words[0], words[1], words[2], words[3]].map(|w| line.number(w));
    // words[4] is the radius that was probed.
    let spacings = match version {
        0 => [words[5]; 2],
        _ => [words[5], words[6]],
    };
    let counts = &words[if version == 0 { 6 } else { 7 }..];
    Ok([
        nodes(line, low_0?, spacings[0], counts[0])?,
        nodes(line, low_1?, spacings[1], counts[1])?,
    ])
}

fn nodes(line: &TextLine<'_>, low: f64, spacing: &str, count: &str) -> Result<Nodes, FileError> {
    let step = line.number(spacing)?;
    if step < LEAST_SPACING {
        return Err(line.bad(
            format!("the spacing {step} is less than the firmware accepts"),
            "write at least 0.1 mm",
        ));
    }
    Ok(Nodes {
        start: low,
        step,
        count: line.count(count)?,
    })
}

/// The correction of Z at positions of the two axes (mm), as the firmware computes it.
#[must_use]
pub fn correction(map: &HeightMap, position: [f64; 2]) -> f64 {
    let position = [0, 1].map(|axis| {
        let nodes = map.grid.nodes[axis];
        position[axis].min(nodes.at(nodes.count - 1) - BEFORE_LAST)
    });
    map.grid.at(&position)[0]
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::by_firmware;
