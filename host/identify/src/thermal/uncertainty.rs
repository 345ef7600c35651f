//! How certain the chosen terms and lags are, by the other ones that could have been chosen.

use super::{LAGS, ThermalGroup, ThermalSearch};
use crate::gram::Gram;
use crate::thermal_choice::{Linear, ThermalCandidate, ThermalChoice, uncertainties};
use nalgebra::{DMatrix, DVector};

/// Lags of one sensor differ at least by this factor: closer ones are the same temperature but for its noise, and would get
/// large coefficients of opposite signs.
const APART: f64 = 3.0;
/// No lag is as close to others as this one (s).
const NO_LAG: f64 = 30.0;
/// Relative change of a lag for its derivative.
const SMALL: f64 = 0.01;
/// Lags that could have been chosen: none, and from the shortest by a third of a doubling.
const SHORTEST: f64 = 30.0;
const LONGER: i32 = 29;
/// Lags about a chosen one are half a standard deviation apart, up to three on either side; no deviation of its logarithm is
/// larger.
const NEAR: i32 = 6;
const MOST_UNCERTAIN: f64 = 0.5;
/// Logarithm by which a lag is changed for how much worse others fit.
const BEND: f64 = 0.05;
/// Where none was chosen: the shortest other one (s), and how many, each by a half of a doubling longer.
const ALMOST_NONE: f64 = 10.0;
const FEW: i32 = 8;

/// A temperature that could have been chosen, at every equation (K).
struct Temperature {
    sensor: usize,
    lag: f64,
    kelvin: DVector<f64>,
}

impl ThermalSearch<'_> {
    /// The standard uncertainty of each term: with these temperatures, lags and terms, and with the choice of them. Where
    /// left-out cycles are predicted worse than chance would have it, equations have the variance of that.
    pub(super) fn uncertainties(&self, groups: &[ThermalGroup]) -> Vec<[f64; 2]> {
        let Some(chosen) = self.linear(groups).filter(|_| !groups.is_empty()) else {
            return Vec::new();
        };
        let chosen = chosen.model();
        let gram = self.gram(groups);
        let cycles = gram.by_part_of_expected();
        let of_cycles = cycles.iter().sum::<f64>() / cycles.len() as f64;
        let variance = gram.variance().max(of_cycles);
        let equations = self.residuals.len() as f64 * gram.variance() / variance;
        let temperatures = self.temperatures();
        let (mut lags, mut others) = (Vec::new(), Vec::new());
        for (g, group) in groups.iter().enumerate() {
            let at = |lag: f64| self.with_other(groups, g, group.sensor, lag);
            lags.push(near(group.lag, &chosen, variance, &at));
            others.extend(self.others(groups, g, &temperatures));
        }
        for parameter in 0..self.candidates.len() {
            let is_its = |group: &&ThermalGroup| group.parameters.contains(&parameter);
            if groups.iter().filter(is_its).count() > 1 {
                let mut without = groups.to_vec();
                for group in &mut without {
                    group.parameters.retain(|p| *p != parameter);
                }
                others.push(self.with_one(&without, parameter, &temperatures, &|_| true));
            }
            let is_coarse = |t: &Temperature| LAGS.contains(&t.lag);
            others.push(self.with_one(groups, parameter, &temperatures, &is_coarse));
        }
        uncertainties(&chosen, &lags, &others, variance, equations)
    }

    fn candidate(&self, groups: &[ThermalGroup]) -> Option<ThermalCandidate> {
        self.linear(groups).map(|linear| linear.model())
    }

    /// With another temperature for a group.
    fn with_other(
        &self,
        groups: &[ThermalGroup],
        g: usize,
        sensor: usize,
        lag: f64,
    ) -> Option<ThermalCandidate> {
        let mut all = groups.to_vec();
        (all[g].sensor, all[g].lag) = (sensor, lag);
        self.candidate(&all)
    }

    /// Models without a temperature that was chosen or with fewer of its terms.
    fn others(
        &self,
        groups: &[ThermalGroup],
        g: usize,
        temperatures: &[Temperature],
    ) -> Vec<Vec<ThermalCandidate>> {
        let group = &groups[g];
        let mut rest = groups.to_vec();
        rest.remove(g);
        let swapped = temperatures.iter().filter(|other| {
            other.sensor != group.sensor && is_apart(&rest, other.sensor, other.lag)
        });
        let swapped = swapped.filter_map(|t| self.with_other(groups, g, t.sensor, t.lag));
        let mut others = vec![swapped.collect()];
        for (k, parameter) in group.parameters.iter().enumerate() {
            let mut fewer = groups.to_vec();
            fewer[g].parameters.remove(k);
            others.push(self.candidate(&fewer).into_iter().collect());
            // With one parameter, these are those above.
            if group.parameters.len() > 1 {
                let is_own = |t: &Temperature| t.sensor == group.sensor;
                others.push(self.with_one(&fewer, *parameter, temperatures, &is_own));
                let is_other = |t: &Temperature| !is_own(t);
                others.push(self.with_one(&fewer, *parameter, temperatures, &is_other));
            }
        }
        others
    }

    /// Every sensor with every lag that could have been chosen.
    fn temperatures(&self) -> Vec<Temperature> {
        let longer = (0..LONGER).map(|k| SHORTEST * libm::exp2(f64::from(k) / 3.0));
        let lags: Vec<f64> = [0.0].into_iter().chain(longer).collect();
        let sensors = 0..self.log.sensors.len();
        let all = sensors.flat_map(|sensor| lags.iter().map(move |lag| (sensor, *lag)));
        let temperature = |(sensor, lag)| Temperature {
            sensor,
            lag,
            kelvin: self.kelvin(sensor, lag),
        };
        all.map(temperature).collect()
    }

    /// The models with a parameter that changes with one temperature more, if it is apart from those that it changes with.
    fn with_one(
        &self,
        groups: &[ThermalGroup],
        parameter: usize,
        temperatures: &[Temperature],
        is_in: &dyn Fn(&Temperature) -> bool,
    ) -> Vec<ThermalCandidate> {
        let its = groups.iter().filter(|g| g.parameters.contains(&parameter));
        let its: Vec<ThermalGroup> = its.cloned().collect();
        let tried = (temperatures.iter()).filter(|t| is_in(t) && is_apart(&its, t.sensor, t.lag));
        let (terms, columns): (Vec<ThermalChoice>, Vec<DVector<f64>>) = tried
            .map(|t| {
                let (sensor, lag) = (t.sensor, t.lag);
                let term = ThermalChoice {
                    parameter,
                    sensor,
                    lag,
                };
                (
                    term,
                    self.columns.column(parameter).component_mul(&t.kelvin),
                )
            })
            .unzip();
        match self.linear(groups) {
            Some(linear) if !columns.is_empty() => {
                linear.with(&terms, &DMatrix::from_columns(&columns))
            }
            _ => Vec::new(),
        }
    }

    /// The least squares with these groups.
    fn linear(&self, groups: &[ThermalGroup]) -> Option<Linear> {
        let terms = groups.iter().flat_map(|group| {
            let (sensor, lag) = (group.sensor, group.lag);
            let parameters = group.parameters.iter();
            parameters.map(move |parameter| ThermalChoice {
                parameter: *parameter,
                sensor,
                lag,
            })
        });
        Linear::new(self.matrix(groups), &self.residuals, terms.collect())
    }

    /// The standard uncertainty of each lag as a fraction of it, together with all other unknowns.
    pub(super) fn lag_uncertainty(&self, groups: &[ThermalGroup]) -> Vec<Option<f64>> {
        let gram = self.gram(groups);
        let solution = gram.solution();
        let mut matrix = self.matrix(groups);
        let mut next = self.fixed.ncols();
        let mut columns = Vec::new();
        for group in groups {
            if group.lag > 0.0 {
                let [more, less] = [1.0 + SMALL, (1.0 + SMALL).recip()]
                    .map(|factor| self.kelvin(group.sensor, group.lag * factor));
                let change = (more - less) / (2.0 * libm::log1p(SMALL));
                let mut effect = DVector::zeros(self.residuals.len());
                for (k, p) in group.parameters.iter().enumerate() {
                    effect += self.columns.column(*p).component_mul(&change) * solution[next + k];
                }
                let at = matrix.ncols();
                matrix = matrix.insert_column(at, 0.0);
                matrix.set_column(at, &effect);
                columns.push(Some(at));
            } else {
                columns.push(None);
            }
            next += group.parameters.len();
        }
        let deviations = Gram::new(&matrix, &self.residuals, &self.split).deviations();
        columns.iter().map(|c| c.map(|c| deviations[c])).collect()
    }
}

/// The models with the lags about one that was chosen.
fn near(
    lag: f64,
    chosen: &ThermalCandidate,
    variance: f64,
    model: &dyn Fn(f64) -> Option<ThermalCandidate>,
) -> Vec<ThermalCandidate> {
    if lag == 0.0 {
        let longer = (0..FEW).map(|k| ALMOST_NONE * libm::exp2(f64::from(k) / 2.0));
        return [0.0].into_iter().chain(longer).filter_map(model).collect();
    }
    let squares = |log: f64| model(lag * libm::exp(log)).map_or(f64::INFINITY, |m| m.squares);
    let bend = (squares(BEND) + squares(-BEND) - 2.0 * chosen.squares) / (BEND * BEND);
    let deviation = match bend > 0.0 {
        true => (2.0 * variance / bend).sqrt().min(MOST_UNCERTAIN),
        false => MOST_UNCERTAIN,
    };
    let lags = (-NEAR..=NEAR).map(|k| lag * libm::exp(0.5 * f64::from(k) * deviation));
    lags.filter_map(model).collect()
}

/// True if the lag of a sensor differs enough from its lags in `groups`.
pub(super) fn is_apart(groups: &[ThermalGroup], sensor: usize, lag: f64) -> bool {
    let ratio = |other: f64| libm::log(other.max(NO_LAG) / lag.max(NO_LAG)).abs();
    let mut same = groups.iter().filter(|g| g.sensor == sensor);
    same.all(|g| ratio(g.lag) >= libm::log(APART))
}
