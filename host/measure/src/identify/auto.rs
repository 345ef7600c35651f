//! A model as complex as balls that were left out allow.

use super::candidates::{Form, candidates};
use super::published::listed;
use super::structure::SEEN;
use super::{
    HeldOut, Identified, IdentifyError, Model, Options, Problem, held_out, identify,
    root_mean_square,
};
use crate::formats::artefact::Artefact;
use crate::formats::probings::Probings;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// A degree that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Of polynomials and harmonics; 0 for locations and scales.
    pub degree: u8,
    /// What the motions of axes are that turn right round.
    pub form: Form,
    /// The list that was published for machines that are laid out like this one, if it is that.
    pub list: Option<Model>,
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

impl Level {
    /// True if there is nothing to compare more unknowns with.
    fn is_end(&self) -> bool {
        !matches!(&self.found, Ok(fit) if fit.held_out.is_ok())
    }
}

/// A combination is worth looking for if its standard uncertainty is at most this many times what all errors together
/// do at the probings: single coefficients, which make up for each other, are larger than what they do together, but
/// not by so much.
const PLAUSIBLE: f64 = 5.0;

/// The part of what its parts do that a combination must do at the probings to be worth looking for.
fn told(problem: &Problem<'_>, identified: &Identified) -> f64 {
    let size = root_mean_square(identified.rows.iter().map(|row| row.before.norm()));
    // A combination whose singular value is s is known, by what it does at the probings (root of the mean square), to
    // the standard uncertainty of a coordinate divided by s.
    identified.noise / (PLAUSIBLE * size * (problem.equations() as f64).sqrt())
}

impl Fit {
    /// Identifies these parameters, and looks at rows that were left out.
    pub(super) fn of(
        machine: &Machine,
        probings: &Probings,
        artefact: &Artefact,
        parameters: &[Parameter],
        base: &ErrorModel,
        options: Options,
    ) -> Result<(Identified, Self), IdentifyError> {
        let problem = Problem::new(machine, probings, artefact, parameters, base);
        let mut identified = identify(&problem, options)?;
        let options = Options {
            least: told(&problem, &identified),
            ..options
        };
        if options.least > SEEN {
            identified = identify(&problem, options)?;
        }
        let fit = Self {
            parameters: identified.parameters.len(),
            unseen: parameters.len() - identified.parameters.len(),
            left: root_mean_square(identified.rows.iter().map(|row| row.after.norm())),
            held_out: held_out(machine, probings, artefact, parameters, base, options),
        };
        Ok((identified, fit))
    }
}

/// The model that was chosen.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// What was identified with it.
    pub identified: Identified,
    /// All that were tried, from the simplest on.
    pub levels: Vec<Level>,
    /// Which of them it is.
    pub chosen: usize,
}

/// The highest degree that is tried.
const HIGHEST: u8 = 3;
/// A higher degree must leave this part less of what was held out: less is chance.
const WORTH: f64 = 0.95;

/// Identifies with every degree, and takes the lowest that predicts rows which it has not seen about as well
/// as any: those of one ball after the other. If the lowest cannot be tried in this way, it is taken. Axes that
/// turn right round and are not endless are tried with harmonics, then with polynomials of the same degree; last
/// the list that was published for machines of this layout, if there is one.
///
/// # Errors
/// [`IdentifyError`] if not even the simplest one can be identified.
pub fn automatic(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    base: &ErrorModel,
    options: Options,
) -> Result<Chosen, IdentifyError> {
    let directions: Vec<bool> = (0..machine.axes.len())
        .map(|i| probings.rows.iter().any(|row| row.direction[i] != 0.0))
        .collect();
    let find = |degree, form| {
        let parameters = candidates(machine, degree, form, &directions);
        Fit::of(machine, probings, artefact, &parameters, base, options)
    };
    let mut forms = Form::of(machine).to_vec();
    let form = Form::Harmonics;
    let (mut best, fit) = find(0, form)?;
    let mut least = fit.held_out.as_ref().ok().map(|held_out| held_out.rms);
    let mut chosen = 0;
    let mut levels = vec![Level {
        degree: 0,
        form,
        list: None,
        found: Ok(fit),
    }];
    let mut take = |number: usize, (identified, fit): (Identified, Fit)| {
        let held_out = fit.held_out.as_ref().ok().map(|held_out| held_out.rms);
        // Without anything to compare it with, no model is better than the simplest.
        if let (Some(rms), Some(last)) = (held_out, least)
            && rms < WORTH * last
        {
            (best, least, chosen) = (identified, Some(rms), number);
        }
        fit
    };
    if levels[0].is_end() {
        forms.clear();
    }
    for degree in 1..=HIGHEST {
        for form in forms.clone() {
            let found = find(degree, form).map(|found| take(levels.len(), found));
            let level = Level {
                degree,
                form,
                list: None,
                found,
            };
            // A higher degree has more unknowns still.
            if level.is_end() {
                forms.retain(|other| *other != form);
            }
            levels.push(level);
        }
    }
    // Which of the coefficients that make up for each other are looked for decides how well they are told.
    if let Some((list, parameters)) = listed(machine).filter(|_| !levels[0].is_end()) {
        let found = Fit::of(machine, probings, artefact, &parameters, base, options);
        let found = found.map(|found| take(levels.len(), found));
        levels.push(Level {
            degree: HIGHEST,
            form: Form::Polynomials,
            list: Some(list),
            found,
        });
    }
    Ok(Chosen {
        identified: best,
        levels,
        chosen,
    })
}
