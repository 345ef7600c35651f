//! Steps from an estimate to a better one.

use crate::IdentifyError;
use crate::estimate::Estimate;
use crate::factor::ScaledFactor;
use crate::rows::{EquationWeights, Problem};
use crate::unidentifiable::seen;
use nalgebra::{DMatrix, DVector};

/// Iteration ends when no residual changes by more than this (mm) in a step: three orders below the required 0.001
/// µm, two above the rounding of positions of 1 m.
const STEP: f64 = 1e-9;
/// Steps with one Jacobian. Each reduces the error by a factor of the relative size of the errors, 1e-2 or better,
/// or less if parameters are hardly separable. A step must be smaller than this fraction of the last one, or a new
/// Jacobian is needed. If a step increases the residual, half of it is tried, and so on.
const STEPS: usize = 20;
const SHRINKS: f64 = 0.5;
const HALVINGS: usize = 20;
/// Steps that reduce the sum of squares by less than this fraction are ignored, too: with a thousand rows, they move
/// no parameter by more than a twentieth of its uncertainty.
pub(crate) const STILL: f64 = 1e-6;
/// Singular values below this are rounding: columns have length 1, and positions nine digits.
const ROUNDING: f64 = 1e-10;

/// Fits balls and stylus to the nominal machine; the residuals are the effect of its errors.
pub(crate) fn setup_alone(
    problem: &Problem<'_>,
    weights: &EquationWeights,
) -> Result<Estimate, IdentifyError> {
    let problem = &problem.of_setup();
    let mut estimate = problem.start();
    let jacobian = problem.jacobian(&estimate, weights);
    let all = (0..problem.unknowns.len()).collect();
    let factor =
        ScaledFactor::new(&jacobian, all, &problem.alone()).ok_or(IdentifyError::NotFinite)?;
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

/// Takes steps with one Jacobian until they converge; false if a new Jacobian is needed.
pub(crate) fn descend(
    problem: &Problem<'_>,
    estimate: &mut Estimate,
    jacobian: &DMatrix<f64>,
    factor: &ScaledFactor,
    weights: &EquationWeights,
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
        let moved = problem.blocks().zip(&weights.rows);
        let moved = moved.map(|(block, w)| change.rows_range(block).norm() / w);
        let most = moved.fold(0.0, f64::max);
        if most > SHRINKS * last {
            return is_still(&residuals);
        }
        // Far from the solution, the derivatives of the nominal machine may overshoot.
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
