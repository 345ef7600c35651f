//! Tests what was stated beforehand about set-ups against what all other measurements say.

use crate::Identified;
use crate::prior::Prior;
use crate::setup::FoundPart;
use trueaxis_model::numbers::by;

/// Priors of one file that are right are reported once in a thousand files.
pub(crate) const CHANCE: f64 = 1e-3;

/// A prior that the measurements contradict.
#[derive(Clone, Debug, PartialEq)]
pub struct Contradicted<'a> {
    /// Name of the set-up.
    pub setup: &'a str,
    /// The part of the set-up.
    pub part: &'a FoundPart,
    /// What was stated about it.
    pub prior: Prior,
    /// See [`Prior::z`].
    pub z: f64,
    /// How often chance gives one as far off among as many priors.
    pub probability: f64,
    /// Number of priors that were tested.
    pub tested: usize,
}

/// The priors of set-ups that chance does not explain, the worst first.
#[must_use]
pub fn contradicted(identified: &Identified) -> Vec<Contradicted<'_>> {
    let mut all: Vec<(&str, &FoundPart, Prior, f64)> = Vec::new();
    for setup in &identified.setups {
        for part in &setup.parts {
            let Some(prior) = part.prior else { continue };
            let Some(z) = prior.z else { continue };
            // A tool point that several set-ups share is one prior.
            let is_listed = |(_, other, ..): &(&str, &FoundPart, Prior, f64)| *other == part;
            if !all.iter().any(is_listed) {
                all.push((&setup.name, part, prior, z));
            }
        }
    }
    let tested = all.len();
    let found: Vec<Contradicted<'_>> = (all.into_iter())
        .map(|(setup, part, prior, z)| Contradicted {
            setup,
            part,
            prior,
            z,
            probability: among(z, tested),
            tested,
        })
        .filter(|one| one.probability < CHANCE)
        .collect();
    by(found, |one| -one.z.abs())
}

/// The probability that the largest of some normally distributed deviations is at least this one.
fn among(z: f64, tested: usize) -> f64 {
    let one = libm::erfc(z.abs() / std::f64::consts::SQRT_2);
    -libm::expm1(tested as f64 * libm::log1p(-one.min(1.0 - f64::EPSILON)))
}

impl Contradicted<'_> {
    /// A sentence about it.
    #[must_use]
    pub fn sentence(&self) -> String {
        let (factor, unit) = self.part.shown();
        let (probability, tested) = (self.probability.max(1e-12), self.tested);
        format!(
            "{}: the {} was stated as {:.4} ± {:.4} {unit} (standard uncertainty), but all other measurements together with it make it {:.4}: z = {:.1}, which chance gives among {tested} stated values with a probability of {probability:.0e}. Either it is wrong, or another known length or a reading of this set-up; correct it, leave its uncertainty out, or leave the set-up out with --without \"setup {}\"",
            self.setup,
            self.part.what,
            self.prior.value * factor,
            self.prior.sigma * factor,
            self.part.value * factor,
            self.z,
            self.setup
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_counts_the_priors() {
        // Two-sided 5 % points of one and of ten normal deviations (Šidák).
        assert!((among(1.959_964, 1) - 0.05).abs() < 1e-6);
        assert!((among(2.799_5, 10) - 0.05).abs() < 1e-4);
        // Far off, nothing underflows to certainty.
        assert!(among(50.0, 3) < 1e-300);
    }

    #[test]
    fn the_deviation_of_a_prior_is_that_of_its_residual() {
        // Two values of one length, 1 ± 0.3 as stated and 2 ± 0.4 by the rest: z is their difference over 0.5.
        let weight = |sigma: f64| 1.0 / (sigma * sigma);
        let variance = 1.0 / (weight(0.3) + weight(0.4));
        let found = variance * (weight(0.3) + 2.0 * weight(0.4));
        let prior = Prior::new(1.0, 0.3, 0.3, found, variance.sqrt());
        assert!((prior.z.unwrap() - 2.0).abs() < 1e-12);
        // Nothing else knows it.
        assert_eq!(Prior::new(1.0, 0.3, 0.3, 1.0, 0.3).z, None);
    }
}
