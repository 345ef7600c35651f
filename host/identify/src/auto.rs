//! Chooses the complexity of the model by what it predicts elsewhere.

use crate::candidates::{RotationForm, candidates, fewest, holds, of_degree};
use crate::elsewhere::{Elsewhere, Predicted};
use crate::formats::observations::{Drift, Observations};
use crate::published::listed;
use crate::rows::EquationWeights;
use crate::structure::SEEN;
use crate::{
    Identified, IdentifyError, IdentifyOptions, Measured, Model, Problem, Unknown, drifting,
    identify, root_mean_square,
};
use std::fmt;
use trueaxis_model::errors::Parameter;
use trueaxis_model::numbers::order;

/// A model that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// What it is.
    pub tried: TriedTerms,
    /// The result, or why there is none; higher degrees are not tried then.
    pub found: Result<Fit, IdentifyError>,
}

/// What a model has.
#[derive(Clone, Debug, PartialEq)]
pub enum TriedTerms {
    /// The fewest locations and scales, and backlash: what the fixed models have.
    Fewest,
    /// All locations and scales, and backlash.
    Locations,
    /// A location model with every error motion up to a degree of polynomials and harmonics, in this form for axes that
    /// rotate by a full turn.
    Degree(u8, RotationForm),
    /// The published list for machines of this layout.
    List(Model),
    /// The fewest, and these, which were added one after the other as long as that predicts other positions better.
    Added(Vec<Parameter>),
}

impl fmt::Display for TriedTerms {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fewest => f.write_str("fewest"),
            Self::Locations => f.write_str("locations and scales"),
            Self::Degree(degree, RotationForm::Harmonics) => write!(f, "degree {degree}"),
            Self::Degree(degree, RotationForm::Polynomials) => {
                write!(f, "degree {degree}, polynomials")
            }
            Self::List(model) => write!(f, "--model {model}"),
            Self::Added(parameters) => {
                write!(f, "fewest and {}", Model::Named(parameters.clone()))
            }
        }
    }
}

/// Result for one model.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Number of its parameters that can be identified.
    pub parameters: usize,
    /// Number of its parameters that cannot be identified.
    pub unseen: usize,
    /// Residual at the rows it was fitted to (mm, root mean square distance).
    pub left: f64,
    /// How far off (mm, root mean square distance) it is where it was not fitted: in zones of the travel of one axis,
    /// predicted from the other zones, and over the travel by the uncertainty of its parameters. `None` if no axis has two
    /// zones.
    pub elsewhere: Option<f64>,
}

impl Level {
    /// True if there is nothing to compare higher degrees with.
    fn is_end(&self) -> bool {
        !matches!(&self.found, Ok(fit) if fit.elsewhere.is_some())
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

/// What all models are identified from.
#[derive(Clone, Copy)]
struct AutoInputs<'a> {
    measured: Measured<'a>,
    options: IdentifyOptions,
}

impl AutoInputs<'_> {
    /// The observations, and drift together with which they fit.
    fn with_drift(&self, directions: &[bool]) -> Result<Observations, IdentifyError> {
        let machine = self.measured.machine;
        let mut observations = self.measured.observations.clone();
        if observations.drift.is_empty() {
            // What a simple model leaves is no noise, but it does not drift either.
            let simple = candidates(machine, 0, RotationForm::Harmonics, directions);
            let problem = self.measured.problem(&simple);
            if problem.has_times() {
                observations.drift = drifting(&problem, &identify(&problem, self.options)?);
            }
        }
        Ok(observations)
    }

    /// Identifies given parameters, and predicts with them; rows weigh as these `weights` say, or as they did.
    fn found(
        &self,
        parameters: &[Parameter],
        weights: Option<&EquationWeights>,
    ) -> Result<(Identified, Fit, Option<Predicted>), IdentifyError> {
        let allowed = parameters.iter().copied().filter(|p| self.is_allowed(p));
        let problem = self.measured.problem(&allowed.collect::<Vec<_>>());
        let mut identified = identify(&problem, self.options)?;
        let options = IdentifyOptions {
            least: told(&problem, &identified),
            ..self.options
        };
        if options.least > SEEN {
            identified = identify(&problem, options)?;
        }
        let place = &identified.place;
        let kept = place.factor.unknowns().iter();
        let kept: Vec<Unknown> = kept.map(|i| problem.unknowns[*i]).collect();
        let weights = weights.unwrap_or(&place.weights);
        let elsewhere = Elsewhere::new(&problem, &place.estimate, weights, &kept);
        let all: Vec<usize> = (0..kept.len()).collect();
        let predicted = elsewhere.map(|elsewhere| elsewhere.predicted(&all));
        let fit = Fit {
            parameters: identified.parameters.len(),
            unseen: identified.looked_for.len() - identified.parameters.len(),
            left: root_mean_square(identified.all_rows().map(|row| row.after.norm())),
            elsewhere: predicted.as_ref().map(Predicted::off),
        };
        Ok((identified, fit, predicted))
    }

    /// False for a motion that a table gives, and for one that holds its end values where a table of its axis reaches
    /// farther than what was measured: the table would end there, too.
    fn is_allowed(&self, parameter: &Parameter) -> bool {
        let Measured { machine, base, .. } = self.measured;
        let axis = machine.index(parameter.axis);
        let is_cut = |axis: usize| {
            let [low, high] = self.measured.problem(&[]).range(axis);
            let least = BEYOND * (high - low);
            let tables = base.motions[axis].iter().filter_map(|m| m.table.as_ref());
            let mut ends = tables.filter_map(|t| Some((*t.at.first()?, *t.at.last()?)));
            ends.any(|(first, last)| first < low - least || last > high + least)
        };
        let has_tables = |axis: &usize| base.motions[*axis].iter().any(|m| m.table.is_some());
        let axis = axis.filter(|axis| has_tables(axis) && holds(machine, parameter));
        !base.is_tabulated(machine, parameter) && !axis.is_some_and(is_cut)
    }

    /// What may be added together: one location or scale, or one error motion in a range of degrees.
    fn groups(&self, forms: &[RotationForm], directions: &[bool]) -> Vec<Vec<Parameter>> {
        let machine = self.measured.machine;
        let single = candidates(machine, 0, RotationForm::Harmonics, directions).into_iter();
        let mut groups: Vec<Vec<Parameter>> = single.map(|parameter| vec![parameter]).collect();
        for form in forms {
            for axis in &machine.axes {
                for component in 0..6 {
                    for (from, to) in RANGES {
                        let degrees = from..=to;
                        let all = degrees.flat_map(|k| of_degree(axis, component, k, *form));
                        let group: Vec<Parameter> = all.collect();
                        if !groups.contains(&group) {
                            groups.push(group);
                        }
                    }
                }
            }
        }
        groups
    }

    /// True if another motion explains the readings as well as a parameter of a result does, and puts the tip elsewhere over
    /// the travel by more than the result claims to be off: with one circle, a screw that bends and an axis that yaws are the
    /// same. What the simplest model has is no matter of choice.
    fn is_ambiguous(
        &self,
        of: &Identified,
        simplest: &[Parameter],
        weights: &EquationWeights,
        directions: &[bool],
    ) -> bool {
        let forms = RotationForm::of(self.measured.machine);
        let mut others: Vec<Parameter> = self.groups(forms, directions).concat();
        others.sort_unstable();
        others.dedup();
        others.retain(|p| !of.looked_for.contains(p) && self.is_allowed(p));
        let problem = self.measured.problem(&of.looked_for);
        let kept = of.place.factor.unknowns().iter();
        let mut unknowns: Vec<Unknown> = kept.map(|i| problem.unknowns[*i]).collect();
        let all: Vec<usize> = (0..unknowns.len()).collect();
        unknowns.extend(others.iter().copied().map(Unknown::Parameter));
        let elsewhere = Elsewhere::new(&problem, &of.place.estimate, weights, &unknowns);
        let Some(elsewhere) = elsewhere else {
            return false;
        };
        let this = elsewhere.predicted(&all);
        let shows = SHOWS * SHOWS * elsewhere.variance(&all);
        let is_chosen = |i: &&usize| match unknowns[**i] {
            Unknown::Parameter(parameter) => !simplest.contains(&parameter),
            _ => false,
        };
        all.iter().filter(is_chosen).any(|own| {
            let rest: Vec<usize> = all.iter().copied().filter(|i| i != own).collect();
            let motion = |i: usize| unknowns[i].parameter().map(|(p, _)| (p.axis, p.component));
            let others = (all.len()..unknowns.len()).filter(|i| motion(*i) != motion(*own));
            let one = std::iter::once(*own).chain(others);
            let groups: Vec<Vec<usize>> = one.map(|i| vec![i]).collect();
            let gains = elsewhere.gains(&rest, &groups);
            if gains[0] < shows {
                return false;
            }
            let order = order(&gains.iter().map(|gain| -gain).collect::<Vec<_>>());
            let is_rival = |i: &&usize| **i > 0 && gains[**i] >= AS_GOOD * gains[0];
            let rivals = order.iter().filter(is_rival);
            rivals.take(TRIED).any(|i| {
                let other = elsewhere.predicted(&[&rest[..], &groups[*i]].concat());
                other.contradicts(&this)
            })
        })
    }

    /// What is worth being added to the parameters of a result: one error motion up to one degree, or one location or scale,
    /// after the other.
    fn added(
        &self,
        of: &Identified,
        forms: &[RotationForm],
        directions: &[bool],
    ) -> Vec<Parameter> {
        let groups = self.groups(forms, directions);
        let mut all: Vec<Parameter> = groups.concat();
        all.sort_unstable();
        all.dedup();
        all.retain(|p| !of.looked_for.contains(p) && self.is_allowed(p));
        let problem = self.measured.problem(&of.looked_for);
        let place = &of.place;
        let kept = place.factor.unknowns().iter();
        let mut unknowns: Vec<Unknown> = kept.map(|i| problem.unknowns[*i]).collect();
        let first = unknowns.len();
        unknowns.extend(all.iter().copied().map(Unknown::Parameter));
        let number = |p: &Parameter| {
            let own = Unknown::Parameter(*p);
            unknowns.iter().position(|unknown| *unknown == own)
        };
        let groups: Vec<Vec<usize>> = (groups.iter())
            .map(|group| group.iter().filter_map(number).collect())
            .collect();
        let elsewhere = Elsewhere::new(&problem, &place.estimate, &place.weights, &unknowns);
        let taken = elsewhere.map_or(Vec::new(), |elsewhere| grown(&elsewhere, &groups, first));
        taken.iter().map(|i| all[*i - first]).collect()
    }
}

/// Of the unknowns from `first` on, those worth being added, one group after the other.
fn grown(elsewhere: &Elsewhere, groups: &[Vec<usize>], first: usize) -> Vec<usize> {
    let mut taken: Vec<usize> = (0..first).collect();
    let fewest = elsewhere.predicted(&taken);
    let (mut off, mut worth) = (fewest.off(), first);
    let mut best = fewest.clone();
    // One alone may bring little while others are missing: go on, and judge what has come together.
    loop {
        let is_new = |i: &usize| !taken.contains(i);
        let rest = groups.iter();
        let rest = rest.map(|group| group.iter().copied().filter(is_new).collect());
        let mut rest: Vec<Vec<usize>> = rest.filter(|group: &Vec<_>| !group.is_empty()).collect();
        rest.sort_unstable();
        rest.dedup();
        let gains = elsewhere.gains(&taken, &rest);
        let losses: Vec<f64> = gains.iter().map(|gain| -gain).collect();
        let order = order(&losses);
        let tried = order.iter().take(TRIED).map(|i| {
            let with = [&taken[..], &rest[*i]].concat();
            (elsewhere.predicted(&with), with)
        });
        let next = tried.min_by(|a, b| a.0.off().total_cmp(&b.0.off()));
        let Some((predicted, with)) = next.filter(|(next, _)| next.off() < off) else {
            break;
        };
        (off, taken) = (predicted.off(), with);
        if predicted.is_better(&best, &fewest) {
            (best, worth) = (predicted, taken.len());
        }
    }
    taken[first..worth].to_vec()
}

/// Something else is as good if it explains this part of what a parameter explains.
const AS_GOOD: f64 = 0.95;
/// What explains less than these many standard deviations may be chance.
const SHOWS: f64 = 4.0;
/// Tables may reach this part of the measured range beyond it.
const BEYOND: f64 = 0.1;
/// Ranges of degrees of an error motion that are added together. Degree 1 of many motions is a location.
const RANGES: [(u8, u8); 6] = [(1, 1), (2, 2), (1, 2), (3, 3), (2, 3), (1, 3)];
/// Of what may be added, so many that explain most of what is left are tried.
const TRIED: usize = 8;

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

/// Identifies with the fewest parameters, with all locations, with error motions added to the fewest one after the other,
/// with every degree in every form, and with the list published for machines of this layout. Each in turn is taken if it
/// predicts so much better elsewhere that it is worth it.
///
/// # Errors
/// [`IdentifyError`] if not even the simplest model can be identified.
pub fn automatic(
    measured: &Measured<'_>,
    options: IdentifyOptions,
) -> Result<Chosen, IdentifyError> {
    let Measured {
        machine,
        probings,
        observations,
        ..
    } = *measured;
    let directions: Vec<bool> = (0..machine.axes.len())
        .map(|i| {
            let probed = probings.rows.iter().map(|row| row.direction[i]);
            let observed = observations.rows.iter().map(|row| row.direction[i]);
            probed.chain(observed).any(|direction| direction != 0.0)
        })
        .collect();
    let mut inputs = AutoInputs {
        measured: *measured,
        options,
    };
    let observations = inputs.with_drift(&directions)?;
    inputs.measured.observations = &observations;
    let mut tried = TriedModels::simplest(inputs, &directions)?;
    if tried.fewest.is_some() {
        tried.attempt_others();
    }
    Ok(tried.chosen)
}

/// The models tried so far.
struct TriedModels<'a> {
    inputs: AutoInputs<'a>,
    /// Which axes have rows with a direction of travel.
    directions: &'a [bool],
    /// What the simplest model has.
    simplest: Vec<Parameter>,
    /// How much rows count in all of them.
    weights: EquationWeights,
    /// Predictions by the simplest and by the chosen one.
    fewest: Option<Predicted>,
    best: Option<Predicted>,
    chosen: Chosen,
}

impl<'a> TriedModels<'a> {
    fn simplest(inputs: AutoInputs<'a>, directions: &'a [bool]) -> Result<Self, IdentifyError> {
        let Measured {
            machine,
            artefact,
            observations,
            ..
        } = inputs.measured;
        let has_length = !artefact.bars.is_empty() || !observations.rows.is_empty();
        let parameters = fewest(machine, has_length, directions);
        let (identified, fit, predicted) = inputs.found(&parameters, None)?;
        Ok(Self {
            inputs,
            directions,
            simplest: parameters,
            weights: identified.place.weights.clone(),
            fewest: predicted.clone(),
            best: predicted,
            chosen: Chosen {
                identified,
                levels: vec![Level {
                    tried: TriedTerms::Fewest,
                    found: Ok(fit),
                }],
                chosen: 0,
                drift: observations.drift.clone(),
            },
        })
    }

    fn attempt_others(&mut self) {
        let directions = self.directions;
        let machine = self.inputs.measured.machine;
        let simplest = self.chosen.identified.clone();
        let forms = RotationForm::of(machine);
        let parameters = candidates(machine, 0, RotationForm::Harmonics, directions);
        self.attempt(TriedTerms::Locations, &parameters);
        let added = self.inputs.added(&simplest, forms, directions);
        if !added.is_empty() {
            let parameters = [&simplest.looked_for[..], &added].concat();
            self.attempt(TriedTerms::Added(added), &parameters);
        }
        for form in forms {
            for degree in 1..=HIGHEST {
                let parameters = candidates(machine, degree, *form, directions);
                // A higher degree has even more unknowns.
                if self.attempt(TriedTerms::Degree(degree, *form), &parameters) {
                    break;
                }
            }
        }
        // Coefficients can replace each other; which of them are used affects how well they are determined.
        if let Some((list, parameters)) = listed(machine) {
            self.attempt(TriedTerms::List(list), &parameters);
        }
    }

    /// Takes a model if it predicts better. True if there is nothing to compare higher degrees with.
    fn attempt(&mut self, tried: TriedTerms, parameters: &[Parameter]) -> bool {
        let found = self.inputs.found(parameters, Some(&self.weights));
        let found = found.map(|(identified, fit, this)| {
            // Without a comparison, no model is better than the simplest.
            if let (Some(this), Some(last), Some(fewest)) = (this, &self.best, &self.fewest)
                && this.is_better(last, fewest)
                && !self.inputs.is_ambiguous(
                    &identified,
                    &self.simplest,
                    &self.weights,
                    self.directions,
                )
            {
                self.best = Some(this);
                self.chosen.identified = identified;
                self.chosen.chosen = self.chosen.levels.len();
            }
            fit
        });
        let level = Level { tried, found };
        let is_end = level.is_end();
        self.chosen.levels.push(level);
        is_end
    }
}
