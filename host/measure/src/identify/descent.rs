//! Steps from an estimate to a better one.

use super::IdentifyError;
use super::factor::Factor;
use super::rows::{Estimate, Problem, Weights};
use super::unidentifiable::seen;
use nalgebra::{DMatrix, DVector};

/// Largest change of any residual (mm) by the last step: three orders below the 0.001 µm that are asked for,
/// two above the rounding of positions of 1 m.
const STEP: f64 = 1e-9;
/// Steps with one Jacobian: each gains the relative size of the errors, 1e-2 or better, less where parameters
/// are hardly told apart. A step must be this part of the last one, or it takes another Jacobian; if it makes
/// things worse, half of it is tried, and so on.
const STEPS: usize = 20;
const SHRINKS: f64 = 0.5;
const HALVINGS: usize = 20;
/// Nor do steps count that make the sum of squares less by so small a part: of a thousand rows, they move no
/// parameter by more than a twentieth of its uncertainty.
pub(super) const STILL: f64 = 1e-6;
/// Singular values that are no more than rounding: of columns of length 1, and positions with nine digits.
const ROUNDING: f64 = 1e-10;

/// Fits balls and stylus to the nominal machine: what is left is what its errors do.
pub(super) fn setup_alone(
    problem: &Problem<'_>,
    weights: &Weights,
) -> Result<Estimate, IdentifyError> {
    let problem = &problem.of_setup();
    let mut estimate = problem.start();
    let jacobian = problem.jacobian(&estimate, weights);
    let all = (0..problem.unknowns.len()).collect();
    let factor = Factor::new(&jacobian, all, &problem.alone()).ok_or(IdentifyError::NotFinite)?;
    let factor = seen(
        (&problem.unknowns, problem.spindle),
        factor,
        Vec::new(),
        ROUNDING,
    )
    .0;
    descend(problem, &mut estimate, &jacobian, &factor, weights);
    Ok(estimate)
}

/// Steps with one Jacobian until nothing moves any more; false if that takes another one.
pub(super) fn descend(
    problem: &Problem<'_>,
    estimate: &mut Estimate,
    jacobian: &DMatrix<f64>,
    factor: &Factor,
    weights: &Weights,
) -> bool {
    let mut residuals = problem.residuals(estimate, weights);
    let start = residuals.norm_squared();
    let is_still = |residuals: &DVector<f64>| start - residuals.norm_squared() < STILL * start;
    let mut last = f64::INFINITY;
    for _ in 0..STEPS {
        let Some(mut step) = factor.step(&jacobian.tr_mul(&residuals)) else {
            return false;
        };
        let change = jacobian * &step;
        let moved = weights.rows.iter().enumerate();
        let moved = moved.map(|(i, w)| change.fixed_rows::<3>(3 * i).norm() / w);
        let most = moved.fold(0.0, f64::max);
        if most > SHRINKS * last {
            return is_still(&residuals);
        }
        // Far away the derivatives at the nominal machine may lead too far.
        let before = residuals.norm_squared();
        let next = (0..HALVINGS).find_map(|_| {
            let next = problem.moved(estimate, &step);
            let residuals = problem.residuals(&next, weights);
            let is_no_worse = residuals.norm_squared() <= before * (1.0 + STILL);
            step *= 0.5;
            is_no_worse.then_some((next, residuals))
        });
        let Some(next) = next else {
            return is_still(&residuals);
        };
        (*estimate, residuals) = next;
        if most < STEP {
            return true;
        }
        last = most;
    }
    is_still(&residuals)
}
