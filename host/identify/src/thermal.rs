//! Chooses the temperatures, with their lags, and the parameters that explain thermal drift.
//!
//! All of it happens with the derivatives at an identification without temperatures: a parameter's change per kelvin has
//! the parameter's own column times the temperature at each row. What is chosen is what predicts *cycles* (warm-ups and
//! cool-downs) that were left out, not rows: neighbouring rows of one warm-up tell the same.

mod uncertainty;

use crate::Unknown;
use crate::formats::temperatures::{Temperatures, ThermalModel};
use crate::gram::{Gram, Split};
use crate::identified::Identified;
use crate::narrowed::narrowed;
use crate::rows::Problem;
use nalgebra::{DMatrix, DVector};
use trueaxis_model::errors::{MAX_SENSORS, Parameter, ParameterKind, Thermal, in_three_digits};
use trueaxis_model::numbers::student;
use uncertainty::is_apart;

/// Most sensors that are chosen. Each may have several lags.
pub(crate) const MOST_SENSORS: usize = 4;
/// Lags (s) that are tried first: none, and doubling. Between them, the best one is searched.
const LAGS: [f64; 10] = [
    0.0, 60.0, 120.0, 240.0, 480.0, 960.0, 1920.0, 3840.0, 7680.0, 15_360.0,
];
/// Steps of the search between two lags; each leaves 0.62 of the interval.
const STEPS: usize = 8;
/// Another temperature must reduce the residual of left-out cycles to this fraction; a smaller gain is chance.
const WORTH: f64 = 0.9;
/// A term is left out if the residual of left-out cycles grows by no more than this fraction; one that is not larger than
/// its expanded uncertainty (k = 2), by no more than the second.
const NOTHING: f64 = 0.002;
const LITTLE: f64 = 0.01;

/// What temperatures explain.
#[derive(Clone, Debug)]
pub struct Warmed {
    /// The temperatures and parameters that were chosen; without terms, nothing was better than no temperature.
    pub model: ThermalModel,
    /// The standard uncertainty of the lag of each input, as a fraction of it; `None` without a lag.
    pub lag_uncertainty: Vec<Option<f64>>,
    /// Each temperature in the order in which it was taken.
    pub taken: Vec<TakenTemperature>,
    /// What was not taken, and why.
    pub dropped: Vec<String>,
    /// Each cycle when it was left out.
    pub cycles: Vec<LeftOut>,
    /// Residual of left-out cycles (mm, root mean square of a coordinate), without temperatures and with them.
    pub left_out: [f64; 2],
    /// Half-width (mm) of the interval in which 95 % of the coordinates of another cycle are expected with the
    /// compensation, noise of the readings included.
    pub band: f64,
}

/// One temperature that was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct TakenTemperature {
    /// Sensor; again for another lag of the same.
    pub sensor: String,
    /// Residual of left-out cycles (mm) after it was taken.
    pub left_out: f64,
}

/// A cycle that was predicted from the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Number of its rows.
    pub rows: usize,
    /// Residual (mm, root mean square of a coordinate) without temperatures.
    pub without: f64,
    /// Like `without`, with them.
    pub with: f64,
}

/// Why temperatures cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ThermalError {
    /// What is wrong.
    pub reason: String,
    /// What to do about it.
    pub remedy: String,
}

impl ThermalError {
    fn new(reason: impl Into<String>, remedy: &str) -> Self {
        Self {
            reason: reason.into(),
            remedy: remedy.to_owned(),
        }
    }
}

/// The time and the cycle of each equation, and the sum of the squared weights.
type EquationTimes = (Vec<Option<f64>>, Vec<Option<usize>>, f64);

fn times_of_equations(
    problem: &Problem<'_>,
    identified: &Identified,
    log: &Temperatures,
) -> Result<EquationTimes, ThermalError> {
    let mut clocks = vec![None; problem.equations()];
    let mut parts = vec![None; problem.equations()];
    let mut squares = 0.0;
    let rows = problem.blocks().zip(problem.clocks());
    for ((block, clock), weight) in rows.zip(&identified.place.weights.rows) {
        let Some(cycle) = clock.and_then(|t| log.cycle_at(t)) else {
            let at = clock.map_or("a row has no time_s".to_owned(), |t| {
                format!("a row was measured at {t} s, of which the temperatures say nothing")
            });
            return Err(ThermalError::new(
                at,
                "give every row a time_s by the clock of the temperatures, and temperatures from before the first row to after the last one",
            ));
        };
        squares += weight * weight * block.len() as f64;
        for equation in block {
            (clocks[equation], parts[equation]) = (clock, Some(cycle));
        }
    }
    Ok((clocks, parts, squares))
}

/// A temperature with the parameters that may change with it.
#[derive(Clone, Debug)]
struct ThermalGroup {
    sensor: usize,
    lag: f64,
    /// Indices into the candidates.
    parameters: Vec<usize>,
}

struct ThermalSearch<'p> {
    log: &'p Temperatures,
    /// Of each sensor (°C).
    references: Vec<f64>,
    candidates: Vec<Parameter>,
    /// Columns of the unknowns without temperatures, then those of the candidates.
    fixed: DMatrix<f64>,
    columns: DMatrix<f64>,
    residuals: DVector<f64>,
    split: Split,
    /// The time of each equation; `None` of those that are no reading.
    clocks: Vec<Option<f64>>,
    /// Root of the sum of squared weights of one equation (1/mm), for residuals in mm.
    weight: f64,
}

/// Finds which temperatures explain the residuals of an identification, on which of `candidates` they act, and with
/// which lags. `identified` was found without temperatures.
///
/// # Errors
/// [`ThermalError`]: rows without a time or outside the log, fewer than two cycles with rows, no candidate.
pub fn thermal(
    problem: &Problem<'_>,
    identified: &Identified,
    log: &Temperatures,
    candidates: &[Parameter],
) -> Result<Warmed, ThermalError> {
    let search = ThermalSearch::new(problem, identified, log, candidates)?;
    let without = search.score(&[]);
    let mut groups: Vec<ThermalGroup> = Vec::new();
    let mut best = without;
    let mut taken = Vec::new();
    let mut dropped = Vec::new();
    while groups.len() < MAX_SENSORS {
        let Some((next, score)) = search.best_addition(&groups) else {
            break;
        };
        if score > best * WORTH {
            dropped.push(format!(
                "{} would leave {:.2} instead of {:.2} µm of left-out cycles",
                search.name(&next),
                score * search.um(),
                best * search.um()
            ));
            break;
        }
        groups.push(next);
        best = search.refine(&mut groups, score);
        taken.push(TakenTemperature {
            sensor: log.sensors[groups[groups.len() - 1].sensor].clone(),
            left_out: best / search.weight,
        });
    }
    let pruned = search.prune(&mut groups, best);
    for (group, parameters) in pruned {
        dropped.push(format!(
            "{parameters} with {group}: left-out cycles are predicted as well without"
        ));
    }
    search.finish(groups, taken, dropped, without)
}

impl<'p> ThermalSearch<'p> {
    fn new(
        problem: &Problem<'_>,
        identified: &Identified,
        log: &'p Temperatures,
        candidates: &[Parameter],
    ) -> Result<Self, ThermalError> {
        let candidates = candidates.iter().copied();
        let candidates: Vec<Parameter> = candidates
            .filter(|p| p.kind != ParameterKind::Backlash)
            .collect();
        if candidates.is_empty() {
            return Err(ThermalError::new(
                "no parameter is looked for that can change with temperature",
                "give --model or --thermal the names of locations and coefficients",
            ));
        }
        let place = &identified.place;
        let all = problem.jacobian(&place.estimate, &place.weights);
        let fixed = all.select_columns(place.factor.unknowns());
        let unknowns: Vec<Unknown> = candidates.iter().map(|p| Unknown::Parameter(*p)).collect();
        let columns = problem.derivatives(&unknowns, &place.estimate, &place.weights);
        let residuals = problem.residuals(&place.estimate, &place.weights);
        let (clocks, parts, squares) = times_of_equations(problem, identified, log)?;
        let split = Split::new(&parts);
        if split.parts() < 2 {
            return Err(ThermalError::new(
                "there is only one cycle with rows, so none can be left out",
                "measure at least two warm-ups or cool-downs, and number them in a column `cycle` of the temperatures or pause the record between them",
            ));
        }
        let first = &log.readings[0].celsius;
        Ok(Self {
            log,
            // To a tenth of a kelvin.
            references: first.iter().map(|c| (c * 10.0).round() / 10.0).collect(),
            candidates,
            fixed,
            columns,
            residuals,
            weight: (squares / problem.measured() as f64).sqrt(),
            split,
            clocks,
        })
    }

    fn um(&self) -> f64 {
        1e3 / self.weight
    }

    fn input(&self, group: &ThermalGroup) -> Thermal {
        Thermal {
            sensor: self.log.sensors[group.sensor].clone(),
            lag: group.lag,
            reference_celsius: self.references[group.sensor],
            range_kelvin: [0.0; 2],
            rate: Thermal::RATE,
            range_celsius: Thermal::RANGE_CELSIUS,
        }
    }

    fn name(&self, group: &ThermalGroup) -> String {
        self.input(group).name()
    }

    /// The temperature of a group at every equation (K).
    fn kelvin(&self, sensor: usize, lag: f64) -> DVector<f64> {
        let values = self.log.kelvin(sensor, self.references[sensor], lag);
        let at = |clock: &Option<f64>| clock.and_then(|t| self.log.at(&values, t)).unwrap_or(0.0);
        DVector::from_iterator(self.clocks.len(), self.clocks.iter().map(at))
    }

    /// All columns: fixed ones, then those of the groups.
    fn matrix(&self, groups: &[ThermalGroup]) -> DMatrix<f64> {
        let extra: usize = groups.iter().map(|g| g.parameters.len()).sum();
        let first = self.fixed.ncols();
        let mut all = self.fixed.clone().insert_columns(first, extra, 0.0);
        let mut next = first;
        for group in groups {
            let kelvin = self.kelvin(group.sensor, group.lag);
            for p in &group.parameters {
                let column = self.columns.column(*p).component_mul(&kelvin);
                all.set_column(next, &column);
                next += 1;
            }
        }
        all
    }

    fn gram(&self, groups: &[ThermalGroup]) -> Gram {
        Gram::new(&self.matrix(groups), &self.residuals, &self.split)
    }

    /// Residual of left-out cycles (root mean square, weighted) with these groups.
    fn score(&self, groups: &[ThermalGroup]) -> f64 {
        self.gram(groups).left_out()
    }

    fn with(&self, groups: &[ThermalGroup], sensor: usize, lag: f64) -> Vec<ThermalGroup> {
        let mut more = groups.to_vec();
        more.push(ThermalGroup {
            sensor,
            lag,
            parameters: (0..self.candidates.len()).collect(),
        });
        more
    }

    /// The temperature that predicts left-out cycles best beside `groups`, and the residual then.
    fn best_addition(&self, groups: &[ThermalGroup]) -> Option<(ThermalGroup, f64)> {
        let mut used: Vec<usize> = groups.iter().map(|g| g.sensor).collect();
        used.sort_unstable();
        used.dedup();
        let sensors = 0..self.log.sensors.len();
        let sensors = sensors.filter(|s| used.len() < MOST_SENSORS || used.contains(s));
        let tries = sensors.flat_map(|sensor| LAGS.map(|lag| (sensor, lag)));
        let is_new = |(sensor, lag): &(usize, f64)| is_apart(groups, *sensor, *lag);
        let scored = tries.filter(is_new).map(|(sensor, lag)| {
            let more = self.with(groups, sensor, lag);
            let score = self.score(&more);
            (more[more.len() - 1].clone(), score)
        });
        scored.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Searches the lags of all groups, one after the other, the last one first; returns the residual then.
    fn refine(&self, groups: &mut [ThermalGroup], mut best: f64) -> f64 {
        for number in (0..groups.len()).rev() {
            let start = groups[number].lag;
            if start == 0.0 {
                continue;
            }
            let mut own = groups[number].clone();
            let others = |lag: f64| {
                let mut all = groups.to_vec();
                all.remove(number);
                is_apart(&all, own.sensor, lag).then_some(all)
            };
            let score = |lag: f64| match others(lag) {
                None => f64::INFINITY,
                Some(mut all) => {
                    all.push(ThermalGroup { lag, ..own.clone() });
                    self.score(&all)
                }
            };
            let (lag, found) = narrowed([start / 2.0, start * 2.0], STEPS, score);
            let kept = if found < best { lag } else { start };
            best = best.min(found);
            own.lag = in_three_digits(kept);
            groups[number] = own;
        }
        best.max(self.score(groups))
    }

    /// Removes the terms without which left-out cycles are predicted as well, the least certain first. Returns what was
    /// removed from which temperature.
    fn prune(&self, groups: &mut Vec<ThermalGroup>, best: f64) -> Vec<(String, String)> {
        let mut removed: Vec<(String, Vec<String>)> = Vec::new();
        let mut least = best;
        let mut needed: Vec<(usize, f64, usize)> = Vec::new();
        while let Some((certain, g, k)) = self.least_certain(groups, &needed) {
            let mut fewer = groups.clone();
            let parameter = fewer[g].parameters.remove(k);
            let score = self.score(&fewer);
            let growth = if certain < 2.0 { LITTLE } else { NOTHING };
            if score > least * (1.0 + growth) {
                needed.push((groups[g].sensor, groups[g].lag, parameter));
                continue;
            }
            least = least.min(score);
            let name = self.name(&groups[g]);
            let said = self.candidates[parameter].to_string();
            match removed.iter_mut().find(|(of, _)| *of == name) {
                Some((_, all)) => all.push(said),
                None => removed.push((name, vec![said])),
            }
            *groups = fewer;
        }
        groups.retain(|group| !group.parameters.is_empty());
        let joined = (removed.into_iter()).map(|(name, all)| (name, all.join(", ")));
        joined.collect()
    }

    /// The term whose value is the least certain but for those that are needed: how many standard uncertainties it has, its
    /// group and its place there.
    fn least_certain(
        &self,
        groups: &[ThermalGroup],
        needed: &[(usize, f64, usize)],
    ) -> Option<(f64, usize, usize)> {
        let certain = self.gram(groups).significance();
        let mut terms: Vec<(f64, usize, usize)> = Vec::new();
        let mut next = self.fixed.ncols();
        for (g, group) in groups.iter().enumerate() {
            for (k, p) in group.parameters.iter().enumerate() {
                let is_needed = needed.contains(&(group.sensor, group.lag, *p));
                if !is_needed {
                    terms.push((certain[next], g, k));
                }
                next += 1;
            }
        }
        terms.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn finish(
        &self,
        mut groups: Vec<ThermalGroup>,
        taken: Vec<TakenTemperature>,
        mut dropped: Vec<String>,
        without: f64,
    ) -> Result<Warmed, ThermalError> {
        let cold = self.gram(&[]).by_part();
        let mut warm = self.gram(&groups).by_part();
        let better = cold.iter().zip(&warm).filter(|(a, b)| b.mean < a.mean);
        if !groups.is_empty() && 2 * better.count() <= cold.len() {
            dropped.push("everything: most cycles are predicted better without".to_owned());
            groups.clear();
            warm.clone_from(&cold);
        }
        let cycles: Vec<LeftOut> = (cold.iter().zip(&warm))
            .map(|(a, b)| LeftOut {
                rows: a.equations,
                without: a.mean.sqrt() / self.weight,
                with: b.mean.sqrt() / self.weight,
            })
            .collect();
        let with = (cycles.iter())
            .map(|c| c.with.powi(2) * c.rows as f64)
            .sum::<f64>();
        let count: usize = cycles.iter().map(|c| c.rows).sum();
        let with = (with / count as f64).sqrt();
        Ok(Warmed {
            lag_uncertainty: self.lag_uncertainty(&groups),
            model: self.model(&groups, (!groups.is_empty()).then(|| band(&cycles, with))),
            taken: if groups.is_empty() { Vec::new() } else { taken },
            dropped,
            left_out: [without / self.weight, with],
            band: band(&cycles, with),
            cycles,
        })
    }

    /// The chosen terms; `left` is the 95 % interval of what they leave, if there are any.
    fn model(&self, groups: &[ThermalGroup], left: Option<f64>) -> ThermalModel {
        let (mut inputs, mut kelvin, mut terms) = (Vec::new(), Vec::new(), Vec::new());
        for (number, group) in groups.iter().enumerate() {
            let at_rows = self.kelvin(group.sensor, group.lag);
            inputs.push(Thermal {
                range_kelvin: [floor_tenth(at_rows.min()), -floor_tenth(-at_rows.max())],
                ..self.input(group)
            });
            let reference = self.references[group.sensor];
            kelvin.push(self.log.kelvin(group.sensor, reference, group.lag));
            let own = group.parameters.iter();
            terms.extend(own.map(|p| (self.candidates[*p], number)));
        }
        let choice = self.uncertainties(groups);
        let of_choice = |[own, whole]: &[f64; 2]| (whole * whole - own * own).max(0.0).sqrt();
        ThermalModel {
            log: self.log.clone(),
            inputs,
            terms,
            choice: choice.iter().map(of_choice).collect(),
            kelvin,
            left,
        }
    }
}

/// Half-width of the interval in which 95 % of the coordinates of another cycle are expected: Student's factor for as
/// many cycles as there are, since what is left of one cycle is not independent from reading to reading.
fn band(cycles: &[LeftOut], with: f64) -> f64 {
    student(cycles.len() - 1) * with * (1.0 + 1.0 / cycles.len() as f64).sqrt()
}

/// A tenth of a kelvin below, and not above 0.
fn floor_tenth(kelvin: f64) -> f64 {
    ((kelvin * 10.0).floor() / 10.0).min(0.0)
}
