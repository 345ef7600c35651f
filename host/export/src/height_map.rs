//! Height maps of printers and light routers: a correction of Z on a grid over X and Y.
//!
//! Such a map comes from probing a surface: a value is the position of Z at which the tool touches, and is added to the
//! command of Z. If the surface is flat, the machine causes it: the tool has then gone farther than commanded by minus
//! the value.

use crate::sampled::SampledGrid;
use crate::text_lines::TextLine;
use trueaxis_model::source::FileError;

/// Heights (mm) from here on are none of a bed.
pub(crate) const HIGHEST: f64 = 10.0;

/// Refuses what is no height of a bed.
pub(crate) fn check_height(line: &TextLine<'_>, height: f64) -> Result<(), FileError> {
    match height.abs() < HIGHEST {
        true => Ok(()),
        false => Err(line.bad(
            format!("{height} mm is no height of a map"),
            "probe again, or give heights in mm",
        )),
    }
}

/// Positions of X and Y, and the value of Z that touches there (mm).
pub type MapPoint = [f64; 3];

/// A map over X and Y.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// The values (mm) over X and Y.
    pub grid: SampledGrid<1>,
    /// For each value, whether it was probed.
    pub probed: Vec<bool>,
}

impl HeightMap {
    /// A map of which all values were probed.
    #[must_use]
    pub fn new(grid: SampledGrid<1>) -> Self {
        Self {
            probed: vec![true; grid.values.len()],
            grid,
        }
    }

    /// What was probed.
    #[must_use]
    pub fn touches(&self) -> Vec<MapPoint> {
        let [x, y] = [0, 1].map(|axis| self.grid.nodes[axis]);
        let touches = (self.grid.values.iter().zip(&self.probed)).enumerate();
        touches
            .filter(|(_, (_, probed))| **probed)
            .map(|(k, ([value], _))| [x.at(k % x.count), y.at(k / x.count), *value])
            .collect()
    }
}

/// Rows of numbers of a map, the first axis along a row, with `decimals`.
pub fn rows(grid: &SampledGrid<1>, decimals: usize) -> Vec<String> {
    let row = |values: &[[f64; 1]]| {
        let values = values.iter();
        // Adding 0 turns −0 into 0.
        let scale = 10_f64.powi(decimals as i32);
        let values = values.map(|[v]| format!("{:.decimals$}", (v * scale).round() / scale + 0.0));
        values.collect::<Vec<_>>().join(", ")
    };
    grid.values.chunks(grid.nodes[0].count).map(row).collect()
}
