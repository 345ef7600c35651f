//! Cubic tables: fewer points for a peak, more instructions.

use super::limits::{
    BANK, BYTES_PER_INSTRUCTION, CUBIC_BANK, CUBIC_TABLE, LEAST_INTERVALS, LINEAR_TABLE,
    MOST_INTERVALS, TERM,
};
use super::points::Grid;
use super::variables::Variable;
use trueaxis::{Draft, Interpolation, SampleFormat};

/// Where in an interval a cubic errs most: a zero of the derivative of t·(1 − t)·(1 − 2·t), which is what
/// Catmull-Rom leaves of a third power, and the middle, for what it leaves of a fourth.
pub const LOOKS: [f64; 2] = [0.2113, 0.5];

/// The weights of the point before an interval, of its ends, and of the point after it, at `t` of it.
pub fn weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    let (at_end, before, after) = (t * t * (3.0 - 2.0 * t), t * s * s, t * t * s);
    [
        -0.5 * before,
        1.0 - at_end + 0.5 * after,
        at_end + 0.5 * before,
        -0.5 * after,
    ]
}

/// True if a variable's tables may be cubic: not where they have kinks or steps.
pub fn may_be(variable: &Variable) -> bool {
    variable.kinks.is_empty()
}

/// Points of a cubic: over the range, and one beyond each end, so that the slopes at the ends are as good
/// as elsewhere.
pub fn grid(variable: &Variable, intervals: usize) -> Grid {
    let intervals = intervals.clamp(LEAST_INTERVALS, MOST_INTERVALS);
    let inner = Grid::over(variable.range, intervals);
    let beyond = usize::from(!variable.wraps);
    Grid {
        start: inner.start - inner.step * beyond as f64,
        intervals: intervals + 2 * beyond,
        cubic: true,
        ..inner
    }
}

/// Continues values at the points within the range to one point beyond each end, as the parabola through
/// the three at that end.
pub fn extend(values: &mut Vec<f64>) {
    let beyond = |near: f64, next: f64, far: f64| 3.0 * (near - next) + far;
    let n = values.len();
    let (first, last) = (
        beyond(values[0], values[1], values[2]),
        beyond(values[n - 1], values[n - 2], values[n - 3]),
    );
    values.insert(0, first);
    values.push(last);
}

/// What so many tables on a grid cost, in instructions: those that evaluate them, and what their samples
/// are worth.
pub fn cost(tables: usize, grid: &Grid, format: SampleFormat) -> f64 {
    let bytes = match format {
        SampleFormat::F32 => 4,
        SampleFormat::I16 => 2,
    };
    let samples = (tables * (grid.intervals + 1) * bytes) as f64 / BYTES_PER_INSTRUCTION;
    let (bank, table) = match grid.cubic {
        true => (CUBIC_BANK, CUBIC_TABLE),
        false => (0.0, LINEAR_TABLE),
    };
    bank + table * tables as f64 + samples
}

/// What a draft costs, in instructions.
pub fn cost_of(draft: &Draft) -> f64 {
    let banks = draft.banks.iter().map(|bank| {
        let points = bank.columns.first().map_or(0, Vec::len);
        let grid = Grid {
            start: 0.0,
            step: 1.0,
            intervals: points.saturating_sub(1),
            cubic: bank.interpolation == Interpolation::Cubic,
        };
        BANK + cost(bank.columns.len(), &grid, bank.format)
    });
    banks.sum::<f64>() + TERM * draft.terms.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_followed_up_to_the_ends() {
        let f = |x: f64| 3.0 - 2.0 * x + 0.5 * x * x;
        let mut values: Vec<f64> = (0..5).map(|k| f(f64::from(k))).collect();
        extend(&mut values);
        assert_eq!(values.len(), 7);
        for k in 0..4 {
            for t in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let around = &values[k..k + 4];
                let found: f64 = around.iter().zip(weights(t)).map(|(v, w)| v * w).sum();
                assert!((found - f(k as f64 + t)).abs() < 1e-14);
            }
        }
    }
}
