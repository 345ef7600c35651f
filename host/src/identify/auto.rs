//! A model as complex as balls that were left out allow.

use super::{Identified, IdentifyError, Model, ModelError, Options, Problem, identify};
use crate::errors::ErrorModel;
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use crate::machine::Machine;
use nalgebra::Vector3;

/// A degree that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Of polynomials and harmonics; 0 for locations and scales.
    pub degree: u8,
    /// How many parameters it has that can be seen.
    pub parameters: usize,
    /// What it leaves of the rows it was fitted to (mm, root of the mean square distance).
    pub left: f64,
    /// What it leaves of rows that it had not seen.
    pub held_out: f64,
}

/// Why there is no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AutoError {
    /// Not even the simplest one can be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The machine has no such model.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// The highest degree that is tried.
const HIGHEST: u8 = 3;
/// A higher degree must leave this part less of what was held out: less is chance.
const WORTH: f64 = 0.95;
/// Parts that the rows are held out in where balls are too few for that.
const PARTS: usize = 4;
const FEW_BALLS: usize = 3;

/// Identifies with every degree, and takes the lowest that predicts rows which it has not seen about as well
/// as any: those of one ball after the other.
///
/// # Errors
/// [`AutoError`] if nothing can be identified.
pub fn automatic(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    base: &ErrorModel,
    options: Options,
) -> Result<(Identified, Vec<Level>), AutoError> {
    let directions: Vec<bool> = (0..machine.axes.len())
        .map(|i| probings.rows.iter().any(|row| row.direction[i] != 0.0))
        .collect();
    let mut levels: Vec<Level> = Vec::new();
    let mut best: Option<(Identified, f64)> = None;
    for degree in 0..=HIGHEST {
        let parameters = Model::Auto.parameters(machine, degree, &directions)?;
        let find = |probings: &Probings| {
            identify(
                &Problem::new(machine, probings, artefact, &parameters, base),
                options,
            )
        };
        let identified = match find(probings) {
            Ok(identified) => identified,
            Err(error) if best.is_none() => return Err(error.into()),
            Err(_) => break,
        };
        let mut squares = 0.0;
        let mut is_tried = true;
        for part in parts(probings) {
            let others = subset(probings, |i| !part.contains(&i));
            let Ok(without) = find(&others) else {
                is_tried = false;
                break;
            };
            squares += predicted(machine, probings, artefact, &part, &without);
        }
        if !is_tried && best.is_some() {
            break;
        }
        let count = probings.rows.len() as f64;
        let held_out = if is_tried {
            (squares / count).sqrt()
        } else {
            f64::NAN
        };
        let left = identified
            .rows
            .iter()
            .map(|r| r.after.norm_squared())
            .sum::<f64>();
        levels.push(Level {
            degree,
            parameters: identified.parameters.len(),
            left: (left / count).sqrt(),
            held_out,
        });
        if best
            .as_ref()
            .is_none_or(|(_, least)| held_out < WORTH * least)
        {
            best = Some((identified, held_out));
        }
    }
    match best {
        Some((identified, _)) => Ok((identified, levels)),
        None => Err(IdentifyError::NotConverged { rms: f64::NAN }.into()),
    }
}

/// Rows that are held out together: those of each ball.
fn parts(probings: &Probings) -> Vec<Vec<usize>> {
    let (count, part): (usize, fn(&Probing, usize) -> usize) = match probings.balls.len() {
        balls if balls >= FEW_BALLS => (balls, |row, _| row.ball),
        _ => (PARTS, |_, i| i % PARTS),
    };
    let rows = || probings.rows.iter().enumerate();
    (0..count)
        .map(|k| {
            rows()
                .filter(|(i, row)| part(row, *i) == k)
                .map(|(i, _)| i)
                .collect()
        })
        .collect()
}

fn subset(probings: &Probings, is_in: impl Fn(usize) -> bool) -> Probings {
    let rows = probings.rows.iter().enumerate().filter(|(i, _)| is_in(*i));
    let mut subset = Probings {
        balls: Vec::new(),
        rows: rows.map(|(_, row)| row.clone()).collect(),
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

/// Sum of the squares of what is left of rows that were held out, each ball put where that is least.
fn predicted(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    part: &[usize],
    without: &Identified,
) -> f64 {
    let held_out = subset(probings, |i| part.contains(&i));
    let problem = Problem::new(machine, &held_out, artefact, &[], &without.errors);
    let tips = problem.tips(&without.errors, &without.stylus);
    (0..held_out.balls.len())
        .map(|ball| {
            let of_ball: Vec<&Vector3<f64>> = tips
                .iter()
                .filter(|(b, _)| *b == ball)
                .map(|(_, tip)| tip)
                .collect();
            let mean = of_ball.iter().copied().sum::<Vector3<f64>>() / of_ball.len() as f64;
            of_ball
                .iter()
                .map(|tip| (*tip - mean).norm_squared())
                .sum::<f64>()
        })
        .sum()
}
