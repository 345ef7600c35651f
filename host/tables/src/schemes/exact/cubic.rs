//! Cubic tables: fewer points for a peak, but more instructions.

use super::grid::Grid;
use super::limits::{BYTES_PER_INSTRUCTION, LEAST_INTERVALS, MOST_INTERVALS};
use super::variables::Variable;
use crate::cost::{CUBIC_BANK, CUBIC_TABLE, LINEAR_TABLE};
use trueaxis::SampleFormat;

/// True if a variable's tables may be cubic, that is, without kinks or steps.
pub(crate) fn may_be(variable: &Variable) -> bool {
    variable.kinks.is_empty()
}

/// The grid of a cubic table: its intervals cover the range.
pub fn grid(variable: &Variable, intervals: usize) -> Grid {
    let intervals = intervals.clamp(LEAST_INTERVALS, MOST_INTERVALS);
    Grid {
        cubic: true,
        ..Grid::over(variable.range, intervals)
    }
}

/// Cost of `tables` tables with `samples` samples each, in instructions: their evaluation and the storage of their
/// samples.
pub fn cost(tables: usize, samples: usize, cubic: bool, format: SampleFormat) -> f64 {
    let (bank, table) = match cubic {
        true => (CUBIC_BANK, CUBIC_TABLE),
        false => (0.0, LINEAR_TABLE),
    };
    bank + table * tables as f64 + stored(tables * samples, format)
}

/// Storage cost of samples, in instructions.
pub fn stored(samples: usize, format: SampleFormat) -> f64 {
    let bytes = match format {
        SampleFormat::F32 => 4,
        SampleFormat::I16 => 2,
    };
    (samples * bytes) as f64 / BYTES_PER_INSTRUCTION
}
