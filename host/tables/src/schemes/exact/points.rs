//! From tables to the number and positions of their points: for the share of the tolerance that interpolation may use,
//! which is adapted from draft to draft.

use super::grid::{self, GRID_SLACK, Grid, LEAST_INTERVALS, MOST_INTERVALS};
use super::spline;
use super::structure::{Decomposition, Function, Sampled, errors_at};
use super::variables::{Kind, Variable};
use crate::schemes::Options;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::sync::PoisonError;
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;

/// For sampling peaks: intervals per damping (rad), and the smallest and largest number of intervals over a range.
const SEEN_PER_PEAK: f64 = 5.0;
const LEAST_SEEN: usize = 64;
const MOST_SEEN: usize = 2048;
/// If polynomials through every other sample err by less than this many tolerances, polynomials through all samples,
/// with an error about 4000 times smaller, replace the reference correction. Eight times that would be 2 % of the
/// tolerance.
const MOST_OF_HALF: f64 = 10.0;
/// A finer grid that leaves more than this fraction of the error is not worth its points.
pub const STUCK: f64 = 0.8;

/// Grids of the bent tables of each variable, such that interpolation of all of them together errs by no more than
/// `share` of the tolerance, or with the number of points given in `options`. Points lie between measured positions
/// of motions only if `finer`.
pub fn grids(
    found: &Decomposition<'_>,
    seen: &BTreeMap<usize, PeakTables>,
    options: &Options,
    share: f64,
    finer: bool,
) -> Result<BTreeMap<usize, Grid>, NotConverged> {
    let bent: Vec<(usize, Vec<Function>)> = found
        .tables()
        .into_iter()
        .map(|(v, (bent, _))| (v, bent))
        .filter(|(v, bent)| !bent.is_empty() && found.sampler.variables[*v].is_rich())
        .collect();
    let each = share / bent.len().max(1) as f64;
    let mut grids = BTreeMap::new();
    for (v, functions) in &bent {
        let variable = &found.sampler.variables[*v];
        let cheapest = |linear: Grid, cubic: Grid| {
            let cost = |grid: &Grid| {
                let samples = grid.samples(variable.wraps);
                grid::cost(functions.len(), samples, grid.cubic, options.format)
            };
            if cost(&cubic) < cost(&linear) {
                cubic
            } else {
                linear
            }
        };
        let grid = match (options.points, seen.get(v)) {
            (Some(points), _) => Grid::over(variable.range, points.max(2) - 1),
            (None, Some(seen)) => {
                let [linear, cubic] = seen.wanted(each);
                cheapest(Grid::even(variable, linear), Grid::cubic(variable, cubic))
            }
            (None, None) => coarsest(found, *v, functions, each, finer)?,
        };
        grids.insert(*v, grid);
    }
    Ok(grids)
}

/// The coarsest grid found whose interpolation error is at most `most`, or the best one if there is none.
fn coarsest(
    found: &Decomposition<'_>,
    v: usize,
    functions: &[Function],
    most: f64,
    finer: bool,
) -> Result<Grid, NotConverged> {
    let variable = &found.sampler.variables[v];
    let mut best: Option<(f64, Grid)> = None;
    let mut consider = |grid: Grid| -> Result<f64, NotConverged> {
        let error = found.interpolation_error(v, functions, &grid)?;
        let better = match &best {
            None => true,
            Some((e, g)) => match (error <= most, *e <= most) {
                (true, true) => grid.intervals < g.intervals,
                (true, false) => true,
                (false, true) => false,
                (false, false) => error < STUCK * *e,
            },
        };
        if better {
            best = Some((error, grid));
        }
        Ok(error)
    };
    let mut count = 48;
    let mut through_is_enough = false;
    if let Some(grid) = Grid::through_kinks(variable) {
        let mut error = consider(grid)?;
        if error > most {
            // The remaining error between measured points is curvature, or the effect of motions on the arguments of
            // others: a step at each of them, which no number of points removes.
            for parts in 2..if finer { usize::MAX } else { 2 } {
                let finer = grid.divided(parts);
                if finer.intervals > MOST_INTERVALS {
                    break;
                }
                let less = consider(finer)?;
                if less <= most || less > STUCK * error {
                    break;
                }
                error = less;
            }
            return Ok(best.map_or(grid, |(_, grid)| grid));
        }
        // A grid coarser than the measured positions, only if these are much finer than the tolerance needs.
        if error > 0.1 * most {
            return Ok(grid);
        }
        through_is_enough = true;
        count = (grid.intervals / 2).max(LEAST_INTERVALS);
    }
    // The error of linear interpolation falls with the square of the interval: one sample is enough, because the
    // tables are measured anyway.
    let seen = Grid::even(variable, count);
    let error = consider(seen)?;
    let wanted = seen.intervals as f64 * (error / (0.85 * most)).sqrt();
    let wanted = (wanted.ceil() as usize).clamp(LEAST_INTERVALS, MOST_INTERVALS);
    let grid = Grid::even(variable, wanted);
    Ok(match best {
        Some((_, best)) if best.intervals <= grid.intervals && through_is_enough => best,
        _ => grid,
    })
}

impl Decomposition<'_> {
    /// Largest error in each output of linear interpolation between the values of a variable's tables on a grid, in
    /// units of the tolerance. Measured table by table in the middle of every interval and at every kink between
    /// points, with the other factors at their peaks.
    fn interpolation_error(
        &self,
        v: usize,
        functions: &[Function],
        grid: &Grid,
    ) -> Result<f64, NotConverged> {
        let key = (v, grid.start.to_bits(), grid.step.to_bits());
        let memory = || self.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let known = memory().get(&key).copied();
        if let Some(known) = known {
            return Ok(known);
        }
        let error = self.measured_error(v, functions, grid)?;
        memory().insert(key, error);
        Ok(error)
    }

    fn measured_error(
        &self,
        v: usize,
        functions: &[Function],
        grid: &Grid,
    ) -> Result<f64, NotConverged> {
        let variable = &self.sampler.variables[v];
        let [low, high] = variable.range;
        let points: Vec<f64> = grid.points().map(|x| x.clamp(low, high)).collect();
        let slack = GRID_SLACK * grid.step;
        // Where to measure: interval, position.
        let mut looks: Vec<(usize, f64)> = Vec::new();
        let mut kinks = variable.kinks.iter().copied().peekable();
        for (k, ends) in points.windows(2).enumerate() {
            if ends[1] - ends[0] < slack {
                continue; // beyond the range
            }
            looks.push((k, 0.5 * (ends[0] + ends[1])));
            while let Some(x) = kinks.next_if(|x| *x < ends[1] - slack) {
                // More points next to the ends of the calibrated range bring nothing.
                if x > ends[0] + slack && !variable.ends.contains(&x) {
                    looks.push((k, x));
                }
            }
            while kinks.next_if(|x| *x <= ends[1] + slack).is_some() {}
        }
        let at: Vec<f64> = looks.iter().map(|(_, x)| *x).collect();
        let truth = self.sample(v, functions, &at)?;
        let sampled = self.sample(v, functions, &points)?;
        // An end belongs to the inner side: the tables continue smoothly up to it, and step to the held value within
        // the first interval outside.
        let [first, last] = variable.calibrated;
        let steps = |k: usize| {
            let from = (points[k] - last).abs() < slack;
            let to = (points[k + 1] - first).abs() < slack;
            let around = |e: &f64| *e > points[k] + slack && *e < points[k + 1] - slack;
            variable.ends.iter().any(around) || (from || to) && !variable.ends.is_empty()
        };
        let terms = self.contributions(v, functions);
        let mut worst = 0.0_f64;
        for (row, (k, x)) in looks.iter().enumerate() {
            if steps(*k) {
                continue;
            }
            let share = (x - points[*k]) / (points[*k + 1] - points[*k]);
            let line = [(*k, 1.0 - share), (*k + 1, share)];
            let errors = errors_at(&terms, (&sampled.values, &line), (&truth.values, row));
            worst = errors.iter().fold(worst, |w, e| w.max(*e));
        }
        Ok(worst)
    }
}

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
pub fn peak_grid(policy: Policy, variable: &Variable) -> Option<Grid> {
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
            let grid = peak_grid(found.sampler.kinematics.policy, variable)?;
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
