//! Chooses the complexity of the model by cross-validation with balls that are left out.

use super::candidates::{Form, candidates};
use super::published::listed;
use super::structure::SEEN;
use super::{
    HeldOut, Identified, IdentifyError, Model, Options, Problem, drifting, held_out, identify,
    root_mean_square,
};
use crate::formats::artefact::Artefact;
use crate::formats::observations::{Drift, Observations};
use crate::formats::probings::Probings;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// One degree that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Degree of polynomials and harmonics; 0 means locations and scales.
    pub degree: u8,
    /// Form of the motions of axes that rotate by a full turn.
    pub form: Form,
    /// The published list for machines of this layout, if it was tried.
    pub list: Option<Model>,
    /// The result, or why there is none; higher degrees are not tried then.
    pub found: Result<Fit, IdentifyError>,
}

/// Result for one degree.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Number of its parameters that can be identified.
    pub parameters: usize,
    /// Number of its parameters that cannot be identified.
    pub unseen: usize,
    /// Its residual at the rows it was fitted to (mm, root mean square distance).
    pub left: f64,
    /// Its residual at rows that were held out, or why it cannot be identified without some of the rows.
    pub held_out: Result<HeldOut, IdentifyError>,
}

impl Level {
    /// True if there is nothing to compare higher degrees with.
    fn is_end(&self) -> bool {
        !matches!(&self.found, Ok(fit) if fit.held_out.is_ok())
    }
}

/// A combination is worth identifying if its standard uncertainty is at most this many times the effect of all
/// errors together at the probings. Single coefficients, which partly cancel, are larger than their total effect,
/// but not by that much.
const PLAUSIBLE: f64 = 5.0;

/// The smallest effect of a combination at the probings, as a fraction of the effects of its parts, at which it is worth
/// identifying.
fn told(problem: &Problem<'_>, identified: &Identified) -> f64 {
    let size = root_mean_square(identified.all_rows().map(|row| row.before.norm()));
    // A combination with singular value s, measured by its effect at the probings (root mean square), has a standard
    // uncertainty of that of a coordinate divided by s.
    identified.noise / (PLAUSIBLE * size * (problem.equations() as f64).sqrt())
}

impl Fit {
    /// Identifies given parameters and cross-validates them.
    pub(super) fn of(
        machine: &Machine,
        probings: &Probings,
        artefact: &Artefact,
        observations: &Observations,
        parameters: &[Parameter],
        base: &ErrorModel,
        options: Options,
    ) -> Result<(Identified, Self), IdentifyError> {
        let problem = Problem::new(machine, probings, artefact, parameters, base);
        let problem = problem.with(observations);
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
            unseen: identified.looked_for.len() - identified.parameters.len(),
            left: root_mean_square(identified.all_rows().map(|row| row.after.norm())),
            held_out: held_out(
                machine,
                probings,
                artefact,
                observations,
                parameters,
                base,
                options,
            ),
        };
        Ok((identified, fit))
    }
}

/// The result of the choice.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The identification with the chosen model.
    pub identified: Identified,
    /// All models that were tried, starting with the simplest.
    pub levels: Vec<Level>,
    /// Index of the chosen one.
    pub chosen: usize,
    /// Drift that was found together with the parameters, as in
    /// [`Observations::drift`](crate::formats::observations::Observations::drift).
    pub drift: Vec<Drift>,
}

/// The highest degree tried.
const HIGHEST: u8 = 3;
/// A higher degree must reduce the residual of held-out rows to this fraction; a smaller gain is chance.
const WORTH: f64 = 0.95;

/// Identifies with every degree, and takes the lowest whose prediction of held-out rows, one ball at a time, is
/// about as good as that of any other. If the lowest degree cannot be cross-validated, it is taken. Axes that rotate
/// by a full turn but have limits are tried with harmonics, then with polynomials of the same degree. Last, the list
/// published for machines of this layout is tried, if there is one.
///
/// # Errors
/// [`IdentifyError`] if not even the simplest model can be identified.
pub fn automatic(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    observations: &Observations,
    base: &ErrorModel,
    options: Options,
) -> Result<Chosen, IdentifyError> {
    let directions: Vec<bool> = (0..machine.axes.len())
        .map(|i| {
            let probed = probings.rows.iter().map(|row| row.direction[i]);
            let observed = observations.rows.iter().map(|row| row.direction[i]);
            probed.chain(observed).any(|direction| direction != 0.0)
        })
        .collect();
    let mut observations = observations.clone();
    if observations.drift.is_empty() {
        // What a simple model leaves is no noise, but it does not drift either.
        let parameters = candidates(machine, 0, Form::Harmonics, &directions);
        let problem = Problem::new(machine, probings, artefact, &parameters, base);
        let problem = problem.with(&observations);
        if problem.has_times() {
            observations.drift = drifting(&problem, &identify(&problem, options)?);
        }
    }
    let observations = &observations;
    let find = |degree, form| {
        let parameters = candidates(machine, degree, form, &directions);
        Fit::of(
            machine,
            probings,
            artefact,
            observations,
            &parameters,
            base,
            options,
        )
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
        // Without a comparison, no model is better than the simplest.
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
            // A higher degree has even more unknowns.
            if level.is_end() {
                forms.retain(|other| *other != form);
            }
            levels.push(level);
        }
    }
    // Coefficients can replace each other; which of them are used affects how well they are determined.
    if let Some((list, parameters)) = listed(machine).filter(|_| !levels[0].is_end()) {
        let found = Fit::of(
            machine,
            probings,
            artefact,
            observations,
            &parameters,
            base,
            options,
        );
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
        drift: observations.drift.clone(),
    })
}
