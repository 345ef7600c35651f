//! The kinematic correction: the value to add to the command so that the block equations hold.

use crate::{Kinematics, PerAxis, Situation, Switches};
use core::fmt;

/// A kinematic correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// Correction to add to the command (mm, rad).
    pub dq: PerAxis,
    /// Number of evaluations of the exact model.
    pub iterations: u32,
}

/// The iteration did not converge: the errors are much too large at this position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotConverged {
    /// The last step (mm or rad).
    pub step: f64,
    /// Number of iterations.
    pub iterations: u32,
}

impl fmt::Display for NotConverged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the kinematic correction does not converge here: a step of {:.1e} mm or rad remains after {} iterations",
            self.step, self.iterations
        )
    }
}

impl core::error::Error for NotConverged {}

/// The iteration ends when no axis moves by more than this (mm or rad): three orders of magnitude below the required
/// 1e-9 mm, and a factor of ten above the rounding of positions of 1 m in f64 (1e-13 mm).
const STEP: f64 = 1e-12;
/// Each iteration reduces the error by the relative size of the machine errors (1e-3 or better), but by less where the
/// axes are nearly dependent or where the damping is hardly larger than the errors (rad).
const ITERATIONS: u32 = 50;

impl<P: AsRef<[f64]>> Kinematics<'_, P> {
    /// The kinematic correction at a command `q` (mm, rad), with the error motions enabled in `switches`. The twist of
    /// nominal(q)⁻¹ · actual(q + Δq) has no translation, and its rotation r satisfies the policy. With the rotary
    /// columns Jr of the control Jacobian at `q`: Jrᵀ·P·r + λ²·Δ = 0 for the direction, Jrᵀ·r = 0 for the orientation.
    ///
    /// # Errors
    /// [`NotConverged`] if the errors are so large that the iteration fails.
    pub fn correction(
        &self,
        q: &PerAxis,
        situation: &Situation,
        switches: &Switches,
    ) -> Result<Correction, NotConverged> {
        self.correction_within(q, situation, switches, STEP)
    }

    /// Like [`Self::correction`], but stops when no axis moves by more than `limit` (mm or rad). The remaining error is
    /// smaller than that by the relative size of the machine errors.
    ///
    /// # Errors
    /// [`NotConverged`] if the errors are so large that the iteration fails.
    pub fn correction_within(
        &self,
        q: &PerAxis,
        situation: &Situation,
        switches: &Switches,
        limit: f64,
    ) -> Result<Correction, NotConverged> {
        let failed = |step, iterations| NotConverged { step, iterations };
        let (nominal, jacobian) = self.nominal.pose_and_jacobian(q, situation.length);
        let solver = jacobian
            .solver(self.policy)
            .ok_or_else(|| failed(f64::INFINITY, 0))?;
        let to_nominal = nominal.inverse();
        let mut dq = PerAxis::default();
        let mut last = f64::INFINITY;
        for iteration in 1..=ITERATIONS {
            let corrected = core::array::from_fn(|i| q[i] + dq[i]);
            let error = (to_nominal * self.actual(&corrected, situation, switches)).twist();
            let step = solver.step(&error, &dq);
            let mut size = 0.0_f64;
            for (d, s) in dq.iter_mut().zip(step) {
                *d += s;
                size = size.max(s.abs());
            }
            // Converged, or limited by rounding, where steps no longer shrink.
            if size < limit || (size < 1e3 * STEP && size >= 0.5 * last) {
                return Ok(Correction {
                    dq,
                    iterations: iteration,
                });
            }
            if !size.is_finite() {
                return Err(failed(size, iteration));
            }
            last = size;
        }
        Err(failed(last, ITERATIONS))
    }
}
