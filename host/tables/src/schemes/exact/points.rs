//! From tables to the number and positions of their points: for the share of the tolerance that interpolation may use,
//! which is adapted from draft to draft.

use super::grid::{self, GRID_SLACK, Grid, LEAST_INTERVALS, MOST_INTERVALS};
use super::spline;
use super::structure::{Decomposition, Function, Sampled, errors_at};
use super::variables::{Kind, Variable};
use crate::schemes::Options;
use std::collections::BTreeMap;
use std::sync::PoisonError;
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;

/// For sampling peaks: intervals per damping (rad), and the smallest and largest number of intervals over a range.
const SEEN_PER_PEAK: f64 = 5.0;
const LEAST_SEEN: usize = 64;
const MOST_SEEN: usize = 2048;
/// A finer grid that leaves more than this fraction of the error is not worth its points.
pub const STUCK: f64 = 0.8;

/// Grids of the bent tables of each variable, such that interpolation of all of them together errs by no more than
/// `share` of the tolerance, or with the number of points given in `options`. Points lie between measured positions
/// of motions only if `finer`.
pub fn grids(
    found: &Decomposition<'_>,
    resolved: &BTreeMap<usize, Resolved>,
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
        let grid = match (options.points, resolved.get(v)) {
            (Some(points), _) => Grid::over(variable.range, points.max(2) - 1),
            (None, Some(resolved)) => {
                let [linear, cubic] = resolved.wanted(each);
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

/// What interpolation leaves of the tables of a variable on a grid that resolves every peak.
pub struct Resolved {
    grid: Grid,
    /// Error of linear interpolation between the points, and of cubics on these intervals (in units of the
    /// tolerance).
    errors: [f64; 2],
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

impl Resolved {
    /// Samples the tables of variables without kinks, if the policy makes peaks.
    pub fn all(found: &Decomposition<'_>) -> Result<BTreeMap<usize, Self>, NotConverged> {
        let bent = found.tables().into_iter().map(|(v, (bent, _))| (v, bent));
        let bent = bent.filter(|(_, bent)| !bent.is_empty());
        let resolved = bent.filter_map(|(v, bent)| {
            let variable = &found.sampler.variables[v];
            let grid = peak_grid(found.sampler.kinematics.policy, variable)?;
            let at: Vec<f64> = grid.sampled_at(variable.wraps).collect();
            let tables = found.sample(v, &bent, &at);
            Some(tables.map(|tables| {
                let errors = found.errors_on(v, &tables, &grid);
                (v, Self { grid, errors })
            }))
        });
        resolved.collect()
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
}

fn most(worst: f64, errors: &PerAxis) -> f64 {
    errors.iter().fold(worst, |w, e| w.max(*e))
}
