//! Balls that a machine was not fitted to.

use super::rows::order;
use super::{IdentifyError, Options, Problem, identify};
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// What machines that were found without some rows say of these.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Root of the mean square distance (mm) from where each tip should be to where it is, over all rows.
    pub rms: f64,
    /// The same of the rows of each ball, by its name; empty if balls were too few to leave one out.
    pub balls: Vec<(String, f64)>,
}

/// Parts that the rows are held out in where balls are too few for that.
const PARTS: usize = 4;
const FEW_BALLS: usize = 3;

/// Identifies without the rows of each ball, and looks how well that machine predicts them, the ball put where
/// that is best. With fewer than three balls every fourth row is left out instead.
///
/// # Errors
/// [`IdentifyError`] if nothing can be identified without some of the rows.
pub fn held_out(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    parameters: &[Parameter],
    base: &ErrorModel,
    options: Options,
) -> Result<HeldOut, IdentifyError> {
    let mut squares = 0.0;
    let mut balls = Vec::new();
    for (name, part) in parts(probings) {
        let others = subset(probings, |i| !part.contains(&i));
        let problem = Problem::new(machine, &others, artefact, parameters, base);
        let without = identify(&problem, options)?;
        let part = subset(probings, |i| part.contains(&i));
        let problem = Problem::new(machine, &part, artefact, &[], &without.errors);
        let tips = problem.tips(&without.errors, &without.stylus);
        let part_squares = (0..part.balls.len())
            .map(|ball| scatter(&tips, ball))
            .sum::<f64>();
        squares += part_squares;
        balls.extend(name.map(|name| (name, (part_squares / part.rows.len() as f64).sqrt())));
    }
    Ok(HeldOut {
        rms: (squares / probings.rows.len() as f64).sqrt(),
        balls,
    })
}

/// Rows that are held out together: those of each ball, by their names.
fn parts(probings: &Probings) -> Vec<(Option<String>, Vec<usize>)> {
    let order = order(probings);
    if probings.balls.len() < FEW_BALLS {
        let every = |k: usize| order.iter().copied().skip(k).step_by(PARTS).collect();
        return (0..PARTS).map(|k| (None, every(k))).collect();
    }
    let mut balls: Vec<usize> = (0..probings.balls.len()).collect();
    balls.sort_by_key(|b| &probings.balls[*b]);
    let of = |ball: usize| {
        let rows = order.iter().copied();
        rows.filter(|i| probings.rows[*i].ball == ball).collect()
    };
    balls
        .into_iter()
        .map(|ball| (Some(probings.balls[ball].clone()), of(ball)))
        .collect()
}

/// The rows that are in, and their balls.
pub(super) fn subset(probings: &Probings, is_in: impl Fn(usize) -> bool) -> Probings {
    let rows = probings.rows.iter().enumerate().filter(|(i, _)| is_in(*i));
    let mut subset = Probings {
        balls: Vec::new(),
        rows: rows
            .map(|(_, row): (usize, &Probing)| row.clone())
            .collect(),
    };
    for row in &mut subset.rows {
        let name = &probings.balls[row.ball];
        let known = subset.balls.iter().position(|b| b == name);
        row.ball = known.unwrap_or_else(|| {
            subset.balls.push(name.clone());
            subset.balls.len() - 1
        });
    }
    subset
}

/// Sum of the squares of the distances from the mean place of the tip at a ball.
fn scatter(tips: &[(usize, Vector3<f64>)], ball: usize) -> f64 {
    let tips = tips.iter().filter(|(b, _)| *b == ball).map(|(_, tip)| tip);
    let tips: Vec<&Vector3<f64>> = tips.collect();
    let mean = tips.iter().copied().sum::<Vector3<f64>>() / tips.len() as f64;
    tips.iter().map(|tip| (*tip - mean).norm_squared()).sum()
}
