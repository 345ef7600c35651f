//! What error motions that the model lacks may do, to the parameters and over the travel.
//!
//! They are no noise: a straightness error is the same wherever its axis is at the same position, and it moves the parameters
//! that resemble it. So each motion that the model lacks counts as a random one, which moves the tip by τ (root mean square
//! over the travel). With N, the derivatives of the equations by these motions, the equations have the covariance
//! σ²·I + τ²·N·Nᵀ, and the parameters that of τ·A·N besides their own, where A takes equations to parameters.
//!
//! The residuals tell τ: a fit leaves (I − J·A)·N of the motions. With σ integrated out under its usual prior 1/σ, the
//! residuals have a likelihood for each τ; with every τ as likely beforehand, that gives the largest one with a probability of
//! 95 %. With few rows it is large, even if nothing speaks for such motions.

use crate::candidates::{RotationForm, candidates};
use crate::elsewhere::over_travel;
use crate::identified::Solution;
use crate::{Identified, Problem, Unknown};
use nalgebra::{DMatrix, DVector, DVectorView};
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter, ParameterKind};

/// Degree and harmonic up to which motions are considered: waves of one and a half periods over the travel.
const DEGREE: u8 = 3;
/// The probability with which τ is not larger.
const PROBABILITY: f64 = 0.95;
/// Largest τ that is considered, in standard deviations of a coordinate of a row, and the number of steps to it. More would
/// be rows that fit nothing.
const LARGEST: f64 = 30.0;
const STEPS: usize = 300;
/// A motion that moves the tip by less than this part of what another one of its axis does moves it by rounding.
const ROUNDING: f64 = 1e-9;

/// Error motions that the model lacks, as large as they may be with a probability of 95 %.
#[derive(Clone, Debug)]
pub struct Unmodelled {
    /// The covariance that they add to that of the parameters.
    pub covariance: Covariance,
    /// Standard deviation (mm) of a coordinate of the tip over the travel by all of them.
    pub tip: f64,
}

impl Unmodelled {
    /// Errors that are as uncertain as these motions make them, over the whole travel.
    #[must_use]
    pub fn added_to(&self, errors: &ErrorModel) -> ErrorModel {
        let mut known = errors.covariance();
        let place = |p: &Parameter| known.parameters.iter().position(|known| known == p);
        let places: Vec<_> = self.covariance.parameters.iter().map(place).collect();
        for (i, row) in places.iter().enumerate() {
            for (j, column) in places.iter().enumerate() {
                if let (Some(row), Some(column)) = (row, column) {
                    known.matrix[(*row, *column)] += self.covariance.matrix[(i, j)];
                }
            }
        }
        let mut errors = errors.clone();
        errors.correlated = Some(known);
        errors.misfit = Some(errors.misfit.unwrap_or(0.0).max(self.tip));
        errors
    }
}

impl Problem<'_> {
    /// The error motions that the model of an identification lacks; `None` if its equations leave no freedom to tell, or
    /// are not finite.
    #[must_use]
    pub fn unmodelled(&self, identified: &Identified) -> Option<Unmodelled> {
        let Solution {
            estimate,
            weights,
            factor,
        } = &identified.place;
        let known = factor.unknowns().iter().map(|i| self.unknowns[*i]);
        let motions = self.lacking_motions(&known.collect::<Vec<_>>());
        let mut columns = self.derivatives(&motions, estimate, weights);
        let sizes = self.sizes(&motions, &over_travel(self, estimate, &motions));
        for (mut column, size) in columns.column_iter_mut().zip(&sizes) {
            match *size {
                0.0 => column.fill(0.0),
                size => column /= size,
            }
        }
        let moving = sizes.iter().filter(|size| **size > 0.0).count();
        let jacobian = self.jacobian(estimate, weights);
        let by = factor.absorbed(&jacobian, columns.column_iter())?;
        let left = columns + jacobian.select_columns(factor.unknowns()) * &by;
        let residuals = self.residuals(estimate, weights);
        let freedom = self.equations().checked_sub(factor.unknowns().len())?;
        let seen = SeenMotions::new(left, &residuals, freedom)?;
        let unit = weights.rows.len() as f64 / weights.rows.iter().sum::<f64>();
        let square = seen.largest(LARGEST * unit);
        let by = by.rows(0, identified.parameters.len());
        let parameters = identified.parameters.iter().map(|one| one.parameter);
        Some(Unmodelled {
            covariance: Covariance {
                parameters: parameters.collect(),
                matrix: by * by.transpose() * square,
            },
            tip: (square * moving as f64 / 3.0).sqrt(),
        })
    }

    /// How far the tip is moved by each motion (mm, root mean square), given what they do at positions in the travel; 0 if only
    /// by rounding, beside the other motions of the same axis and degree, some of which move it in any case.
    fn sizes(&self, motions: &[Unknown], tips: &DMatrix<f64>) -> Vec<f64> {
        let positions = tips.nrows() as f64 / 3.0;
        let size = |tip: DVectorView<'_, f64>| (tip.norm_squared() / positions).sqrt();
        let sizes: Vec<f64> = tips.column_iter().map(size).collect();
        let of = |unknown: &Unknown| unknown.parameter().map(|(p, _)| (p.axis, p.kind));
        let alike = |own: &Unknown| {
            let all = motions.iter().zip(&sizes);
            let alike = all.filter(|(other, _)| of(other) == of(own));
            alike.map(|(_, size)| *size).fold(0.0, f64::max)
        };
        let each = motions.iter().zip(&sizes);
        each.map(|(own, size)| {
            if *size > ROUNDING * alike(own) {
                *size
            } else {
                0.0
            }
        })
        .collect()
    }

    /// The error motions and the backlash that a machine can have besides these unknowns.
    fn lacking_motions(&self, known: &[Unknown]) -> Vec<Unknown> {
        let machine = self.machine;
        let all_axes = vec![true; machine.axes.len()];
        let all = candidates(machine, DEGREE, RotationForm::Harmonics, &all_axes).into_iter();
        let is_motion = |kind| kind != ParameterKind::Inter;
        all.filter(|p| is_motion(p.kind) && !self.base.is_tabulated(machine, p))
            .map(Unknown::Parameter)
            .filter(|unknown| !known.contains(unknown))
            .collect()
    }
}

/// What residuals have of motions.
struct SeenMotions {
    /// Squares of the singular values of what a fit leaves of the motions.
    values: Vec<f64>,
    /// The square of the residuals along each of their directions.
    along: Vec<f64>,
    /// The square of the rest.
    rest: f64,
    freedom: f64,
}

impl SeenMotions {
    /// For what a fit leaves of motions (equations × motions), and its residuals.
    fn new(left: DMatrix<f64>, residuals: &DVector<f64>, freedom: usize) -> Option<Self> {
        // A variance has a mean from three degrees of freedom on.
        if freedom < 3 || left.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let svd = left.svd(true, false);
        let along: Vec<f64> = (svd.u?.tr_mul(residuals).iter()).map(|v| v * v).collect();
        Some(Self {
            values: svd.singular_values.iter().map(|v| v * v).collect(),
            rest: (residuals.norm_squared() - along.iter().sum::<f64>()).max(0.0),
            along,
            freedom: freedom as f64,
        })
    }

    /// For τ = γ·σ: the logarithm of the likelihood, and the mean of σ².
    fn likelihood(&self, gamma: f64) -> (f64, f64) {
        let scale = |value: &f64| 1.0 + gamma * gamma * value;
        let along = self.along.iter().zip(&self.values);
        let sum = self.rest + along.map(|(part, value)| part / scale(value)).sum::<f64>();
        let sum = sum.max(f64::MIN_POSITIVE);
        let determinant: f64 = self
            .values
            .iter()
            .map(|value| libm::log(scale(value)))
            .sum();
        (
            -0.5 * (determinant + self.freedom * libm::log(sum)),
            sum / (self.freedom - 2.0),
        )
    }

    /// The square of the largest τ with [`PROBABILITY`], up to a `limit` in units of σ.
    fn largest(&self, limit: f64) -> f64 {
        // Steps that grow, as τ is small where it counts: each has a share of all τ that is proportional to its number.
        let tried: Vec<(f64, f64, f64)> = (0..=STEPS)
            .map(|k| {
                let part = k as f64 / STEPS as f64;
                let gamma = limit * part * part;
                let (log, variance) = self.likelihood(gamma);
                (part, log, gamma * gamma * variance)
            })
            .collect();
        let best = tried.iter().map(|(_, log, _)| *log);
        let best = best.fold(f64::NEG_INFINITY, f64::max);
        let shares = tried
            .iter()
            .map(|(part, log, _)| part * libm::exp(log - best));
        let whole: f64 = shares.clone().sum();
        let mut sum = 0.0;
        let within = shares.take_while(|share| {
            sum += share;
            sum < PROBABILITY * whole
        });
        tried[within.count().min(STEPS)].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Equations × unknowns, and equations × motions.
    fn matrices() -> [DMatrix<f64>; 2] {
        let wave = |i: usize, k: usize| libm::sin((i * (k + 1)) as f64 * 0.37 + k as f64);
        [
            DMatrix::from_fn(40, 4, wave),
            DMatrix::from_fn(40, 6, |i, k| wave(i, k + 7) + 0.3 * wave(i, k % 4)),
        ]
    }

    /// An orthonormal basis of what a fit leaves.
    fn left_basis(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let whole = DMatrix::from_fn(40, 44, |i, k| match k {
            0..4 => jacobian[(i, k)],
            _ => f64::from(u8::from(i == k - 4)),
        });
        whole.qr().q().columns(4, 36).into_owned()
    }

    #[test]
    fn the_likelihood_is_that_of_normally_distributed_residuals() {
        let [jacobian, motions] = matrices();
        let basis = left_basis(&jacobian);
        let residuals = &basis * DVector::from_fn(36, |i, _| libm::cos(1.7 * i as f64));
        let left = &basis * basis.tr_mul(&motions);
        let seen = SeenMotions::new(left, &residuals, 36).unwrap();
        let of = |gamma: f64| {
            let seen = basis.tr_mul(&motions) * gamma;
            let covariance = DMatrix::identity(36, 36) + &seen * seen.transpose();
            let own = basis.tr_mul(&residuals);
            let sum = own.dot(&covariance.clone().cholesky().unwrap().solve(&own));
            // σ integrated out of (2πσ²)^(−18) · exp(−sum/2σ²) / σ: proportional to sum^(−18).
            -0.5 * libm::log(covariance.determinant()) - 18.0 * libm::log(sum)
        };
        for gamma in [0.1, 1.0, 7.0] {
            let apart = seen.likelihood(gamma).0 - seen.likelihood(0.0).0 - (of(gamma) - of(0.0));
            assert!(apart.abs() < 1e-10, "{gamma}: {apart}");
        }
    }

    #[test]
    fn the_largest_motions_are_larger_than_the_real_ones_in_nineteen_of_twenty_cases() {
        let [jacobian, motions] = matrices();
        let basis = left_basis(&jacobian);
        let left = &basis * basis.tr_mul(&motions);
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
        // As many of every size, which is what is assumed beforehand.
        let cases = 2000;
        let larger = (0..cases).filter(|case| {
            let tau = 3.0 * (*case as f64 + 0.5) / cases as f64;
            let noise = DVector::from_fn(40, |_, _| normal());
            let of_motions = &motions * DVector::from_fn(6, |_, _| tau * normal());
            let residuals = &basis * basis.tr_mul(&(noise + of_motions));
            let seen = SeenMotions::new(left.clone(), &residuals, 36).unwrap();
            seen.largest(30.0) > tau * tau
        });
        let part = larger.count() as f64 / cases as f64;
        // Three standard deviations of 2000 cases are 0.015; sizes end at 3 here.
        assert!((0.935..0.985).contains(&part), "{part}");
    }

    #[test]
    fn without_freedom_nothing_is_told() {
        let [_, motions] = matrices();
        let residuals = DVector::zeros(40);
        assert!(SeenMotions::new(motions.clone(), &residuals, 2).is_none());
        let seen = SeenMotions::new(motions, &residuals, 36).unwrap();
        assert!(seen.largest(30.0).is_finite());
    }
}
