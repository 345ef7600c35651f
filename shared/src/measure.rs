//! Measurement mode: from measured to true positions.

use crate::compensation::Compensation;
use crate::handle::Handle;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::room::Room;
use crate::weights::Weights;

impl<C: Room> Compensation<'_, C> {
    /// The correction Δq at the true position q that belongs to the measured one, to be *subtracted* from it: q =
    /// measured − Δq(q).
    ///
    /// In machining mode the axes are at q + Δq(q) when the tool should be at q. A touch probe or a readout of the
    /// scales gives the former; this function recovers q by fixed-point iteration in `steps` evaluations (at least 1):
    /// Δq₁ = Δq(measured), Δqₖ₊₁ = Δq(measured − Δqₖ). The auxiliaries of `measured` are used unchanged.
    ///
    /// # Convergence
    /// With L the largest slope of the correction, max over axes i of Σⱼ |∂Δqᵢ/∂qⱼ|, the error after k evaluations is
    /// at most Lᵏ · max|Δq|. L is 1e-3 on a bad machine (1 mm per m; but 1 mm per degree is already 1!), so that 3
    /// evaluations leave 1e-9 of the correction, below the resolution of f32. The iteration does not converge where L ≥
    /// 1, that is, where tables jump.
    ///
    /// Directional tables use `travel`, the directions of the commands before the measurement.
    #[must_use]
    pub fn measured(
        &self,
        measured: &Inputs<C::Axes<f32>>,
        travel: &Travelling<C::Axes<Travel>>,
        weights: &Weights,
        steps: u32,
    ) -> C::Axes<f32> {
        Handle::measured(self, measured, travel, weights, steps)
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use std::vec;

    use crate::specimen::{bank, bare, term};
    use crate::*;

    #[test]
    fn the_error_after_k_evaluations_is_at_most_the_kth_power_of_the_slope() {
        // Slopes: X by 1/16 of X and 1/16 of Y, Y by 1/8 of X: L = 1/8 in both rows.
        let mut draft = bare();
        let line = |input| bank(input, -64.0, 128.0, vec![vec![-8.0, 8.0]]);
        draft.banks = vec![line(0), line(1)];
        draft.terms = vec![
            term(0, 0.5, &[0]),
            term(0, 0.5, &[1]),
            term(1, 1.0, &[0]),
            term(1, 2.0, &[]),
        ];
        let blob = draft.encode().unwrap();
        let c = Compensation::<'_, Holds<3, 4, 4, 8, 1>>::from_blob(&blob).unwrap();
        let travel = Travelling::default();
        for (x, y) in [(32.0, -16.0), (-50.0, 40.0), (0.0, 0.0), (10.0, 10.0)] {
            let truth = c.evaluate(&Inputs::at([x, y, 0.0]), &travel, &c.weights());
            let measured = Inputs::at([x + truth[0], y + truth[1], truth[2]]);
            let size = truth[0].abs().max(truth[1].abs());
            for k in 1..=8_i32 {
                let found = c.measured(&measured, &travel, &c.weights(), k as u32);
                let error = (found[0] - truth[0]).abs().max((found[1] - truth[1]).abs());
                // The positions (below 64) round to 2⁻¹⁹, the corrections (below 16) finer.
                let rounding = 4.0 * 2.0_f32.powi(-19);
                assert!(
                    error <= 0.125_f32.powi(k) * size + rounding,
                    "step {k}: {error}"
                );
            }
        }
    }

    #[test]
    fn one_evaluation_is_the_correction_at_the_measured_position() {
        let blob = specimen::everything().encode().unwrap();
        let c = Compensation::<'_, Holds<3, 8, 8, 16, 2>>::from_blob(&blob).unwrap();
        let inputs = Inputs::at([10.0, 20.0, 30.0]);
        let travel = Travelling([Travel::Positive; 3]);
        for steps in [0, 1] {
            assert_eq!(
                c.measured(&inputs, &travel, &c.weights(), steps),
                c.evaluate(&inputs, &travel, &c.weights())
            );
        }
    }
}
