//! Fits the remaining volumetric error: the extended Jacobian of Eqs. 28–30.

use super::Basis;
use crate::schemes::lattice::Lattice;
use crate::schemes::moments::solve;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::convert::Infallible;
use trueaxis_model::errors::Situation;
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{MAX_AXES, PerAxis};

/// Largest number of steps of the fit; each reduces the error by a factor of the relative size of the errors.
const STEPS: usize = 10;
/// The fit ends when no table changes by more than this (mm, rad).
const STEP: f64 = 1e-9;

/// Coefficients (functions × outputs) that minimize the volumetric error: for rotation what the policy requires, and
/// with its damping also the rotary corrections.
pub(crate) fn of_error(
    kinematics: &Kinematics<'_>,
    lattice: &Lattice,
    basis: &Basis,
) -> DMatrix<f64> {
    let machine = kinematics.machine;
    let (functions, outputs) = (basis.count(), machine.axes.len());
    let weights = Weights::new(kinematics);
    let situation = Situation::default();
    // Unknowns: output slowest. The control Jacobian is taken at the commands, so it is the same in every step.
    let join = |total: &mut Sums, sum: Sums| {
        total.normal += sum.normal;
        total.right += sum.right;
    };
    let nothing = |unknowns: usize| Sums {
        normal: DMatrix::zeros(unknowns, unknowns),
        right: DVector::zeros(functions * outputs),
    };
    let add_normal = |sum: &mut Sums, q: &PerAxis| {
        let mut phi = DVector::zeros(functions);
        basis.values(q, phi.as_mut_slice());
        let square = &phi * phi.transpose();
        let gram = weights.gram(&weights.jacobian(kinematics, q));
        for i in 0..outputs {
            for j in 0..=i {
                if gram[(i, j)] != 0.0 {
                    let mut block = (sum.normal)
                        .view_mut((i * functions, j * functions), (functions, functions));
                    block += &square * gram[(i, j)];
                }
            }
        }
        Ok::<(), Infallible>(())
    };
    let size = functions * outputs;
    let Ok(mut sums) = lattice.sum(|| nothing(size), add_normal, join);
    sums.normal.fill_upper_triangle_with_lower_triangle();
    let mut found: DMatrix<f64> = DMatrix::zeros(functions, outputs);
    for _ in 0..STEPS {
        let add_right = |sum: &mut Sums, q: &PerAxis| {
            let mut phi = DVector::zeros(functions);
            basis.values(q, phi.as_mut_slice());
            let mut dq = PerAxis::default();
            for (d, own) in dq.iter_mut().zip(found.column_iter()) {
                *d = own.dot(&phi);
            }
            let error = kinematics.volumetric_error(q, &dq, &situation).to_array();
            let right = weights.right(&weights.jacobian(kinematics, q), &error, &dq);
            for i in 0..outputs {
                let mut part = sum.right.rows_mut(i * functions, functions);
                part.axpy(-right[i], &phi, 1.0);
            }
            Ok::<(), Infallible>(())
        };
        let Ok(residual) = lattice.sum(|| nothing(0), add_right, join);
        let step = solve(&sums.normal, &residual.right);
        let step = DMatrix::from_column_slice(functions, outputs, step.as_slice());
        found += &step;
        // No function exceeds 1.
        if step.amax() < STEP / functions as f64 {
            break;
        }
    }
    found
}

struct Sums {
    normal: DMatrix<f64>,
    right: DVector<f64>,
}

type Columns = SMatrix<f64, 6, MAX_AXES>;

/// Weights of the remaining error.
struct Weights {
    /// Of the six rows of a twist.
    rows: SVector<f64, 6>,
    /// λ² of the rotary axes.
    damping: PerAxis,
    /// Outputs that remain 0.
    stays: [bool; MAX_AXES],
    axes: usize,
}

impl Weights {
    fn new(kinematics: &Kinematics<'_>) -> Self {
        let machine = kinematics.machine;
        let mut weights = Self {
            rows: SVector::repeat(1.0),
            damping: PerAxis::default(),
            stays: [false; MAX_AXES],
            axes: machine.axes.len(),
        };
        let rotary = |i: &usize| machine.axes[*i].letter.is_rotary();
        for i in (0..machine.axes.len()).filter(rotary) {
            match kinematics.policy {
                Policy::Direction { damping } => {
                    weights.rows[3 + machine.tool_axis] = 0.0;
                    weights.damping[i] = damping * damping;
                }
                Policy::Orientation => {}
                Policy::Position => weights.stays[i] = true,
            }
        }
        weights
    }

    /// The control Jacobian at a command, without the outputs that remain 0.
    fn jacobian(&self, kinematics: &Kinematics<'_>, q: &PerAxis) -> Columns {
        let jacobian = kinematics.jacobian(q, None);
        let mut columns = Columns::zeros();
        for i in (0..self.axes).filter(|i| !self.stays[*i]) {
            columns.set_column(i, &SVector::from(jacobian.column(i)));
        }
        columns
    }

    /// Jᵀ·W·J + λ².
    fn gram(&self, jacobian: &Columns) -> SMatrix<f64, MAX_AXES, MAX_AXES> {
        let mut weighed = *jacobian;
        for mut column in weighed.column_iter_mut() {
            column.component_mul_assign(&self.rows);
        }
        let mut gram = jacobian.transpose() * weighed;
        for (i, damping) in self.damping.into_iter().enumerate() {
            gram[(i, i)] += damping;
        }
        gram
    }

    /// Jᵀ·W·E + λ²·Δ.
    fn right(&self, jacobian: &Columns, error: &[f64; 6], dq: &PerAxis) -> SVector<f64, MAX_AXES> {
        let counted = SVector::from(*error).component_mul(&self.rows);
        jacobian.transpose() * counted
            + SVector::from(self.damping).component_mul(&SVector::from(*dq))
    }
}
