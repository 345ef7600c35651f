//! Tables with peaks, sampled at many positions: the number of points they need with linear and with cubic
//! interpolation, and their values in between.

use super::grid::Grid;
use super::limits::{
    LEAST_INTERVALS, LEAST_SEEN, MOST_INTERVALS, MOST_OF_HALF, MOST_SEEN, SEEN_PER_PEAK,
};
use super::spline;
use super::structure::Function;
use super::tables::{Decomposition, Sampled, errors_at};
use super::variables::{Kind, Variable};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;

/// A variable's tables at the starts and midpoints of enough intervals to resolve every peak.
pub struct PeakTables {
    grid: Grid,
    wraps: bool,
    tables: Sampled,
    /// Error of linear interpolation between the points, and of cubics on these intervals (in units of the
    /// tolerance).
    errors: [f64; 2],
    /// True if polynomials through the samples give the values in between.
    is_dense: bool,
}

/// The grid on which tables of a variable are sampled, if it has no kinks and the policy makes peaks.
pub fn grid(policy: Policy, variable: &Variable) -> Option<Grid> {
    let Policy::Direction { damping } = policy else {
        return None;
    };
    if !variable.is_rich() || !variable.kinks.is_empty() {
        return None;
    }
    // A peak is as wide as the damping; a few points on it are enough, because the tables are measured anyway.
    let [low, high] = variable.range;
    let intervals = match variable.kind {
        Kind::Rotary(_) => (SEEN_PER_PEAK * (high - low) / damping) as usize,
        _ => LEAST_SEEN,
    };
    Some(Grid::cubic(
        variable,
        intervals.clamp(LEAST_SEEN, MOST_SEEN),
    ))
}

impl PeakTables {
    /// Samples the tables of variables without kinks, if the policy makes peaks.
    pub fn all(found: &Decomposition<'_>) -> Result<BTreeMap<usize, Self>, NotConverged> {
        let bent = found.tables().into_iter().map(|(v, (bent, _))| (v, bent));
        let bent = bent.filter(|(_, bent)| !bent.is_empty());
        let seen = bent.filter_map(|(v, bent)| {
            let variable = &found.sampler.variables[v];
            let grid = grid(found.sampler.kinematics.policy, variable)?;
            Some(Self::of(found, v, &bent, grid).map(|seen| (v, seen)))
        });
        seen.collect()
    }

    fn of(
        found: &Decomposition<'_>,
        v: usize,
        functions: &[Function],
        grid: Grid,
    ) -> Result<Self, NotConverged> {
        let wraps = found.sampler.variables[v].wraps;
        let at: Vec<f64> = grid.sampled_at(wraps).collect();
        let tables = found.sample(v, functions, &at)?;
        Ok(Self {
            errors: found.errors_on(v, &tables, &grid),
            is_dense: found.error_of_half(v, &tables, wraps) < MOST_OF_HALF,
            grid,
            wraps,
            tables,
        })
    }

    /// Values of the tables (positions × tables) inside the range, interpolated from the samples; `None` if these
    /// are not dense enough.
    pub fn between(&self, at: &[f64]) -> Option<DMatrix<f64>> {
        if !self.is_dense {
            return None;
        }
        let values = &self.tables.values;
        let around = |x: &f64| {
            let steps = (x - self.grid.start) / (0.5 * self.grid.step);
            around(steps, values.nrows(), self.wraps)
        };
        let around: Vec<_> = at.iter().map(around).collect();
        let mut all = DMatrix::zeros(at.len(), values.ncols());
        for (mut to, column) in all.column_iter_mut().zip(values.column_iter()) {
            let column = column.as_slice();
            for (to, around) in to.as_mut_slice().iter_mut().zip(&around) {
                *to = around.iter().map(|(k, w)| w * column[*k]).sum();
            }
        }
        Some(all)
    }

    /// Number of intervals at which linear and cubic tables leave `most`: their errors fall with the square and the
    /// fourth power of the spacing.
    pub fn wanted(&self, most: f64) -> [usize; 2] {
        let wanted = |k: usize, power: f64| {
            let more = libm::pow(self.errors[k] / (0.85 * most), 1.0 / power);
            let wanted = (self.grid.intervals as f64 * more).ceil() as usize;
            wanted.clamp(LEAST_INTERVALS, MOST_INTERVALS)
        };
        [wanted(0, 2.0), wanted(1, 4.0)]
    }
}

impl Decomposition<'_> {
    /// Largest error in each output of linear interpolation between the values of a variable's tables on a grid, and
    /// of cubics on the same intervals, in units of the tolerance. Measured table by table at the points and between
    /// them, with the other factors at their peaks.
    fn errors_on(&self, v: usize, truth: &Sampled, grid: &Grid) -> [f64; 2] {
        let terms = self.contributions(v, &truth.functions);
        let truth = &truth.values;
        let coefficients = spline::coefficients(truth, self.sampler.variables[v].wraps);
        let (count, rows) = (coefficients.nrows(), truth.nrows());
        let mut worst = [0.0; 2];
        for row in 0..rows {
            let (first, t) = match row / 2 {
                k if k < grid.intervals => (k, 0.5 * (row % 2) as f64),
                k => (k - 1, 1.0),
            };
            let weights = spline::weights(t).into_iter().enumerate();
            let weights: Vec<_> = weights.map(|(i, w)| ((first + i) % count, w)).collect();
            let line: &[_] = match row % 2 {
                0 => &[(row, 1.0)],
                _ => &[(row - 1, 0.5), ((row + 1) % rows, 0.5)],
            };
            let of_lines = errors_at(&terms, (truth, line), (truth, row));
            let of_cubics = errors_at(&terms, (&coefficients, &weights), (truth, row));
            worst = [most(worst[0], &of_lines), most(worst[1], &of_cubics)];
        }
        worst
    }

    /// Error of polynomials through every other sample, measured at the samples in between.
    fn error_of_half(&self, v: usize, truth: &Sampled, wraps: bool) -> f64 {
        let terms = self.contributions(v, &truth.functions);
        let truth = &truth.values;
        let rows = truth.nrows();
        let odd = (1..rows).step_by(2);
        odd.fold(0.0, |worst, row| {
            let around = around(0.5 * row as f64, rows.div_ceil(2), wraps);
            let weights: Vec<_> = around.into_iter().map(|(k, w)| (2 * k, w)).collect();
            most(worst, &errors_at(&terms, (truth, &weights), (truth, row)))
        })
    }
}

fn most(worst: f64, errors: &PerAxis) -> f64 {
    errors.iter().fold(worst, |w, e| w.max(*e))
}

/// Number of samples that a polynomial passes through. At half the spacing, its error is 2¹² times smaller.
const POINTS: usize = 12;

/// The samples, of `count`, from which the value at `x` is computed, with their weights: Lagrange's polynomial
/// through the surrounding samples. `x` is in units of their spacing, from the first sample.
fn around(x: f64, count: usize, wraps: bool) -> Vec<(usize, f64)> {
    assert!(count >= POINTS);
    let mut first = x.floor() as i64 + 1 - POINTS as i64 / 2;
    if !wraps {
        first = first.clamp(0, (count - POINTS) as i64);
    }
    let x = x - first as f64;
    (0..POINTS)
        .map(|i| {
            let others = (0..POINTS).filter(|k| *k != i).map(|k| k as f64);
            let weight = others.map(|k| (x - k) / (i as f64 - k)).product();
            let row = (first + i as i64).rem_euclid(count as i64);
            (row as usize, weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_polynomial_is_followed_to_the_ends_and_at_samples_these_count_alone() {
        let f = |x: f64| (0..11).map(|k| (x / 10.0 - 1.0).powi(k)).sum::<f64>();
        for place in 0..=190 {
            let x = f64::from(place) / 10.0;
            let parts = around(x, 20, false).into_iter();
            let found: f64 = parts.map(|(i, w)| w * f(i as f64)).sum();
            // At the ends, the weights of values up to 11 add up to 200.
            assert!((found - f(x)).abs() < 1e-11, "{x}");
            let alone = around(x.floor(), 20, false);
            let other = |(i, w): &(usize, f64)| *w != f64::from(u8::from(*i as f64 == x.floor()));
            assert!(!alone.iter().any(other));
        }
    }

    #[test]
    fn what_wraps_has_no_ends() {
        // Sine at 24 samples of a turn: each step is 0.26, whose 12th power is 1e-7, over 4 000.
        for place in -30..300 {
            let x = f64::from(place) / 10.0;
            let parts = around(x, 24, true).into_iter();
            let sine = |i: usize| libm::sin(TAU * i as f64 / 24.0);
            let found: f64 = parts.map(|(i, w)| w * sine(i)).sum();
            assert!((found - libm::sin(TAU * x / 24.0)).abs() < 1e-10, "{x}");
        }
    }
}
