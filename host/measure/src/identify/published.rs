//! A list of coefficients that was published for machines of a layout, beside the model that was chosen: why they
//! differ.

use super::{Chosen, Fit, IdentifyError, Model, Unknown};
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// Why a published coefficient is not among the chosen ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// These probings cannot tell it from what was kept.
    Confounded,
    /// It does nothing at these probings, or no row says from which direction the axis came.
    Idle,
    /// The constant of an error motion: locations stand for it.
    Constant,
    /// Its degree is not worth it: balls that were left out are predicted no better.
    Degree,
    /// A polynomial of an axis that turns right round; harmonics predict balls that were left out better.
    Form,
}

/// The list beside what was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Which list.
    pub model: Model,
    /// How many coefficients it has.
    pub count: usize,
    /// What it does with the same probings, or why nothing can be identified with it.
    pub fit: Result<Fit, IdentifyError>,
    /// Those that were kept.
    pub kept: Vec<Parameter>,
    /// Those that were not.
    pub missing: Vec<(Parameter, Missing)>,
    /// What was kept besides.
    pub besides: Vec<Parameter>,
    /// True if both see as many, and leave the same: then they are the same errors in other coefficients.
    pub is_same: bool,
}

/// What both leave may differ by so small a part: second-order effects of what stands for what, of errors of 0.3 mm
/// over levers of 100 mm.
const SAME: f64 = 3e-3;

/// The list that was published for machines that are laid out like this one.
pub(super) fn listed(machine: &Machine) -> Option<(Model, Vec<Parameter>)> {
    let lists = [Model::EightyOne, Model::EightyFour].into_iter();
    let mut fitting = lists.filter_map(|model| {
        let list = model.parameters(machine, 0, &[]).ok()?;
        Some((model, list))
    });
    fitting.next()
}

/// The list that was published for machines that are laid out like this one, if there is one and it was not chosen,
/// beside what was chosen from the same probings.
#[must_use]
pub fn published(machine: &Machine, chosen: &Chosen) -> Option<Published> {
    let (model, list) = listed(machine)?;
    let level = &chosen.levels[chosen.chosen];
    let of_list = chosen.levels.iter().find(|level| level.list.is_some())?;
    if level.list.is_some() {
        return None;
    }
    let identified = &chosen.identified;
    let kept: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
    let is_confounded = |p: Parameter| {
        let mut unseen = identified.unseen.iter();
        let one = unseen.find(|u| u.unknown == Unknown::Parameter(p));
        one.map(|unseen| !unseen.with.is_empty())
    };
    let why = |p: Parameter| match (is_confounded(p), p.kind) {
        (Some(true), _) => Missing::Confounded,
        // Backlash is looked for where rows tell from where the axis came.
        (Some(false), _) | (None, ParameterKind::Backlash) => Missing::Idle,
        (None, ParameterKind::Degree(0)) => Missing::Constant,
        (None, ParameterKind::Degree(k)) if k > level.degree => Missing::Degree,
        (None, _) => Missing::Form,
    };
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
