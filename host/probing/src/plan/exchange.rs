//! Chooses the most informative rows, by adding and removing rows one by one as long as that helps.

use nalgebra::{DMatrix, Matrix3};
use trueaxis_model::parallel;

/// The criterion of a design.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    /// The determinant of the covariance (D-optimal): all unknowns together.
    Determinant,
    /// The mean variance of the effect of the unknowns (I-optimal).
    Effect,
}

/// A group of three equations, chosen or not.
#[derive(Clone)]
struct ExchangeRow {
    /// Their derivatives, transposed: unknowns × 3.
    equations: DMatrix<f64>,
    /// Their covariance under the current design.
    variance: Matrix3<f64>,
    /// Their covariance with the effect.
    effect: DMatrix<f64>,
    chosen: bool,
}

/// A design that can be changed row by row.
#[derive(Clone)]
pub(super) struct RowExchange {
    rows: Vec<ExchangeRow>,
    /// The covariance of the unknowns, in units of [`Self::scales`].
    covariance: DMatrix<f64>,
    /// Information without any row.
    known: DMatrix<f64>,
    /// The effect: its mean variance is the trace of `effect · covariance · effectᵀ`.
    effect: DMatrix<f64>,
    /// The scale of each unknown.
    scales: Vec<f64>,
    /// Work done so far (in matrix elements), and the limit after which exchanges stop.
    work: u64,
    most_work: u64,
}

/// Initial information on the unknowns, as a fraction of that of an average row: far less than one row gives for the
/// worst combination of the document's largest model (condition number 3900).
const IGNORANCE: f64 = 1e-9;
/// An exchange must gain this fraction, or it is rounding.
const WORTH: f64 = 1e-6;
/// Number of row changes after which everything is recomputed.
const FRESH: usize = 16;
/// Largest number of exchanges per row; they usually end after one or two.
const PATIENCE: usize = 5;

impl RowExchange {
    /// `rows` of three equations to choose from, equations that always apply, and the effect of the unknowns (rows
    /// whose squares are averaged). All have one column per unknown.
    pub fn new(rows: &[DMatrix<f64>], fixed: &DMatrix<f64>, effect: &DMatrix<f64>) -> Self {
        let unknowns = fixed.ncols();
        let mut scales = vec![0.0; unknowns];
        for row in rows {
            for (scale, column) in scales.iter_mut().zip(row.column_iter()) {
                *scale += column.norm_squared() / rows.len() as f64;
            }
        }
        for scale in &mut scales {
            *scale = Some(scale.sqrt()).filter(|s| *s > 0.0).unwrap_or(1.0);
        }
        let fixed = scaled(fixed, &scales);
        let mut known = fixed.tr_mul(&fixed);
        for i in 0..unknowns {
            known[(i, i)] += IGNORANCE;
        }
        let row = |row: &DMatrix<f64>| ExchangeRow {
            equations: scaled(row, &scales).transpose(),
            variance: Matrix3::zeros(),
            effect: DMatrix::zeros(0, 0),
            chosen: false,
        };
        let mut exchange = Self {
            rows: rows.iter().map(row).collect(),
            covariance: DMatrix::zeros(0, 0),
            known,
            effect: scaled(effect, &scales),
            scales,
            work: 0,
            most_work: u64::MAX,
        };
        exchange.refresh();
        exchange
    }

    /// Limits the work for exchanges.
    pub(crate) fn limited_to(self, most_work: u64) -> Self {
        Self { most_work, ..self }
    }

    /// True if the limit has been reached.
    pub(crate) fn is_done(&self) -> bool {
        self.work > self.most_work
    }

    /// Returns to an earlier state, but keeps the count of work.
    pub(crate) fn back_to(&mut self, earlier: &Self) {
        *self = Self {
            work: self.work,
            most_work: self.most_work,
            ..earlier.clone()
        };
    }

    /// Changes the effect that matters.
    pub(crate) fn set_effect(&mut self, effect: &DMatrix<f64>) {
        self.effect = scaled(effect, &self.scales);
        self.refresh();
    }

    /// Chooses `count` rows: first greedily one after the other, then by exchange.
    pub fn choose(&mut self, count: usize, measure: Measure) {
        for number in 1..=count.min(self.rows.len()) {
            if let Some((best, _)) = self.best(Measure::Determinant) {
                self.change(best, true);
            }
            if number % FRESH == 0 {
                self.refresh();
            }
        }
        self.refresh();
        self.improve(measure);
    }

    /// Exchanges rows as long as that helps.
    pub(crate) fn improve(&mut self, measure: Measure) {
        for _ in 0..PATIENCE * self.chosen().len() {
            if self.is_done() {
                return;
            }
            let Some((new, gain)) = self.best(measure) else {
                return;
            };
            self.change(new, true);
            let Some((old, loss)) = self.worst(measure) else {
                return;
            };
            self.change(old, false);
            if old == new || gain - loss < WORTH * gain {
                return;
            }
        }
    }

    /// Removes the least informative row, and exchanges the others.
    pub(crate) fn shrink(&mut self, measure: Measure) {
        if let Some((old, _)) = self.worst(measure) {
            self.change(old, false);
            self.improve(measure);
        }
    }

    /// The indices of the chosen rows.
    pub fn chosen(&self) -> Vec<usize> {
        (0..self.rows.len())
            .filter(|i| self.rows[*i].chosen)
            .collect()
    }

    /// The covariance of the first `count` unknowns, in their own units.
    pub fn covariance(&self, count: usize) -> DMatrix<f64> {
        DMatrix::from_fn(count, count, |i, j| {
            self.covariance[(i, j)] / (self.scales[i] * self.scales[j])
        })
    }

    /// The row with the largest gain.
    fn best(&self, measure: Measure) -> Option<(usize, f64)> {
        let gain = |row: &ExchangeRow| {
            let with = Matrix3::identity() + row.variance;
            match measure {
                // By eigenvalues: with little information they are about 1e9 and 1, and a determinant would be
                // rounding.
                Measure::Determinant => {
                    let values = row.variance.symmetric_eigenvalues();
                    values.iter().map(|v| libm::log1p(v.max(0.0))).sum()
                }
                Measure::Effect => match with.try_inverse() {
                    Some(inverse) => inverse.dot(&row.effects()),
                    None => 0.0,
                },
            }
        };
        let free = self.rows.iter().enumerate().filter(|(_, r)| !r.chosen);
        first_of_most(free.map(|(i, row)| (i, gain(row))).collect())
    }

    /// The row with the smallest loss.
    fn worst(&self, measure: Measure) -> Option<(usize, f64)> {
        let loss = |row: &ExchangeRow| {
            let without = Matrix3::identity() - row.variance;
            let Some(factor) = without.cholesky() else {
                return f64::INFINITY;
            };
            match measure {
                Measure::Determinant => -libm::log(without.determinant()),
                Measure::Effect => factor.inverse().dot(&row.effects()),
            }
        };
        let chosen = self.rows.iter().enumerate().filter(|(_, r)| r.chosen);
        let losses = chosen.map(|(i, row)| (i, -loss(row)));
        first_of_most(losses.collect()).map(|(i, loss)| (i, -loss))
    }

    /// Adds or removes a row (Woodbury).
    fn change(&mut self, number: usize, add: bool) {
        self.work += (self.rows.len() * (self.scales.len() + self.effect.nrows())) as u64;
        let row = &mut self.rows[number];
        row.chosen = add;
        let w = &self.covariance * &row.equations;
        let sign = if add { 1.0 } else { -1.0 };
        let inner = Matrix3::identity() * sign + row.variance;
        let Some(inner) = inner.try_inverse() else {
            return;
        };
        let ws = &w * inner;
        self.covariance -= &ws * w.transpose();
        let effect = &self.effect * &ws;
        let changes = parallel::map(&self.rows, |row| {
            let with: Matrix3<f64> = row.equations.tr_mul(&w).fixed_view::<3, 3>(0, 0).into();
            (with * inner * with.transpose(), &effect * with.transpose())
        });
        for (row, (variance, effect)) in self.rows.iter_mut().zip(changes) {
            row.variance -= variance;
            row.effect -= effect;
        }
    }

    /// Recomputes everything from the chosen rows, because rounding accumulates.
    fn refresh(&mut self) {
        let mut information = self.known.clone();
        for row in self.rows.iter().filter(|r| r.chosen) {
            information += &row.equations * row.equations.transpose();
        }
        let Some(factor) = information.cholesky() else {
            return;
        };
        self.covariance = factor.inverse();
        let effect = &self.effect * &self.covariance;
        let covariance = &self.covariance;
        let values = parallel::map(&self.rows, |row| {
            let w = covariance * &row.equations;
            let variance = row.equations.tr_mul(&w).fixed_view::<3, 3>(0, 0).into();
            (variance, &effect * &row.equations)
        });
        for (row, (variance, effect)) in self.rows.iter_mut().zip(values) {
            row.variance = variance;
            row.effect = effect;
        }
    }
}

/// Values that differ by less than this fraction are equal: by symmetry many are, and rounding must not decide.
const ALIKE: f64 = 1e-9;

/// The first of those with the largest value.
fn first_of_most(values: Vec<(usize, f64)>) -> Option<(usize, f64)> {
    let most = values.iter().map(|(_, v)| *v).max_by(f64::total_cmp)?;
    let least = most - ALIKE * most.abs();
    values.into_iter().find(|(_, v)| *v >= least)
}

/// A matrix with its columns divided by the scales of the unknowns.
fn scaled(matrix: &DMatrix<f64>, scales: &[f64]) -> DMatrix<f64> {
    let mut matrix = matrix.clone();
    for (mut column, scale) in matrix.column_iter_mut().zip(scales) {
        column /= *scale;
    }
    matrix
}

impl ExchangeRow {
    fn effects(&self) -> Matrix3<f64> {
        let square = self.effect.tr_mul(&self.effect);
        square.fixed_view::<3, 3>(0, 0).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve rows without any pattern for four unknowns.
    fn rows() -> Vec<DMatrix<f64>> {
        (0..12)
            .map(|k| {
                DMatrix::from_fn(3, 4, |i, j| {
                    libm::sin(((7 * k + 3 * i + 1) * (j + 2)) as f64)
                })
            })
            .collect()
    }

    fn information(rows: &[DMatrix<f64>], chosen: &[usize]) -> DMatrix<f64> {
        chosen.iter().fold(DMatrix::zeros(4, 4), |sum, i| {
            sum + rows[*i].tr_mul(&rows[*i])
        })
    }

    fn exchange(rows: &[DMatrix<f64>]) -> RowExchange {
        let effect = DMatrix::from_fn(2, 4, |i, j| libm::cos((3 * i + j) as f64));
        RowExchange::new(rows, &DMatrix::zeros(0, 4), &effect)
    }

    #[test]
    fn the_covariance_is_that_of_what_is_chosen() {
        let rows = rows();
        let mut exchange = exchange(&rows);
        exchange.choose(5, Measure::Effect);
        exchange.shrink(Measure::Determinant);
        let chosen = exchange.chosen();
        assert_eq!(chosen.len(), 4);
        let exact = information(&rows, &chosen).try_inverse().unwrap();
        // The initial information is 1e-9 of that of a row; removing rows loses digits.
        assert!((exchange.covariance(4) - exact).amax() < 1e-6);
    }

    #[test]
    fn exchanges_end_when_they_have_done_their_work_and_choices_are_made_all_the_same() {
        let rows = rows();
        let mut exchange = exchange(&rows).limited_to(0);
        exchange.choose(5, Measure::Effect);
        assert!(exchange.is_done() && exchange.chosen().len() == 5);
        let chosen = exchange.chosen();
        exchange.improve(Measure::Effect);
        assert_eq!(exchange.chosen(), chosen);
        let done = exchange.work;
        let earlier = self::exchange(&rows);
        exchange.back_to(&earlier);
        assert_eq!((exchange.work, exchange.chosen().len()), (done, 0));
    }

    #[test]
    fn the_row_that_would_tell_most_is_no_better_in_the_place_of_any() {
        let rows = rows();
        for measure in [Measure::Determinant, Measure::Effect] {
            let mut exchange = exchange(&rows);
            exchange.choose(4, measure);
            let effect = DMatrix::from_fn(2, 4, |i, j| libm::cos((3 * i + j) as f64));
            let badness = |chosen: &[usize]| {
                let information = information(&rows, chosen);
                match measure {
                    Measure::Determinant => -libm::log(information.determinant()),
                    Measure::Effect => {
                        let inverse = information.try_inverse().unwrap();
                        (&effect * inverse * effect.transpose()).trace()
                    }
                }
            };
            let chosen = exchange.chosen();
            assert_eq!(chosen.len(), 4);
            let best = badness(&chosen);
            let (new, _) = exchange.best(measure).unwrap();
            for place in 0..chosen.len() {
                let mut with = chosen.clone();
                with[place] = new;
                // Gains below 1e-6 are left.
                let other = badness(&with);
                assert!(
                    other > best - 1e-5 * best.abs(),
                    "{measure:?}: {other} {best}"
                );
            }
            // Better than most choices of four consecutive rows.
            let worse = (0..9).filter(|i| badness(&[*i, i + 1, i + 2, i + 3]) > best);
            assert!(worse.count() >= 7);
        }
    }
}
