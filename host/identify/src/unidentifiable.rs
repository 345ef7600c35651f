//! Parameters that the probings cannot identify.

use crate::Unknown;
use crate::factor::ScaledFactor;
use nalgebra::DMatrix;
use std::cmp::Reverse;
use trueaxis_model::errors::ParameterKind;

/// An unknown that cannot be separated from others.
#[derive(Clone, Debug, PartialEq)]
pub struct Unseen {
    /// The unknown that has no value.
    pub unknown: Unknown,
    /// The unknowns that it is confounded with, and how far each of them is off: the value found for it is the true
    /// one plus this times the true value of `unknown`.
    pub with: Vec<(Unknown, f64)>,
    /// Use of the spindle.
    pub spindle: ProbedSpindle,
}

/// The spindle in the probings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProbedSpindle {
    /// The axis of its frame along which the stylus points (0, 1, 2).
    pub tool_axis: usize,
    /// True if it was used at more than one angle.
    pub is_indexed: bool,
}

/// Parts of a confounded combination below this fraction of the largest effect at the probings are not reported.
const NAMED: f64 = 0.01;
/// An unknown may be given up if its part in an unidentifiable combination is at least this fraction of the largest
/// part.
const PART: f64 = 0.3;
/// Parts below this are rounding.
const NOTHING: f64 = 1e-6;

/// An unknown that is given up, by its index, and the changes of the others per unit of it that they absorb.
#[derive(Clone, Debug)]
pub(crate) struct GivenUp {
    pub number: usize,
    pub others: Vec<(usize, f64)>,
    pub unseen: Unseen,
}

impl GivenUp {
    /// An unknown without any effect.
    pub fn idle(number: usize, unknown: Unknown, spindle: ProbedSpindle) -> Self {
        Self {
            number,
            others: Vec::new(),
            unseen: Unseen {
                unknown,
                with: Vec::new(),
                spindle,
            },
        }
    }
}

/// Gives up unknowns, in addition to those that are `gone`, until no combination has a singular value at or below
/// `least`. Returns the factor of the remaining ones.
pub(crate) fn seen(
    (unknowns, spindle): (&[Unknown], ProbedSpindle),
    factor: ScaledFactor,
    gone: Vec<GivenUp>,
    least: f64,
) -> (ScaledFactor, Vec<GivenUp>) {
    let mut all = gone;
    let is_left = |i: &usize| all.iter().all(|g| g.number != *i);
    let left: Vec<usize> = factor.unknowns().iter().copied().filter(is_left).collect();
    let mut factor = factor.of(&left);
    loop {
        let hidden = factor.hidden(least);
        if hidden.ncols() == 0 {
            return (factor, all);
        }
        let numbers = factor.unknowns();
        let left: Vec<Unknown> = numbers.iter().map(|i| unknowns[*i]).collect();
        let more = given_up(&left, &hidden, &factor.units(), spindle);
        let is_left = |place: &usize| more.iter().all(|g| g.number != *place);
        let kept: Vec<usize> = (0..left.len())
            .filter(is_left)
            .map(|i| numbers[i])
            .collect();
        all.extend(more.into_iter().map(|g| {
            GivenUp {
                number: numbers[g.number],
                others: (g.others.iter())
                    .map(|(i, part)| (numbers[*i], *part))
                    .collect(),
                unseen: g.unseen,
            }
        }));
        factor = factor.of(&kept);
    }
}

/// Picks one unknown for each combination that cannot be identified: orthonormal columns of `hidden`, in units in
/// which each unknown alone has the same effect at the probings; `units` are these.
fn given_up(
    unknowns: &[Unknown],
    hidden: &DMatrix<f64>,
    units: &[f64],
    spindle: ProbedSpindle,
) -> Vec<GivenUp> {
    let chosen = dispensable(unknowns, hidden);
    // The change of the others that compensates for each of them.
    let own = DMatrix::from_fn(chosen.len(), hidden.ncols(), |i, j| hidden[(chosen[i], j)]);
    let made_up = match own.try_inverse() {
        Some(inverse) => hidden * inverse,
        None => DMatrix::zeros(unknowns.len(), chosen.len()),
    };
    let others = |column: usize, least: f64| -> Vec<(usize, f64)> {
        (0..unknowns.len())
            .filter(|i| !chosen.contains(i) && made_up[(*i, column)].abs() > least)
            .map(|i| (i, -made_up[(i, column)] * units[i] / units[chosen[column]]))
            .collect()
    };
    let of = |column: usize| {
        let named = others(column, NAMED).into_iter();
        let mut with: Vec<(Unknown, f64)> = named.map(|(i, part)| (unknowns[i], part)).collect();
        with.sort_by_key(|(unknown, _)| Reverse(unknown.dispensable()));
        GivenUp {
            number: chosen[column],
            others: others(column, 0.0),
            unseen: Unseen {
                unknown: unknowns[chosen[column]],
                with,
                spindle,
            },
        }
    };
    (0..chosen.len()).map(of).collect()
}

/// The unknowns that are given up, by index.
fn dispensable(unknowns: &[Unknown], hidden: &DMatrix<f64>) -> Vec<usize> {
    let mut rest = hidden.clone();
    let mut chosen: Vec<usize> = Vec::new();
    while rest.ncols() > 0 {
        let part = |i: usize| rest.row(i).norm();
        let is_parameter = |i: &usize| unknowns[*i].parameter().is_some();
        let all = || (0..unknowns.len()).filter(|i| !chosen.contains(i));
        let largest = all().filter(is_parameter).map(part).fold(0.0, f64::max);
        // If no parameter is part of it, it is the setup.
        let setup = largest < NOTHING;
        let largest = if setup {
            all().map(part).fold(0.0, f64::max)
        } else {
            largest
        };
        let candidates = all().filter(|i| (setup || is_parameter(i)) && part(*i) >= PART * largest);
        let Some(next) = candidates.max_by_key(|i| (unknowns[*i].dispensable(), *i)) else {
            break;
        };
        rest = without(&rest, next);
        chosen.push(next);
    }
    chosen
}

/// An orthonormal basis of the combinations of columns in which a row has no part.
fn without(columns: &DMatrix<f64>, row: usize) -> DMatrix<f64> {
    let part = columns.row(row).transpose();
    let Some(unit) = part.try_normalize(f64::MIN_POSITIVE) else {
        return columns.columns(1, columns.ncols() - 1).into_owned();
    };
    // A reflection that turns the row's part into the first column, which is removed.
    let mut mirror = unit.clone();
    mirror[0] += if unit[0] < 0.0 { -1.0 } else { 1.0 };
    let norm = mirror.norm_squared();
    let reflected = columns - (columns * &mirror) * mirror.transpose() * (2.0 / norm);
    reflected.columns(1, columns.ncols() - 1).into_owned()
}

impl Unseen {
    /// How to separate it from the position of the stylus.
    fn stylus_remedy(&self) -> &'static str {
        let is_along = |(u, _): &(Unknown, f64)| *u == Unknown::Stylus(self.spindle.tool_axis);
        match (self.with.iter().any(is_along), self.spindle.is_indexed) {
            (true, _) => {
                "give the length of the stylus with its uncertainty (length_standard_uncertainty_mm in the artefact)"
            }
            (false, false) => {
                "index the spindle; if it cannot be oriented, zero the stylus for run-out and state x_mm and y_mm with their standard uncertainties under [stylus] in the artefact"
            }
            (false, true) => "index the spindle by half a turn, at more rotary positions",
        }
    }

    /// A sentence about it.
    #[must_use]
    pub fn sentence(&self) -> String {
        grouped(&[self]).remove(0).0
    }

    fn reason(&self) -> Reason {
        let parameters = self.names(|u| u.parameter().is_some());
        let scales = |(u, part): &&(Unknown, f64)| is_scale(u) && (part.abs() - 1.0).abs() < 0.05;
        let common = self.with.iter().filter(scales).count();
        let from = |with: Vec<String>, remedy: &str| reason(Says::From(with.join(", ")), remedy);
        if is_scale(&self.unknown) && common == 2 {
            return Reason {
                says: Says::Scale(parameters.join(", ")),
                remedy: format!(
                    "there is no length reference (a bar in the artefact), so they are relative to {}",
                    self.unknown
                ),
            };
        }
        let stylus = self.names(|u| matches!(u, Unknown::Stylus(_)));
        if !stylus.is_empty() {
            return from([stylus, parameters].concat(), self.stylus_remedy());
        }
        let setup = self.names(|u| matches!(u, Unknown::Setup(..) | Unknown::Tool(..)));
        if !setup.is_empty() {
            return from(
                [setup, parameters].concat(),
                "state the set-up as far as it is known, or observe at more positions",
            );
        }
        if !parameters.is_empty() {
            return from(parameters, "");
        }
        if !self.with.is_empty() {
            return from(vec!["the balls' locations".to_owned()], "");
        }
        match self.unknown {
            Unknown::Parameter(p) if p.kind == ParameterKind::Backlash => reason(
                Says::NotKnown,
                "no row says from which direction the axis came (a column such as A_dir)",
            ),
            _ => reason(Says::Idle, ""),
        }
    }

    /// Some of those that it cannot be distinguished from.
    fn names(&self, is_in: fn(&Unknown) -> bool) -> Vec<String> {
        let all = self.with.iter().map(|(unknown, _)| unknown);
        let mut names: Vec<String> = all.filter(|u| is_in(u)).map(Unknown::to_string).collect();
        names.dedup();
        names
    }
}

/// Why an unknown has no value, and what would give it one.
#[derive(PartialEq)]
struct Reason {
    says: Says,
    /// Empty if there is nothing to say.
    remedy: String,
}

#[derive(PartialEq)]
enum Says {
    /// It cannot be distinguished from these.
    From(String),
    /// It differs from these by a common scale.
    Scale(String),
    NotKnown,
    Idle,
}

impl Reason {
    /// True if one sentence can say both.
    fn is_like(&self, other: &Self) -> bool {
        let is_from = |one: &Self| matches!(one.says, Says::From(_));
        self.remedy == other.remedy
            && (self.says == other.says || (is_from(self) && is_from(other)))
    }
}

/// Most names in brackets.
const NAMES: usize = 2;

/// A sentence for each remedy, with the unknowns (by index) that it is about.
#[must_use]
pub fn grouped(all: &[&Unseen]) -> Vec<(String, Vec<usize>)> {
    let reasons: Vec<Reason> = all.iter().map(|one| one.reason()).collect();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (i, reason) in reasons.iter().enumerate() {
        match groups.iter_mut().find(|g| reasons[g[0]].is_like(reason)) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    let said = groups.iter().map(|group| said(all, &reasons, group));
    said.collect::<Vec<String>>()
        .into_iter()
        .zip(groups)
        .collect()
}

/// What is said of the unknowns with one remedy.
fn said(all: &[&Unseen], reasons: &[Reason], group: &[usize]) -> String {
    let first = &reasons[group[0]];
    let is_same = group.iter().all(|i| reasons[*i].says == first.says);
    let name = |i: &usize| match &reasons[*i].says {
        Says::From(with) if !is_same => {
            let mut first: Vec<&str> = with.split(", ").collect();
            if first.len() > NAMES {
                first.truncate(NAMES);
                first.push("…");
            }
            format!("{} ({})", all[*i].unknown, first.join(", "))
        }
        _ => all[*i].unknown.to_string(),
    };
    let names: Vec<String> = group.iter().map(name).collect();
    let (names, is_one) = (names.join(", "), group.len() == 1);
    let says = match &first.says {
        Says::From(with) if is_same => format!("{names} cannot be distinguished from {with}"),
        Says::From(_) => {
            format!("{names} cannot be distinguished from those in brackets")
        }
        Says::Scale(others) => format!("{names} and {others} differ by a common scale only"),
        Says::NotKnown => format!("{names} {} not known", if is_one { "is" } else { "are" }),
        Says::Idle => format!(
            "{names} {} nothing at these positions",
            if is_one { "does" } else { "do" }
        ),
    };
    match first.remedy.is_empty() {
        true => says,
        false => format!("{says}: {}", first.remedy),
    }
}

/// True for the scale of a linear axis.
fn is_scale(unknown: &Unknown) -> bool {
    match unknown {
        Unknown::Parameter(p) => {
            p.kind == ParameterKind::Degree(1)
                && "XYZUVW".find(p.axis).is_some_and(|i| i % 3 == p.component)
        }
        _ => false,
    }
}

fn reason(says: Says, remedy: &str) -> Reason {
    Reason {
        says,
        remedy: remedy.to_owned(),
    }
}
