//! Surfaces that were probed: heights of Z over X and Y, as LinuxCNC, bCNC, Candle and OpenCNCPilot save them.
//!
//! All are in the coordinates of the program that probed, usually of the workpiece. Sources: `z_level_compensation` of
//! LinuxCNC (`probe_points.txt`) and its `(PROBEOPEN …)`, `Probe` of bCNC, `saveHeightMap` of Candle, `HeightMap` of
//! OpenCNCPilot.

mod candle;
mod cnc_pilot;
mod rows;

use crate::height_map::{HeightMap, MapPoint};
use crate::sampled::{Nodes, SampledGrid};
use std::ops::Range;
use trueaxis_model::numbers::ascending;
use trueaxis_model::source::FileError;

/// Who wrote a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Rows of X, Y and Z: a log of LinuxCNC, or any list of points.
    Rows,
    /// `.probe` of bCNC.
    Bcnc,
    /// `.map` of Candle.
    Candle,
    /// `.hmap` of OpenCNCPilot.
    CncPilot,
}

impl Format {
    /// Name in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rows => "rows of X Y Z",
            Self::Bcnc => "bCNC",
            Self::Candle => "Candle",
            Self::CncPilot => "OpenCNCPilot",
        }
    }
}

/// Positions closer than this part of a step are one, and a step may differ by it from the others.
const SAME: f64 = 0.05;

/// Reads a file of any of these programs; heights and positions are in its unit. The last of several probings at one place
/// counts.
///
/// # Errors
/// [`FileError`]: none of these formats, numbers that cannot be read, points that are not a complete grid with equal steps.
pub fn read(text: &str) -> Result<(HeightMap, Format), FileError> {
    let first = text.trim_start_matches('\u{feff}').trim_start();
    if first.starts_with('<') {
        return Ok((cnc_pilot::read(text)?, Format::CncPilot));
    }
    if candle::is_one(first) {
        return Ok((candle::read(text)?, Format::Candle));
    }
    let (points, format) = rows::read(text)?;
    if points.is_empty() {
        return Err(FileError::whole(
            "no points",
            "give rows of X, Y and Z, or a map of bCNC, Candle or OpenCNCPilot",
        ));
    }
    Ok((gridded(&points)?, format))
}

/// A point and its place in the file.
type SurfacePoint = (MapPoint, Range<usize>);

/// Points as a grid.
fn gridded(points: &[SurfacePoint]) -> Result<HeightMap, FileError> {
    let nodes = [along(points, 0)?, along(points, 1)?];
    let count = nodes[0].count * nodes[1].count;
    let mut values = vec![None; count];
    for (point, _) in points {
        let [x, y] = [0, 1].map(|k| ((point[k] - nodes[k].start) / nodes[k].step).round() as usize);
        values[y * nodes[0].count + x] = Some([point[2]]);
    }
    let missing = values.iter().filter(|value| value.is_none()).count();
    if let Some(first) = values.iter().position(Option::is_none) {
        let [x, y] = [
            nodes[0].at(first % nodes[0].count),
            nodes[1].at(first / nodes[0].count),
        ];
        return Err(FileError::whole(
            format!(
                "{missing} of {} × {} points are missing, first the one at {x:.3}, {y:.3}",
                nodes[0].count, nodes[1].count
            ),
            "probe a rectangle completely, with equal steps along X and along Y",
        ));
    }
    Ok(HeightMap::new(SampledGrid {
        nodes: nodes.to_vec(),
        values: values.into_iter().flatten().collect(),
    }))
}

/// The positions along X (0) or Y (1).
fn along(points: &[SurfacePoint], axis: usize) -> Result<Nodes, FileError> {
    let name = ["X", "Y"][axis];
    let mut sorted: Vec<f64> = points.iter().map(|(point, _)| point[axis]).collect();
    ascending(&mut sorted);
    let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let widest = gaps.fold(0.0, f64::max);
    let (low, high) = match (sorted.first(), sorted.last()) {
        (Some(low), Some(high)) if high > low => (*low, *high),
        _ => {
            return Err(FileError::whole(
                format!("all points have the same {name}"),
                "probe at two or more positions of X and of Y",
            ));
        }
    };
    let steps = sorted
        .windows(2)
        .filter(|pair| pair[1] - pair[0] > SAME * widest)
        .count();
    let nodes = Nodes::over([low, high], steps + 1);
    let is_off = |point: &MapPoint| {
        let at = (point[axis] - low) / nodes.step;
        (at - at.round()).abs() > SAME
    };
    match points.iter().find(|(point, _)| is_off(point)) {
        None => Ok(nodes),
        Some((point, span)) => Err(FileError::here(
            span.clone(),
            format!(
                "{name} = {} is not one of {} positions with equal steps from {low} to {high}",
                point[axis], nodes.count
            ),
            "probe a rectangle completely, with equal steps along X and along Y",
        )),
    }
}

#[cfg(test)]
mod tests;
