//! Whether bars are as long as the artefact says.

use super::IdentifyError;
use super::factor::Factor;
use super::rows::{Estimate, LARGEST_LENGTH, Problem, Weights};
use nalgebra::{DMatrix, Vector3};

/// A bar against the machine and the other bars.
#[derive(Clone, Debug, PartialEq)]
pub struct BarCheck {
    /// Its balls.
    pub balls: [String; 2],
    /// Its length in the artefact and its standard uncertainty (mm).
    pub length: f64,
    /// As stated.
    pub uncertainty: f64,
    /// What the machine and the other bars say of it; none if nothing else has a length, so that an error of
    /// this bar goes into the scales.
    pub others: Option<Others>,
}

/// What all but a bar say of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Others {
    /// How long they make it (mm).
    pub length: f64,
    /// The standard uncertainty of that (mm).
    pub uncertainty: f64,
    /// Difference in standard deviations.
    pub normalised: f64,
}

impl BarCheck {
    /// True if the bar is in doubt, or those that it disagrees with.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        (self.others).is_some_and(|others| others.normalised.abs() > DOUBTFUL)
    }
}

/// One good bar of 15 000 differs by more standard deviations.
const DOUBTFUL: f64 = 4.0;
/// If all others together leave a bar so small a part of its own observation, they know its length a thousand
/// times worse than the artefact does: that is not a test.
const TESTED: f64 = 1e-6;
/// Bars differ from what probings say by no more than the largest error and this part, before anything is known
/// of the machine: a scale of 10 mm in a metre.
const LIKELY: f64 = 0.01;

/// Every bar against all other equations, where a solution was found.
pub(super) fn checked(
    problem: &Problem<'_>,
    (estimate, weights, factor): (&Estimate, &Weights, &Factor),
    jacobian: &DMatrix<f64>,
) -> Vec<BarCheck> {
    let check = |(i, bar): (usize, &super::rows::Bar)| {
        let [a, b] = bar.balls.map(|ball| estimate.balls[ball]);
        let miss = (a - b).norm() - bar.length;
        let row = jacobian.row(3 * problem.places.len() + i).transpose();
        let leverage = factor.leverage(&row).unwrap_or(1.0);
        // What is left of an observation if it has no part in the result: its miss by 1 − h (Cook).
        let free = 1.0 - leverage;
        let stiffness = bar.sigma.max(weights.least);
        BarCheck {
            balls: bar.balls.map(|ball| problem.balls[ball].clone()),
            length: bar.length,
            uncertainty: bar.sigma,
            others: (free > TESTED).then(|| Others {
                length: bar.length + miss / free,
                uncertainty: stiffness * (leverage / free).sqrt(),
                normalised: miss / stiffness / free.sqrt(),
            }),
        }
    };
    problem.bars.iter().enumerate().map(check).collect()
}

/// Which bars are not as long as the probings say without them.
pub(super) fn disagree(problem: &Problem<'_>, balls: &[Vector3<f64>]) -> IdentifyError {
    let bars = problem.bars.iter().map(|bar| {
        let [a, b] = bar.balls.map(|ball| balls[ball]);
        let names = bar.balls.map(|ball| problem.balls[ball].clone());
        (names, bar.length, (a - b).norm())
    });
    IdentifyError::Bars {
        bars: bars.collect(),
    }
}

/// Refuses bars whose balls are in one place to start with: nobody knows in which direction they are to go
/// apart.
pub(super) fn have_directions(
    problem: &Problem<'_>,
    start: &Estimate,
) -> Result<(), IdentifyError> {
    let is_point = |bar: &&super::rows::Bar| {
        let [a, b] = bar.balls.map(|ball| start.balls[ball]);
        (a - b).try_normalize(f64::MIN_POSITIVE.sqrt()).is_none()
    };
    match problem.bars.iter().find(is_point) {
        None => Ok(()),
        Some(bar) => Err(IdentifyError::SamePlace {
            balls: bar.balls.map(|ball| problem.balls[ball].clone()),
        }),
    }
}

/// Refuses bars that are nowhere near what the probings say.
pub(super) fn are_likely(problem: &Problem<'_>, setup: &Estimate) -> Result<(), IdentifyError> {
    let is_far = |bar: &super::rows::Bar| {
        let [a, b] = bar.balls.map(|ball| setup.balls[ball]);
        ((a - b).norm() - bar.length).abs() > LARGEST_LENGTH + LIKELY * bar.length
    };
    match problem.bars.iter().any(is_far) {
        true => Err(disagree(problem, &setup.balls)),
        false => Ok(()),
    }
}
