//! A model as complex as balls that were left out allow.

use super::{
    HeldOut, Identified, IdentifyError, Model, ModelError, Options, Problem, held_out, identify,
    root_mean_square,
};
use crate::errors::ErrorModel;
use crate::formats::artefact::Artefact;
use crate::formats::probings::Probings;
use crate::machine::Machine;

/// A degree that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Of polynomials and harmonics; 0 for locations and scales.
    pub degree: u8,
    /// What came of it, or why nothing did; higher degrees are not tried then.
    pub found: Result<Fit, IdentifyError>,
}

/// What a degree does.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// How many parameters it has that can be seen.
    pub parameters: usize,
    /// How many it has besides, that cannot.
    pub unseen: usize,
    /// What it leaves of the rows it was fitted to (mm, root of the mean square distance).
    pub left: f64,
    /// What it leaves of rows that it had not seen, or why it cannot be identified without some of them.
    pub held_out: Result<HeldOut, IdentifyError>,
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

/// Identifies with every degree, and takes the lowest that predicts rows which it has not seen about as well
/// as any: those of one ball after the other. If the lowest cannot be tried in this way, it is taken.
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
    let of = |degree| Model::Auto.parameters(machine, degree, &directions);
    let find = |degree| -> Result<(Identified, Fit), AutoError> {
        let parameters = of(degree)?;
        let problem = Problem::new(machine, probings, artefact, &parameters, base);
        let identified = identify(&problem, options)?;
        let fit = Fit {
            parameters: identified.parameters.len(),
            unseen: parameters.len() - identified.parameters.len(),
            left: root_mean_square(identified.rows.iter().map(|row| row.after.norm())),
            held_out: held_out(machine, probings, artefact, &parameters, base, options),
        };
        Ok((identified, fit))
    };
    let (mut best, fit) = find(0)?;
    let mut least = fit.held_out.as_ref().ok().map(|held_out| held_out.rms);
    let first = Level {
        degree: 0,
        found: Ok(fit),
    };
    let mut levels = vec![first];
    for degree in 1..=HIGHEST {
        // Without anything to compare it with, no model is better than the simplest.
        let Some(last) = least else { break };
        let found = match find(degree) {
            Ok((identified, fit)) => {
                let held_out = fit.held_out.as_ref().ok().map(|held_out| held_out.rms);
                if let Some(rms) = held_out.filter(|rms| *rms < WORTH * last) {
                    (best, least) = (identified, Some(rms));
                }
                Ok(fit)
            }
            Err(AutoError::Identify(error)) => Err(error),
            Err(error @ AutoError::Model(_)) => return Err(error),
        };
        let is_end = !matches!(&found, Ok(fit) if fit.held_out.is_ok());
        levels.push(Level { degree, found });
        if is_end {
            break;
        }
    }
    Ok((best, levels))
}
