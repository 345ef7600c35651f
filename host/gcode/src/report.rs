//! What a correction did.

use super::axes::{COUNT, PerLetter};
use serde::Serialize;
use std::collections::BTreeMap;

/// Lengths of tools that are remembered.
const MOST_LENGTHS: usize = 100;

/// Cycles that are written out and named.
const MOST_REASONS: usize = 20;

/// Counts of what was read, written, and left as it was.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Lines read and written.
    pub lines: [u64; 2],
    /// Motions that were corrected.
    pub moves: u64,
    /// Straight moves that were cut into several.
    pub cut: u64,
    /// Arcs that stay arcs, and arcs that became chords.
    pub arcs: [u64; 2],
    /// Cycles that stay cycles, and cycles that are written out.
    pub cycles: [u64; 2],
    /// The farthest that a place in a hole of a cycle that stays one is from its corrected place (mm).
    pub holes_off: f64,
    /// The first cycles that are written out, with their lines, and why.
    pub written_out: Vec<(u64, String)>,
    /// Steps at reversals that are moves of their own, or blended.
    pub take_ups: u64,
    /// Words I, J and K along the normal of the plane, all 0, that were left out.
    pub zeros_of_centres: u64,
    /// Words of axes that the machine does not have, which stay where they are.
    pub other_axes: std::collections::BTreeSet<char>,
    /// Lines whose F was changed or added, so that the time stays.
    pub feeds: u64,
    /// End points under G41, G42, whose moves are not cut.
    pub under_cutter: u64,
    /// Of these, the farthest that the corrected path is from what is written (mm).
    pub under_cutter_off: f64,
    /// The largest correction of each axis (mm, degrees), and its line.
    #[serde(skip)]
    pub largest: [(f64, u64); COUNT],
    /// Most decimals in words of axes that were read, and that were written.
    pub decimals: [usize; 2],
    /// What passed without correction, and how often.
    pub passed: BTreeMap<&'static str, u64>,
    /// Lengths of tools (mm) that were used, in steps of 1 µm.
    #[serde(skip)]
    pub lengths: std::collections::BTreeSet<i64>,
}

impl Report {
    /// Takes in the length (mm) of a tool.
    pub fn used(&mut self, length: f64) {
        if self.lengths.len() < MOST_LENGTHS {
            self.lengths.insert((length * 1e3).round() as i64);
        }
    }

    /// Takes in a cycle that is written out, of a line, and why.
    pub fn write_out(&mut self, line: u64, why: String) {
        self.cycles[1] += 1;
        if self.written_out.len() < MOST_REASONS {
            self.written_out.push((line, why));
        }
    }

    /// Takes in a correction of a line.
    pub fn corrected(&mut self, by: &PerLetter, line: u64) {
        for (largest, by) in self.largest.iter_mut().zip(by) {
            if by.abs() > largest.0 {
                *largest = (by.abs(), line);
            }
        }
    }
}
