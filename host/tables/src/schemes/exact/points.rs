//! Chooses the number and positions of the points of each variable's tables.

use super::grid::{self, Grid};
use super::limits::{GRID_SLACK, LEAST_INTERVALS, MOST_INTERVALS, STUCK};
use super::peak_tables::PeakTables;
use super::structure::Function;
use super::tables::{Decomposition, errors_at};
use crate::schemes::Options;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::NotConverged;

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
    pub(crate) fn interpolation_error(
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
