//! Least squares fit of the kinematic correction over a grid of commands.

use super::lattice::Lattice;
use nalgebra::{DMatrix, DVector};
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, NotConverged};
use trueaxis_model::machine::{MAX_AXES, PerAxis};

/// Corrections are sampled to this (mm, rad): a hundredth of the resolution of f32 tables.
pub(super) const SAMPLED: f64 = 1e-9;
/// Combinations of functions with less than this fraction of the largest eigenvalue are not determined: rounding of
/// sums of squares.
const SEEN: f64 = 1e-13;

/// Sums of products of functions of the command, with each other and with the correction of each axis.
pub struct Moments {
    /// Σ φφᵀ.
    pub gram: DMatrix<f64>,
    /// Σ φ·Δqᵀ.
    pub with: DMatrix<f64>,
    /// Σ Δq².
    pub squares: PerAxis,
}

impl Moments {
    /// Sums over a grid. `functions` writes `count` functions of the command (mm, rad) into its slice. The tool is
    /// the machine's own, directions of travel are unknown and temperatures are the reference.
    pub fn over(
        kinematics: &Kinematics<'_>,
        lattice: &Lattice,
        count: usize,
        functions: impl Fn(&PerAxis, &mut [f64]) + Sync,
    ) -> Result<Self, NotConverged> {
        let nothing = || Self {
            gram: DMatrix::zeros(count, count),
            with: DMatrix::zeros(count, MAX_AXES),
            squares: PerAxis::default(),
        };
        let situation = Situation::default();
        let add = |sum: &mut Self, q: &PerAxis| {
            let correction =
                kinematics.correction_within(q, &situation, &Switches::ALL, SAMPLED)?;
            let mut phi = DVector::zeros(count);
            functions(q, phi.as_mut_slice());
            sum.gram.syger(1.0, &phi, &phi, 1.0);
            for (i, d) in correction.dq.into_iter().enumerate() {
                sum.with.column_mut(i).axpy(d, &phi, 1.0);
                sum.squares[i] += d * d;
            }
            Ok(())
        };
        let mut total = lattice.sum(nothing, add, |total, sum| {
            total.gram += sum.gram;
            total.with += sum.with;
            for (total, sum) in total.squares.iter_mut().zip(sum.squares) {
                *total += sum;
            }
        })?;
        total.gram.fill_upper_triangle_with_lower_triangle();
        Ok(total)
    }

    /// The weights of the chosen functions that best fit the correction of an axis.
    pub fn fit(&self, chosen: &[usize], axis: usize) -> DVector<f64> {
        let gram = self.gram.select_rows(chosen).select_columns(chosen);
        let with = DVector::from_fn(chosen.len(), |k, _| self.with[(chosen[k], axis)]);
        solve(&gram, &with)
    }

    /// The residual sum of squares with these weights.
    pub fn left(&self, chosen: &[usize], axis: usize) -> f64 {
        let weights = self.fit(chosen, axis);
        let with = chosen.iter().map(|k| self.with[(*k, axis)]);
        let explained: f64 = with.zip(weights.iter()).map(|(w, x)| w * x).sum();
        (self.squares[axis] - explained).max(0.0)
    }
}

/// The minimum-norm solution of symmetric equations that may be dependent: a pseudo-inverse, with unknowns scaled so
/// that the diagonal is 1.
pub fn solve(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let scale = matrix.diagonal().map(|d| match d > 0.0 {
        true => 1.0 / d.sqrt(),
        false => 0.0,
    });
    let diagonal = DMatrix::from_diagonal(&scale);
    let weighed = &diagonal * matrix * &diagonal;
    let eigen = weighed.symmetric_eigen();
    let least = SEEN * eigen.eigenvalues.amax();
    let mut image = eigen.eigenvectors.tr_mul(&right.component_mul(&scale));
    for (value, eigenvalue) in image.iter_mut().zip(eigen.eigenvalues.iter()) {
        *value = match *eigenvalue > least {
            true => *value / eigenvalue,
            false => 0.0,
        };
    }
    (&eigen.eigenvectors * image).component_mul(&scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_functions_share_what_one_of_them_would_get() {
        let gram = DMatrix::from_row_slice(3, 3, &[4.0, 4.0, 0.0, 4.0, 4.0, 0.0, 0.0, 0.0, 9.0]);
        let found = solve(&gram, &DVector::from_row_slice(&[8.0, 8.0, 27.0]));
        assert!((found - DVector::from_row_slice(&[1.0, 1.0, 3.0])).amax() < 1e-12);
    }
}
