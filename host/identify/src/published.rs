//! Compares the chosen model with the list of coefficients published for machines of the same layout, and explains
//! the differences.

use crate::{Chosen, Fit, IdentifyError, Level, Model, TriedTerms, Unknown};
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// Why a published coefficient is not among the chosen ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// These probings cannot separate it from the coefficients that were kept.
    Confounded,
    /// It has no effect at these probings, or no row states the direction from which the axis arrived.
    Idle,
    /// The constant of an error motion, which locations replace.
    Constant,
    /// It brings nothing: other positions are not predicted better.
    Degree,
    /// A polynomial of an axis that rotates by a full turn; harmonics predict other positions better.
    Form,
}

/// The list compared with the chosen model.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// The published list.
    pub model: Model,
    /// Number of coefficients.
    pub count: usize,
    /// Result with the same probings, or why it cannot be identified.
    pub fit: Result<Fit, IdentifyError>,
    /// Coefficients that are also in the chosen model.
    pub kept: Vec<Parameter>,
    /// Coefficients that are not.
    pub missing: Vec<(Parameter, Missing)>,
    /// Additional parameters of the chosen model.
    pub besides: Vec<Parameter>,
    /// True if both have the same number of identifiable parameters and the same residual: they describe the same
    /// errors by different coefficients.
    pub is_same: bool,
}

/// Relative difference of the residuals up to which they count as equal: second-order effects of exchanging
/// parameters, for errors of 0.3 mm on levers of 100 mm.
const SAME: f64 = 3e-3;

/// The list published for machines with this layout.
pub(crate) fn listed(machine: &Machine) -> Option<(Model, Vec<Parameter>)> {
    let lists = [Model::EightyOne, Model::EightyFour].into_iter();
    let mut fitting = lists.filter_map(|model| {
        let list = model.parameters(machine, 0, &[]).ok()?;
        Some((model, list))
    });
    fitting.next()
}

/// The list published for machines with this layout, if there is one and it was not chosen, compared with the model
/// chosen from the same probings.
#[must_use]
pub fn published(machine: &Machine, chosen: &Chosen) -> Option<Published> {
    let (model, list) = listed(machine)?;
    let level = &chosen.levels[chosen.chosen];
    let is_list = |level: &&Level| matches!(level.tried, TriedTerms::List(_));
    let of_list = chosen.levels.iter().find(is_list)?;
    let degree = match &level.tried {
        TriedTerms::List(_) => return None,
        TriedTerms::Fewest | TriedTerms::Locations => 0,
        TriedTerms::Degree(degree, _) => *degree,
        // Each is there because it helps, whatever its degree.
        TriedTerms::Added(_) => 0,
    };
    let identified = &chosen.identified;
    let kept: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
    let why = |p: Parameter| why(identified, p, degree);
    let is_kept = |p: &Parameter| kept.contains(p);
    let missing = list.iter().copied().filter(|p| !is_kept(p));
    Some(Published {
        model,
        count: list.len(),
        fit: of_list.found.clone(),
        kept: list.iter().copied().filter(is_kept).collect(),
        missing: missing.map(|p| (p, why(p))).collect(),
        besides: (kept.iter().copied())
            .filter(|p| !list.contains(p))
            .collect(),
        is_same: match (&of_list.found, &level.found) {
            (Ok(one), Ok(other)) => {
                one.parameters == other.parameters && (one.left / other.left - 1.0).abs() < SAME
            }
            _ => false,
        },
    })
}

/// Why a parameter is missing from a model up to this degree.
fn why(identified: &super::Identified, parameter: Parameter, degree: u8) -> Missing {
    let mut unseen = identified.unseen.iter();
    let one = unseen.find(|u| u.unknown == Unknown::Parameter(parameter));
    let is_confounded = one.map(|unseen| !unseen.with.is_empty());
    match (is_confounded, parameter.kind) {
        (Some(true), _) => Missing::Confounded,
        // Backlash is identified if rows state the direction from which the axis arrived.
        (Some(false), _) | (None, ParameterKind::Backlash) => Missing::Idle,
        (None, ParameterKind::Degree(0)) => Missing::Constant,
        (None, ParameterKind::Degree(k)) if k > degree => Missing::Degree,
        (None, _) => Missing::Form,
    }
}
