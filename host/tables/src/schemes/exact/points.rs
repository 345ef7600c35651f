//! How many points each variable's tables need, and where they lie.

use super::cubic;
use super::limits::{GRID_SLACK, LEAST_INTERVALS, MOST_INTERVALS, STUCK};
use super::seen::Seen;
use super::spline;
use super::structure::Function;
use super::tables::{Found, Sampled};
use super::variables::Variable;
use crate::schemes::Options;
use std::collections::BTreeMap;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;

/// Evenly spaced points over a variable's range, in its kinematic unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The first point: the lower end of the range, or before it.
    pub start: f64,
    /// From point to point.
    pub step: f64,
    /// One less than the points; as many, if the variable wraps.
    pub intervals: usize,
    /// Interpolation between them: cubic or linear.
    pub cubic: bool,
}

impl Grid {
    /// From end to end.
    pub fn over([low, high]: [f64; 2], intervals: usize) -> Self {
        Self {
            start: low,
            step: (high - low) / intervals as f64,
            intervals,
            cubic: false,
        }
    }

    /// With at least so many intervals over the range, and the ends of a calibrated range on points.
    fn even(variable: &Variable, least: usize) -> Self {
        let [low, high] = variable.range;
        let (Some(first), Some(last)) = (variable.ends.first(), variable.ends.last()) else {
            return Self::over(variable.range, least);
        };
        if variable.wraps {
            return Self::over(variable.range, least);
        }
        let step = (high - low) / least as f64;
        let between = ((last - first) / step - GRID_SLACK).ceil();
        let step = if between > 0.0 {
            (last - first) / between
        } else {
            step
        };
        Self::through(*first, step, variable.range)
    }

    /// With a point at a position, over the range and up to a step beyond it.
    fn through(point: f64, step: f64, [low, high]: [f64; 2]) -> Self {
        let before = ((point - low) / step - GRID_SLACK).ceil().max(0.0);
        let start = point - before * step;
        let intervals = ((high - start) / step - GRID_SLACK).ceil() as usize;
        Self {
            start,
            step,
            intervals: intervals.max(1),
            cubic: false,
        }
    }

    /// The coarsest grid that has all kinks of a variable on points: those where motions were
    /// measured, and where they begin to hold. `None` if nothing was measured, or there is none.
    pub fn through_kinks(variable: &Variable) -> Option<Self> {
        let [low, high] = variable.range;
        let first = *variable.kinks.first()?;
        if variable.kinks.len() <= variable.ends.len() {
            return None;
        }
        // Where the positions repeat, its ends are one point.
        let ends = if variable.wraps { vec![high] } else { vec![] };
        let all: Vec<f64> = variable.kinks.iter().copied().chain(ends).collect();
        let gap = all
            .windows(2)
            .map(|w| w[1] - w[0])
            .fold(high - low, f64::min);
        (1..=4)
            .map(|parts| gap / f64::from(parts))
            .find(|step| {
                let on_point = |x: &f64| {
                    let steps = (x - first) / step;
                    (steps - steps.round()).abs() < GRID_SLACK
                };
                all.iter().all(on_point) && (!variable.wraps || on_point(&low))
            })
            .map(|step| {
                // Steps measured over the longest way: rounding of short ones adds up.
                let last = all[all.len() - 1];
                let steps = ((last - first) / step).round();
                let step = if steps > 0.0 {
                    (last - first) / steps
                } else {
                    step
                };
                Self::through(first, step, variable.range)
            })
            .filter(|grid| grid.intervals <= MOST_INTERVALS)
    }

    /// Each interval in so many parts.
    fn divided(self, parts: usize) -> Self {
        Self {
            step: self.step / parts as f64,
            intervals: self.intervals * parts,
            ..self
        }
    }

    /// How many samples a table on it has, of a variable that wraps or not.
    pub fn samples(&self, wraps: bool) -> usize {
        match self.cubic {
            true => spline::count(self.intervals, wraps),
            false => self.intervals + usize::from(!wraps),
        }
    }

    /// The positions at which tables on it are sampled, of a variable that wraps or not: its points, for
    /// cubic tables also the middles between them.
    pub fn sampled_at(&self, wraps: bool) -> impl Iterator<Item = f64> + '_ {
        let (count, step) = match self.cubic {
            true => (spline::positions(self.intervals, wraps), 0.5 * self.step),
            false => (self.samples(wraps), self.step),
        };
        (0..count).map(move |i| self.start + step * i as f64)
    }

    /// The points, in order.
    pub fn points(&self) -> impl Iterator<Item = f64> + '_ {
        (0..=self.intervals).map(|i| self.start + self.step * i as f64)
    }
}

/// Grids of the bent tables of each variable, so that interpolation of all of them together errs by
/// no more than `share` of the tolerance; as many points as `options` give instead, if they do. Where
/// motions were measured, points lie between those positions only if `finer`.
pub fn grids(
    found: &Found<'_>,
    seen: &BTreeMap<usize, Seen>,
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
                cubic::cost(functions.len(), samples, grid.cubic, options.format)
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
                cheapest(Grid::even(variable, linear), cubic::grid(variable, cubic))
            }
            (None, None) => coarsest(found, *v, functions, each, finer)?,
        };
        grids.insert(*v, grid);
    }
    Ok(grids)
}

/// The coarsest grid found whose interpolation errs by no more than `most`; the best one, if none
/// does.
fn coarsest(
    found: &Found<'_>,
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
            // What is left between measured points is curved, or it is what motions do to the
            // arguments of others: a step at each of them, which no points take away.
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
        // Coarser than what was measured only where that is much finer than the tolerance.
        if error > 0.1 * most {
            return Ok(grid);
        }
        through_is_enough = true;
        count = (grid.intervals / 2).max(LEAST_INTERVALS);
    }
    // The error of linear interpolation falls with the square of the interval: one look tells, and the
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

impl Found<'_> {
    /// How far straight lines between the values of a variable's tables on a grid may lead each output
    /// astray, in units of its tolerance: table by table in the middle of every interval and at every kink
    /// between points, with the other factors at their peaks.
    pub fn interpolation_error(
        &self,
        v: usize,
        functions: &[Function],
        grid: &Grid,
    ) -> Result<f64, NotConverged> {
        let variable = &self.sampler.variables[v];
        let [low, high] = variable.range;
        let points: Vec<f64> = grid.points().map(|x| x.clamp(low, high)).collect();
        let slack = GRID_SLACK * grid.step;
        // Where to look: interval, position.
        let mut looks: Vec<(usize, f64)> = Vec::new();
        let mut kinks = variable.kinks.iter().copied().peekable();
        for (k, ends) in points.windows(2).enumerate() {
            if ends[1] - ends[0] < slack {
                continue; // beyond the range
            }
            looks.push((k, 0.5 * (ends[0] + ends[1])));
            while let Some(x) = kinks.next_if(|x| *x < ends[1] - slack) {
                // Next to the ends of the calibrated range nothing is gained by more points.
                if x > ends[0] + slack && !variable.ends.contains(&x) {
                    looks.push((k, x));
                }
            }
            while kinks.next_if(|x| *x <= ends[1] + slack).is_some() {}
        }
        let at: Vec<f64> = looks.iter().map(|(_, x)| *x).collect();
        let truth = self.sample(v, functions, &at)?;
        let sampled = self.sample(v, functions, &points)?;
        // An end belongs to the inner side: there the tables go on smoothly up to it, and step to the
        // held value within the first interval outside.
        let [first, last] = variable.calibrated;
        let steps = |k: usize| {
            let from = (points[k] - last).abs() < slack;
            let to = (points[k + 1] - first).abs() < slack;
            let around = |e: &f64| *e > points[k] + slack && *e < points[k + 1] - slack;
            variable.ends.iter().any(around) || (from || to) && !variable.ends.is_empty()
        };
        let mut worst = 0.0_f64;
        for (row, (k, x)) in looks.iter().enumerate() {
            if steps(*k) {
                continue;
            }
            let share = (x - points[*k]) / (points[*k + 1] - points[*k]);
            let line = [(*k, 1.0 - share), (*k + 1, share)];
            let errors = self.errors_at(v, (&sampled, &line), (&truth, row));
            worst = errors.iter().fold(worst, |w, e| w.max(*e));
        }
        Ok(worst)
    }

    /// What interpolation with these weights of rows does to each output, against the true values in a
    /// row of others.
    pub fn errors_at(
        &self,
        v: usize,
        (sampled, weights): (&Sampled, &[(usize, f64)]),
        (truth, row): (&Sampled, usize),
    ) -> PerAxis {
        let mut errors = PerAxis::default();
        for term in &self.structure.terms {
            let own: Vec<usize> = term
                .factors
                .iter()
                .filter(|(w, _)| *w == v)
                .filter_map(|(_, f)| sampled.functions.iter().position(|g| g == f))
                .collect();
            if own.is_empty() {
                continue;
            }
            let others: f64 = term
                .factors
                .iter()
                .filter(|(w, _)| *w != v)
                .map(|(w, f)| self.peak(*w, f))
                .product();
            let exact: f64 = own.iter().map(|c| truth.values[(row, *c)]).product();
            let between = |c: &usize| {
                let parts = weights.iter().map(|(k, w)| w * sampled.values[(*k, *c)]);
                parts.sum::<f64>()
            };
            let interpolated: f64 = own.iter().map(between).product();
            errors[term.output] += (term.weight * others * (interpolated - exact)).abs();
        }
        errors
    }

    /// Largest magnitude of a table in the calibrated range, or a bound of it.
    fn peak(&self, v: usize, function: &Function) -> f64 {
        match function {
            Function::Numeric(k) => self.bases[v].peaks[*k],
            Function::Merged(id) => self.bases[v].peak_of(&self.structure.merged[*id].coefficients),
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, machine, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;
    use trueaxis_model::machine::Machine;

    fn first(machine: &Machine, lines: &str) -> Variable {
        let errors = errors(machine, lines);
        variables(&Kinematics::new(machine, &errors), 1e-6).remove(0)
    }

    fn table(name: &str, at: &[f64]) -> String {
        let values = vec!["0.0"; at.len() - 1].join(", ");
        format!("[tabulated.{name}]\nat = {at:?}\nvalue = [{values}, 1e-3]\n")
    }

    fn has(grid: &Grid, x: f64) -> bool {
        grid.points().any(|p| (p - x).abs() < 1e-9)
    }

    #[test]
    fn a_grid_has_all_measured_points_and_no_more_than_they_ask_for() {
        let machine = with_rotary(&[]);
        let fine: Vec<f64> = (0..=50).map(|i| -200.0 + 8.0 * f64::from(i)).collect();
        let coarse: Vec<f64> = (0..=25).map(|i| -200.0 + 16.0 * f64::from(i)).collect();
        let lines = table("EXX", &fine) + &table("EYX", &coarse);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!((grid.start, grid.intervals), (-200.0, 50));
        // Thirds of the one and halves of the other meet every sixth.
        let third: Vec<f64> = (0..=75)
            .map(|i| -200.0 + 400.0 / 75.0 * f64::from(i))
            .collect();
        let lines = table("EXX", &fine) + &table("EYX", &third);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!(grid.intervals, 150);
    }

    #[test]
    fn points_measured_on_a_part_of_the_travel_are_points_and_the_grid_covers_the_rest() {
        let machine = with_rotary(&[]);
        let variable = first(&machine, &table("EXX", &[-130.0, -60.0, 10.0, 80.0]));
        let grid = Grid::through_kinks(&variable).unwrap();
        assert!([-130.0, -60.0, 10.0, 80.0].iter().all(|x| has(&grid, *x)));
        let points: Vec<f64> = grid.points().collect();
        assert!(points[0] <= -200.0 && points[1] > -200.0);
        assert!(points[points.len() - 1] >= 200.0 && points[points.len() - 2] < 200.0);
    }

    #[test]
    fn uneven_points_on_a_common_step_share_a_grid_and_others_have_none() {
        let machine = machine(&[
            ('X', [-400.0, 400.0]),
            ('Y', [-200.0, 200.0]),
            ('Z', [-200.0, 200.0]),
        ]);
        let lines = table("EXX", &[-300.0, -100.0, 0.0, 200.0, 350.0]);
        let grid = Grid::through_kinks(&first(&machine, &lines)).unwrap();
        assert_eq!((grid.start, grid.step, grid.intervals), (-400.0, 50.0, 16));
        let lines = table("EXX", &[-300.0, -101.7, 3.3, 200.0, 350.0]);
        assert_eq!(Grid::through_kinks(&first(&machine, &lines)), None);
    }

    #[test]
    fn the_ends_of_a_calibrated_range_are_points_of_every_grid() {
        let machine = with_rotary(&[]);
        let lines = "[parameters]\nEYX2 = 1e-9\n[calibrated]\nX = [-133.0, 71.0]\n";
        let variable = first(&machine, lines);
        for least in [4, 7, 48, 1000] {
            let grid = Grid::even(&variable, least);
            assert!(has(&grid, -133.0) && has(&grid, 71.0), "{least}");
            assert!(grid.intervals >= least && grid.intervals < 2 * least + 4);
        }
        assert_eq!(Grid::through_kinks(&variable), None);
    }
}
