//! How uncertain thermal coefficients are because other lags, temperatures and terms could have been chosen (Bayesian model
//! averaging).
//!
//! Beside the chosen model there are others: with another lag, a term less, another temperature in place of one, a term
//! more. Each has the probability exp(−χ²/2 − k/2·ln n) relative to the chosen one (Schwarz), where χ² is what it leaves
//! more and k counts its further unknowns; alternatives of one kind share the probability of one. The variance of a
//! coefficient is that within each model and that between them, summed over the kinds.

use crate::gram::scaled;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Models that are less probable than this do not count.
const NOTHING: f64 = 1e-5;
/// Part of the squares of a column that must be outside the others. A further term with less (a variance inflation of more
/// than 100) is no other explanation: only its difference from the terms that are there could be large, by any amount.
const OUTSIDE: f64 = 0.01;

/// The change of a parameter (by its number) with a temperature after a lag (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThermalChoice {
    pub parameter: usize,
    pub sensor: usize,
    pub lag: f64,
}

/// Least squares of some equations. Its terms are its last unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Linear {
    terms: Vec<ThermalChoice>,
    /// With columns of length 1: these, the inverse of the normal equations, and the unknowns.
    columns: DMatrix<f64>,
    lengths: DVector<f64>,
    inverse: DMatrix<f64>,
    solution: DVector<f64>,
    /// What is left.
    residuals: DVector<f64>,
}

/// A model as far as it counts.
#[derive(Clone, Debug)]
pub(crate) struct ThermalCandidate {
    /// Sum of the squares that it leaves.
    pub squares: f64,
    unknowns: usize,
    /// Terms with their coefficient, and the variance of it for equations with a variance of 1.
    values: Vec<(ThermalChoice, [f64; 2])>,
}

impl Linear {
    /// For equations X·x + r ≈ 0; `None` if the columns depend on each other.
    pub fn new(
        matrix: DMatrix<f64>,
        residuals: &DVector<f64>,
        terms: Vec<ThermalChoice>,
    ) -> Option<Self> {
        let (columns, lengths) = scaled(matrix);
        let square: Cholesky<f64, Dyn> = Cholesky::new(columns.tr_mul(&columns))?;
        let solution = square.solve(&-columns.tr_mul(residuals));
        Some(Self {
            terms,
            residuals: residuals + &columns * &solution,
            inverse: square.inverse(),
            solution,
            lengths,
            columns,
        })
    }

    pub fn model(&self) -> ThermalCandidate {
        let first = self.lengths.len() - self.terms.len();
        let values = self.terms.iter().enumerate().map(|(k, term)| {
            let (i, length) = (first + k, self.lengths[first + k]);
            let variance = self.inverse[(i, i)] / (length * length);
            (*term, [self.solution[i] / length, variance])
        });
        ThermalCandidate {
            squares: self.residuals.norm_squared(),
            unknowns: self.lengths.len(),
            values: values.collect(),
        }
    }

    /// The models with one further term each, whose columns are given.
    pub fn with(&self, further: &[ThermalChoice], columns: &DMatrix<f64>) -> Vec<ThermalCandidate> {
        let crosses = self.columns.tr_mul(columns);
        let moves = &self.inverse * &crosses;
        let base = self.model();
        let first = self.lengths.len() - self.terms.len();
        let one = |(j, term): (usize, &ThermalChoice)| {
            let column = columns.column(j);
            let length = column.norm_squared();
            let outside = length - crosses.column(j).dot(&moves.column(j));
            if outside.is_nan() || outside <= OUTSIDE * length {
                return None;
            }
            let gradient = column.dot(&self.residuals);
            let value = -gradient / outside;
            let mut model = base.clone();
            model.squares -= gradient * gradient / outside;
            model.unknowns += 1;
            for (k, (_, [own, variance])) in model.values.iter_mut().enumerate() {
                let by = moves[(first + k, j)] / self.lengths[first + k];
                *own -= by * value;
                *variance += by * by / outside;
            }
            model.values.push((*term, [value, outside.recip()]));
            Some(model)
        };
        further.iter().enumerate().filter_map(one).collect()
    }
}

impl ThermalCandidate {
    /// Coefficient and variance of a term; a sensor with several lags has the one whose lag is nearest. Zero if it has none.
    fn value(&self, of: &ThermalChoice) -> [f64; 2] {
        let apart = |lag: f64| libm::log((lag + 1.0) / (of.lag + 1.0)).abs();
        let is_same = |(term, _): &&(ThermalChoice, [f64; 2])| {
            (term.parameter, term.sensor) == (of.parameter, of.sensor)
        };
        let own = self.values.iter().filter(is_same);
        let nearest = own.min_by(|(a, _), (b, _)| apart(a.lag).total_cmp(&apart(b.lag)));
        nearest.map_or([0.0; 2], |(_, value)| *value)
    }
}

/// The standard uncertainties of the coefficients of a model: without the choice, and with it. `lags` has models with other
/// lags, the chosen one among them, for each lag that was chosen; `others` each kind of others.
pub(crate) fn uncertainties(
    chosen: &ThermalCandidate,
    lags: &[Vec<ThermalCandidate>],
    others: &[Vec<ThermalCandidate>],
    variance: f64,
    equations: f64,
) -> Vec<[f64; 2]> {
    let worse = |model: &ThermalCandidate| {
        let more = model.unknowns as f64 - chosen.unknowns as f64;
        -0.5 * (model.squares - chosen.squares) / variance - 0.5 * more * libm::log(equations)
    };
    let lags = lags.iter().map(|lags| {
        let all = lags.iter().map(|model| (model, worse(model)));
        probable(all.collect())
    });
    let others = others.iter().map(|kind| {
        let share = libm::log(kind.len() as f64);
        let all = kind.iter().map(|model| (model, worse(model) - share));
        probable(all.chain([(chosen, 0.0)]).collect())
    });
    let all: Vec<(&ThermalCandidate, f64)> = lags.chain(others).flatten().collect();
    let of = |(term, [value, own]): &(ThermalChoice, [f64; 2])| {
        let by = |(model, probability): &(&ThermalCandidate, f64)| {
            let [other, within] = model.value(term);
            let between = (other - value) * (other - value);
            probability * (between + ((within - own) * variance).max(0.0))
        };
        let choice = all.iter().map(by).sum::<f64>();
        [own * variance, own * variance + choice].map(f64::sqrt)
    };
    chosen.values.iter().map(of).collect()
}

/// Models with their probabilities, from the logarithms of these up to a factor.
fn probable(mut all: Vec<(&ThermalCandidate, f64)>) -> Vec<(&ThermalCandidate, f64)> {
    let logs = all.iter().map(|(_, log)| *log);
    let most = logs.fold(f64::NEG_INFINITY, f64::max);
    for (_, log) in &mut all {
        *log = libm::exp(*log - most);
    }
    let sum: f64 = all.iter().map(|(_, one)| one).sum();
    for (_, one) in &mut all {
        *one /= sum;
    }
    all.retain(|(_, one)| *one > NOTHING);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const TERM: ThermalChoice = ThermalChoice {
        parameter: 0,
        sensor: 0,
        lag: 0.0,
    };

    #[test]
    fn a_further_term_is_that_of_a_fit_with_it() {
        let matrix = DMatrix::from_fn(30, 3, |i, j| (i as f64 / 30.0).powi(j as i32));
        let residuals = DVector::from_fn(30, |i, _| libm::cos(i as f64 * 0.3));
        let other = ThermalChoice { sensor: 1, ..TERM };
        let fewer = matrix.columns(0, 2).into_owned();
        let fewer = Linear::new(fewer, &residuals, vec![TERM]).unwrap();
        let found = fewer.with(&[other], &matrix.columns(2, 1).into_owned());
        let whole = Linear::new(matrix, &residuals, vec![TERM, other]).unwrap();
        let whole = whole.model();
        assert!((found[0].squares / whole.squares - 1.0).abs() < 1e-9);
        assert_eq!(found[0].unknowns, whole.unknowns);
        for ((_, a), (_, b)) in found[0].values.iter().zip(&whole.values) {
            for (a, b) in a.iter().zip(b) {
                assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_temperature_that_fits_as_well_leaves_a_coefficient_that_may_be_zero() {
        let model = |sensor: usize, squares: f64| ThermalCandidate {
            squares,
            unknowns: 1,
            values: vec![(ThermalChoice { sensor, ..TERM }, [3.0, 0.04])],
        };
        let of = |squares: f64| {
            let others = [vec![model(1, squares)]];
            uncertainties(&model(0, 10.0), &[], &others, 1.0, 10.0)[0][1]
        };
        // Half of 3².
        assert!((of(10.0) - (0.04_f64 + 4.5).sqrt()).abs() < 1e-6);
        // Much worse.
        assert!((of(40.0) - 0.2).abs() < 1e-3);
    }

    #[test]
    fn lags_that_fit_alike_add_their_variance() {
        let model = |lag: f64, value: f64| ThermalCandidate {
            squares: 10.0,
            unknowns: 1,
            values: vec![(ThermalChoice { lag, ..TERM }, [value, 0.04])],
        };
        let chosen = model(100.0, 1.0);
        let lags = vec![vec![model(90.0, 0.7), model(110.0, 1.3)]];
        let found = uncertainties(&chosen, &lags, &[], 1.0, 10.0);
        assert!((found[0][0] - 0.2).abs() < 1e-12);
        assert!(
            (found[0][1] - (0.04_f64 + 0.09).sqrt()).abs() < 1e-6,
            "{found:?}"
        );
    }
}
