//! The effect of a compensation on each error parameter: comparison before and after.

use crate::{Identified, Problem, Unknown};
use nalgebra::DMatrix;
use trueaxis_model::errors::{ErrorModel, Parameter};

/// A parameter before and after.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensability {
    /// Which.
    pub parameter: Parameter,
    /// Value and standard uncertainty before (mm, rad, per mmᵏ or radᵏ); exact if there is no uncertainty.
    pub before: [f64; 2],
    /// Remaining value and its standard uncertainty; `None` if it was not looked for or cannot be identified.
    pub after: Option<[f64; 2]>,
    /// Mean displacement of the tip at the probings that it causes, before and after (mm).
    pub effect: [f64; 2],
}

/// Coverage factor above which a value counts as an error.
const COVERAGE: f64 = 2.0;

impl Compensability {
    /// The removed fraction (source document, Eq. 38): 1 − |after| / |before|, which is 1 if nothing remains and
    /// negative if the error has grown; with its standard uncertainty. `None` if the remainder is unknown, or if the
    /// parameter was too small before ([`Self::is_small`]).
    #[must_use]
    pub fn part(&self) -> Option<[f64; 2]> {
        let [before, of_before] = self.before;
        let [after, of_after] = self.after.filter(|_| !self.is_small())?;
        let ratio = after / before;
        let uncertainty = libm::hypot(of_after, ratio * of_before) / before.abs();
        Some([1.0 - ratio.abs(), uncertainty])
    }

    /// True if it did not exceed its expanded uncertainty before, so that there may have been nothing to compensate.
    #[must_use]
    pub fn is_small(&self) -> bool {
        let [before, uncertainty] = self.before;
        before == 0.0 || before.abs() <= COVERAGE * uncertainty
    }
}

/// A machine before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct Compensated {
    /// The parameters of the model that had a value before, in its order.
    pub parameters: Vec<Compensability>,
    /// Displacement of the tip at the probings caused by all of them together, before and after (mm): mean and
    /// maximum.
    pub tip: [[f64; 2]; 2],
}

impl Compensability {
    /// `per_unit` is the mean displacement of the tip per unit of the parameter.
    fn of(
        parameter: Parameter,
        before: &ErrorModel,
        identified: &Identified,
        per_unit: f64,
    ) -> Self {
        let value = before.parameters[&parameter];
        let known = before.standard_uncertainty.get(&parameter);
        let mut after = identified.parameters.iter();
        let after = after.find(|e| e.parameter == parameter);
        let after = after.map(|e| [e.value, e.uncertainty]);
        Self {
            parameter,
            before: [value, known.copied().unwrap_or(0.0)],
            after,
            effect: [value, after.map_or(0.0, |[left, _]| left)].map(|v| v.abs() * per_unit),
        }
    }
}

/// Compares identified parameters, which remain with a compensation on while probing, with the errors `before`.
#[must_use]
pub fn compensability(
    problem: &Problem<'_>,
    identified: &Identified,
    before: &ErrorModel,
) -> Compensated {
    let parameters: Vec<Parameter> = (identified.looked_for.iter().copied())
        .filter(|p| before.parameters.contains_key(p))
        .collect();
    let weights = problem.unweighted(1.0);
    let unknowns: Vec<Unknown> = parameters.iter().map(|p| Unknown::Parameter(*p)).collect();
    let found = &identified.place.estimate;
    let changes = problem.derivatives(&unknowns, found, &weights);
    let rows = problem.places.len();
    // Derivatives by each parameter (columns), for three coordinates of each row.
    let changes: DMatrix<f64> = changes.rows(0, 3 * rows).into_owned();
    let columns = changes.column_iter().zip(&parameters);
    let parameters = columns.map(|(column, parameter)| {
        let lengths = (0..rows).map(|i| column.fixed_rows::<3>(3 * i).norm());
        let per_unit = lengths.sum::<f64>() / rows as f64;
        Compensability::of(*parameter, before, identified, per_unit)
    });
    let nominal = problem.tips(&ErrorModel::perfect(problem.machine), &found.stylus);
    let tip = |errors: &ErrorModel| {
        let tips = problem.tips(errors, &found.stylus);
        let moved: Vec<f64> = (tips.iter().zip(&nominal))
            .map(|((_, tip), (_, nominal))| (tip - nominal).norm())
            .collect();
        let largest = moved.iter().copied().fold(0.0, f64::max);
        [moved.iter().sum::<f64>() / moved.len() as f64, largest]
    };
    Compensated {
        tip: [tip(before), tip(&identified.errors)],
        parameters: parameters.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(before: [f64; 2], after: Option<[f64; 2]>) -> Compensability {
        Compensability {
            parameter: Parameter::parse("EB0A").unwrap(),
            before,
            after,
            effect: [0.0; 2],
        }
    }

    #[test]
    fn the_part_that_is_gone_does_not_ask_for_signs() {
        // Table 7-2 of the source document: EA0Z, 106.0 before and −11.3 after; EB0Z, 22.0 and 39.0.
        for (before, after, part) in [
            (106.0, -11.3, 0.893),
            (106.0, 11.3, 0.893),
            (22.0, 39.0, -0.773),
        ] {
            let [found, _] = of([before, 0.0], Some([after, 0.0])).part().unwrap();
            assert!((found - part).abs() < 5e-4, "{found}");
        }
        assert_eq!(of([-5.0, 1.0], Some([0.0, 0.0])).part(), Some([1.0, 0.0]));
    }

    #[test]
    fn its_uncertainty_is_that_of_both() {
        let [_, uncertainty] = of([100.0, 3.0], Some([-50.0, 2.0])).part().unwrap();
        // d(a/b)² = (2/100)² + (0.5·3/100)².
        assert!((uncertainty - 0.025).abs() < 1e-15);
    }

    #[test]
    fn nothing_is_said_of_what_may_not_have_been_there_or_is_not_known() {
        let small = of([1.9, 1.0], Some([0.5, 1.0]));
        assert!(small.is_small() && small.part().is_none());
        assert!(of([0.0, 0.0], Some([0.5, 1.0])).part().is_none());
        let unseen = of([2.1, 1.0], None);
        assert!(!unseen.is_small() && unseen.part().is_none());
    }
}
