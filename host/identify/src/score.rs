//! Which error motion that the model lacks explains the residuals best: score tests.

use crate::candidates::{RotationForm, candidates};
use crate::identified::Solution;
use crate::snooping::deviations;
use crate::{Identified, Problem, Unknown};
use nalgebra::{DMatrix, DVector};
use std::fmt;
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::numbers::extremes;

/// An error motion, or a location error, that the model lacks.
#[derive(Clone, Debug, PartialEq)]
pub struct Lacking {
    /// The parameters to add.
    pub parameters: Vec<Parameter>,
    /// The first parameter of each other motion that explains as much: these measurements do not tell which it is.
    pub others: Vec<Parameter>,
    /// The part of the sum of squared residuals, in units of their standard uncertainties, that goes with it.
    pub explains: f64,
    /// By how much the motion varies over the positions that were measured (mm or rad).
    pub size: f64,
    /// Chance explains as much as a normal distribution gives this many standard deviations.
    pub deviations: f64,
}

/// Chance gives one of some fifty candidates this many standard deviations less than once in a thousand.
const SIGNIFICANT: f64 = 4.1;
/// An error motion that varies by more (mm or rad) is none of a machine: rows where it does nothing are explained by rounding.
const LARGEST: f64 = 1.0;
/// A motion that explains this part of what the best one does explains as much.
const AS_MUCH: f64 = 0.95;
/// The fraction of its effect that the unknowns must not be able to absorb.
const TESTABLE: f64 = 0.1;
/// Degrees and harmonics up to this are tried.
const HIGHEST: u8 = 3;

/// The motion that explains the residuals of an identification best, if chance does not: of degrees 1 to 3 (or
/// harmonics), a location error, or backlash.
#[must_use]
pub fn lacking(problem: &Problem<'_>, identified: &Identified) -> Option<Lacking> {
    let place = &identified.place;
    let residuals = Residuals {
        problem,
        identified,
        left: problem.residuals(&place.estimate, &place.weights),
        jacobian: problem.jacobian(&place.estimate, &place.weights),
    };
    let directions: Vec<bool> = (0..problem.machine.axes.len())
        .map(|i| problem.commands().any(|(_, s)| s.sign[i] != 0.0))
        .collect();
    let mut all: Vec<(f64, Lacking)> = Vec::new();
    for form in RotationForm::of(problem.machine) {
        for group in residuals.groups(*form, &directions) {
            let found = residuals.explanations(&group)?.into_iter();
            let counts =
                |(_, one): &(f64, Lacking)| one.deviations > SIGNIFICANT && one.size < LARGEST;
            all.extend(found.filter(counts));
        }
    }
    let best = all.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, best)| {
        let own = group(&best.parameters[0]);
        let is_other = |one: &&Lacking| group(&one.parameters[0]) != own;
        let as_much = |one: &&Lacking| one.explains >= AS_MUCH * best.explains;
        let others = all
            .iter()
            .map(|(_, one)| one)
            .filter(is_other)
            .filter(as_much);
        let mut others: Vec<Parameter> = others.map(|one| one.parameters[0]).collect();
        others.sort_unstable();
        others.dedup();
        Lacking {
            others,
            ..best.clone()
        }
    })
}

/// What an identification leaves.
struct Residuals<'a> {
    problem: &'a Problem<'a>,
    identified: &'a Identified,
    left: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl Residuals<'_> {
    /// The parameters that the model may lack, those that are tested together by their degrees.
    fn groups(&self, form: RotationForm, directions: &[bool]) -> Vec<Vec<Parameter>> {
        let (machine, base) = (self.problem.machine, &self.problem.base);
        let all = [0, HIGHEST].map(|degree| candidates(machine, degree, form, directions));
        let looked_for = &self.identified.looked_for;
        let is_new = |p: &Parameter| !looked_for.contains(p) && !base.is_tabulated(machine, p);
        let mut all: Vec<Parameter> = all.concat().into_iter().filter(is_new).collect();
        all.sort();
        all.dedup();
        let mut groups: Vec<Vec<Parameter>> = Vec::new();
        for parameter in all {
            let own = |g: &&mut Vec<Parameter>| group(&g[0]) == group(&parameter);
            match groups.iter_mut().find(own) {
                Some(group) => group.push(parameter),
                None => groups.push(vec![parameter]),
            }
        }
        groups
            .iter_mut()
            .for_each(|group| group.sort_by_key(degree));
        groups
    }

    /// What each degree of a group explains together with the lower ones, and its criterion. `None` if a change is not finite.
    fn explanations(&self, group: &[Parameter]) -> Option<Vec<(f64, Lacking)>> {
        let place = &self.identified.place;
        let mut free = Free::default();
        let (mut taken, mut explanations) = (Vec::new(), Vec::new());
        for (k, parameter) in group.iter().enumerate() {
            let mut column = column(self.problem, place, parameter);
            let whole = column.norm();
            if whole == 0.0 {
                continue;
            }
            let step = place.factor.step(&self.jacobian.tr_mul(&column))?;
            column += &self.jacobian * step;
            if !free.add(column, whole, &self.left) {
                continue;
            }
            taken.push(k);
            // Sine and cosine of one angle belong together.
            if group.get(k + 1).map(degree) != Some(degree(parameter)) {
                explanations.extend(self.explanation(&group[..=k], &taken, &free));
            }
        }
        Some(explanations)
    }

    fn explanation(
        &self,
        group: &[Parameter],
        taken: &[usize],
        free: &Free,
    ) -> Option<(f64, Lacking)> {
        let (left, terms) = (&self.left, taken.len());
        let rest = left.norm_squared() - free.gain;
        let freedom = self
            .identified
            .freedom
            .checked_sub(terms)
            .filter(|n| *n > 0)?;
        let not_zero = rest.max(f64::MIN_POSITIVE);
        let ratio = (free.gain / terms as f64) / (not_zero / freedom as f64);
        // The Bayesian information criterion weighs terms against what they explain.
        let count = left.len() as f64;
        let criterion = count * libm::log(not_zero) + terms as f64 * libm::log(count);
        let found = Lacking {
            // A power from the middle of the range is made of all lower ones.
            parameters: group.to_vec(),
            others: Vec::new(),
            explains: free.gain / left.norm_squared(),
            size: size(self.problem, group, taken, &free.values(left)),
            deviations: deviations(ratio, terms, freedom),
        };
        Some((criterion, found))
    }
}

/// What is tested together: a motion, a location error, a backlash.
fn group(p: &Parameter) -> (char, usize, u8) {
    let what = match p.kind {
        ParameterKind::Inter => 0,
        ParameterKind::Backlash => 1,
        _ => 2,
    };
    (p.axis, p.component, what)
}

fn degree(p: &Parameter) -> u8 {
    match p.kind {
        ParameterKind::Inter | ParameterKind::Backlash => 0,
        ParameterKind::Degree(k) | ParameterKind::Cosine(k) | ParameterKind::Sine(k) => k,
    }
}

/// Columns without what unknowns can absorb, made orthonormal.
#[derive(Default)]
struct Free {
    basis: Vec<DVector<f64>>,
    /// Each as a combination of the columns.
    made_of: Vec<DVector<f64>>,
    gain: f64,
}

impl Free {
    /// Adds a column; false if too little of it is new.
    fn add(&mut self, mut column: DVector<f64>, whole: f64, left: &DVector<f64>) -> bool {
        let count = self.basis.len();
        let mut of = DVector::zeros(count + 1);
        of[count] = 1.0;
        for (unit, made_of) in self.basis.iter().zip(&self.made_of) {
            let part = unit.dot(&column);
            column.axpy(-part, unit, 1.0);
            for (of, made_of) in of.iter_mut().zip(made_of.iter()) {
                *of -= part * made_of;
            }
        }
        let size = column.norm();
        // Higher degrees on the same positions are much alike: what is absorbed by lower ones is not lost.
        let least = if count == 0 {
            TESTABLE
        } else {
            TESTABLE * TESTABLE
        };
        if size <= least * whole {
            return false;
        }
        let unit = column / size;
        self.gain += unit.dot(left).powi(2);
        self.basis.push(unit);
        self.made_of.push(of / size);
        true
    }

    /// The values of the columns that make up for the residuals.
    fn values(&self, left: &DVector<f64>) -> Vec<f64> {
        let mut values = vec![0.0; self.basis.len()];
        for (unit, made_of) in self.basis.iter().zip(&self.made_of) {
            let part = -unit.dot(left);
            for (value, of) in values.iter_mut().zip(made_of.iter()) {
                *value += part * of;
            }
        }
        values
    }
}

/// A term at a position: a power of the position from the middle of the range over half of it, which is not nearly
/// constant far from zero as the power of the position is.
fn basis(p: &Parameter, q: f64, [low, high]: [f64; 2]) -> f64 {
    match p.kind {
        ParameterKind::Degree(k) if high > low => {
            (2.0 * (q - low) / (high - low) - 1.0).powi(i32::from(k))
        }
        kind => kind.basis(q),
    }
}

/// The effect of a term on all equations.
fn column(problem: &Problem<'_>, place: &Solution, p: &Parameter) -> DVector<f64> {
    let by = |p: Parameter| {
        let unknown = [Unknown::Parameter(p)];
        let by = problem.derivatives(&unknown, &place.estimate, &place.weights);
        by.column(0).into_owned()
    };
    let (ParameterKind::Degree(_), Some(axis)) = (p.kind, problem.machine.index(p.axis)) else {
        return by(*p);
    };
    let mut column = by(Parameter {
        kind: ParameterKind::Degree(0),
        ..*p
    });
    let range = problem.range(axis);
    for (block, (q, _)) in problem.blocks().zip(problem.commands()) {
        for row in block {
            column[row] *= basis(p, q[axis], range);
        }
    }
    column
}

/// By how much the sum of some terms varies over the measured positions (mm or rad), without the straight line through
/// its ends if it bends.
fn size(problem: &Problem<'_>, all: &[Parameter], taken: &[usize], values: &[f64]) -> f64 {
    const PLACES: usize = 50;
    let first = &all[taken[0]];
    let axis = problem.machine.index(first.axis);
    let Some(axis) = axis.filter(|_| degree(first) > 0) else {
        return values[0].abs();
    };
    let [low, high] = problem.range(axis);
    let value = |q: f64| {
        let terms = taken.iter().zip(values);
        terms
            .map(|(i, v)| v * basis(&all[*i], q, [low, high]))
            .sum::<f64>()
    };
    let bends = taken.iter().any(|i| degree(&all[*i]) > 1);
    let slope = match bends && high > low {
        true => (value(high) - value(low)) / (high - low),
        false => 0.0,
    };
    let places = (0..=PLACES).map(|k| low + (high - low) * k as f64 / PLACES as f64);
    let places = places.map(|q| value(q) - slope * (q - low));
    let [least, most] = extremes(places);
    most - least
}

impl fmt::Display for Lacking {
    /// `EYX of X bends by 8.0 µm`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = &self.parameters[0];
        let (factor, unit) = match first.component >= 3 {
            true => (1e6, "µrad"),
            false => (1e3, "µm"),
        };
        let by = format!("{:.1} {unit}", self.size * factor);
        let motion = &first.to_string()[..3];
        match first.kind {
            ParameterKind::Inter => write!(f, "the location error {first} of {by}"),
            ParameterKind::Backlash => write!(f, "the backlash {first} of {by}"),
            ParameterKind::Degree(_) if self.parameters.iter().all(|p| degree(p) <= 1) => {
                write!(f, "{motion} of {} changes by {by}", first.axis)
            }
            ParameterKind::Degree(_) => write!(f, "{motion} of {} bends by {by}", first.axis),
            ParameterKind::Cosine(_) | ParameterKind::Sine(_) => {
                write!(f, "{motion} of {} varies by {by} over the turn", first.axis)
            }
        }
    }
}
