//! Checks the lengths of bars.

use crate::IdentifyError;
use crate::estimate::Estimate;
use crate::factor::ScaledFactor;
use crate::rows::{EquationWeights, LARGEST_LENGTH, Problem};
use nalgebra::{DMatrix, Vector3};

/// A bar compared with the machine and the other bars.
#[derive(Clone, Debug, PartialEq)]
pub struct BarCheck {
    /// Balls of the bar compared.
    pub balls: [String; 2],
    /// Length in the artefact (mm).
    pub length: f64,
    /// Stated standard uncertainty (mm).
    pub uncertainty: f64,
    /// Length according to the machine and the other bars. `None` if nothing else has a known length, so that an
    /// error of this bar is absorbed by the scales.
    pub others: Option<Others>,
}

/// The length of a bar according to everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Others {
    /// Length (mm).
    pub length: f64,
    /// The standard uncertainty of that (mm).
    pub uncertainty: f64,
    /// The difference in standard deviations.
    pub normalised: f64,
}

impl BarCheck {
    /// True if this bar, or those that it disagrees with, is doubtful.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        (self.others).is_some_and(|others| others.normalised.abs() > DOUBTFUL)
    }
}

/// One correct bar in 15 000 differs by more standard deviations.
const DOUBTFUL: f64 = 4.0;
/// If all other equations contribute less than this fraction to the observation of a bar, they know its length a
/// thousand times worse than the artefact. That is not a test.
const TESTED: f64 = 1e-6;
/// Before anything is known about the machine, a bar differs from the probings by no more than the largest error and
/// this fraction: a scale error of 10 mm per metre.
const LIKELY: f64 = 0.01;

/// Compares every bar with all other equations, at a solution.
pub(crate) fn checked(
    problem: &Problem<'_>,
    (estimate, weights, factor): (&Estimate, &EquationWeights, &ScaledFactor),
    jacobian: &DMatrix<f64>,
) -> Vec<BarCheck> {
    let check = |(i, bar): (usize, &super::rows::BarRow)| {
        let [a, b] = bar.balls.map(|ball| estimate.balls[ball]);
        let miss = (a - b).norm() - bar.length;
        let row = jacobian.row(problem.measured() + i).transpose();
        let leverage = factor.leverage(&row).unwrap_or(1.0);
        // The residual of an observation without its own influence is its residual divided by 1 − h (Cook).
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

/// The bars whose length differs from that in the probings, fitted without them.
pub(crate) fn disagree(problem: &Problem<'_>, balls: &[Vector3<f64>]) -> IdentifyError {
    let bars = problem.bars.iter().map(|bar| {
        let [a, b] = bar.balls.map(|ball| balls[ball]);
        let names = bar.balls.map(|ball| problem.balls[ball].clone());
        (names, bar.length, (a - b).norm())
    });
    IdentifyError::Bars {
        bars: bars.collect(),
    }
}

/// Refuses bars whose balls start at the same place, because their direction is unknown.
pub(crate) fn have_directions(
    problem: &Problem<'_>,
    start: &Estimate,
) -> Result<(), IdentifyError> {
    let is_point = |bar: &&super::rows::BarRow| {
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

/// Refuses bars whose length is far from that in the probings.
pub(crate) fn are_likely(problem: &Problem<'_>, setup: &Estimate) -> Result<(), IdentifyError> {
    let is_far = |bar: &super::rows::BarRow| {
        let [a, b] = bar.balls.map(|ball| setup.balls[ball]);
        ((a - b).norm() - bar.length).abs() > LARGEST_LENGTH + LIKELY * bar.length
    };
    match problem.bars.iter().any(is_far) {
        true => Err(disagree(problem, &setup.balls)),
        false => Ok(()),
    }
}
