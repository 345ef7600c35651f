//! What an identification cannot know of a machine.

use super::{HeldOut, Honesty, Identified, IdentifyError, Problem};
use trueaxis_model::errors::Parameter;

/// What the measurements do not show of the machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NotKnown {
    /// Location errors that the stylus takes up ([`Problem::hidden_by_stylus`]).
    pub hidden: Vec<Parameter>,
    /// Standard deviation (mm) of a coordinate of the tip by errors that the model lacks, in the probed zone; `None`
    /// without probings.
    pub misfit: Option<f64>,
}

impl NotKnown {
    /// For an identification and the prediction of probings that were left out.
    ///
    /// # Errors
    /// [`IdentifyError`] if derivatives are not finite.
    pub fn of(
        problem: &Problem<'_>,
        identified: &Identified,
        honesty: &Honesty,
        held_out: Option<&HeldOut>,
    ) -> Result<Self, IdentifyError> {
        Ok(Self {
            hidden: problem.hidden_by_stylus(identified)?,
            misfit: misfit(identified, honesty, held_out),
        })
    }
}

/// What residuals have beyond the noise of probing: σ² = s² − σ₀². The noise σ₀ is what the file states, or else the
/// repeatability. With neither, residuals cannot tell errors from noise, and all of them count as errors. Probings that
/// were left out show more of an error than the fit, which follows it as far as it can.
fn misfit(identified: &Identified, honesty: &Honesty, held_out: Option<&HeldOut>) -> Option<f64> {
    if identified.rows.is_empty() {
        return None;
    }
    let stated = identified.of_stated.map(|factor| identified.noise / factor);
    let repeated = honesty.repeats.map(|repeats| repeats.deviation);
    let noise = stated.or(repeated).unwrap_or(0.0);
    let has_errors = (stated.is_none() && repeated.is_none())
        || identified.components[0].is_refuted
        || honesty.repeats.is_some_and(|repeats| repeats.is_less);
    // Where nothing speaks for errors, what left-out rows show beyond the noise is the uncertainty of the parameters.
    let held_out = held_out.filter(|_| has_errors);
    let coordinate = |held_out: &HeldOut| held_out.rms / 3.0_f64.sqrt();
    let left = held_out.map_or(0.0, coordinate).max(identified.noise);
    Some((left * left - noise * noise).max(0.0).sqrt())
}
