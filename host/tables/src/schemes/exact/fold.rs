//! From a structure to a cheaper one: adds up terms, and merges tables that are multiples of each other to within the
//! tolerance, which shows only after all fibres have been chosen.

use super::basis::Basis;
use super::edit::{Edit, Spare, Uses, peak_with};
use super::structure::{Function, Merged, Structure};
use super::variables::Variable;

/// A function of one variable, by its values at the nodes.
pub struct Curve {
    values: Vec<f64>,
    square: f64,
    /// The largest magnitude.
    pub peak: f64,
}

impl Curve {
    pub fn new(values: Vec<f64>) -> Self {
        Self {
            square: values.iter().map(|a| a * a).sum(),
            peak: values.iter().fold(0.0, |most, value| most.max(value.abs())),
            values,
        }
    }

    /// The factor by which this best approximates `other`, and the residual.
    pub fn nearest(&self, other: &Self) -> (f64, f64) {
        let both = self.values.iter().zip(&other.values);
        let along: f64 = both.map(|(a, b)| a * b).sum();
        let weight = match self.square > 0.0 {
            true => along / self.square,
            false => 0.0,
        };
        // In four parts, which the processor compares at the same time.
        let mut rest = [0.0_f64; 4];
        for (a, b) in self.values.chunks(4).zip(other.values.chunks(4)) {
            for (rest, (a, b)) in rest.iter_mut().zip(a.iter().zip(b)) {
                *rest = rest.max((b - weight * a).abs());
            }
        }
        (weight, rest.into_iter().fold(0.0, f64::max))
    }
}

/// A multiple of another merged table of the same variable, in place of one.
struct Replacement<'a> {
    variable: usize,
    /// The merged table, and the places and peaks of the terms that use it.
    gone: usize,
    users: &'a [(usize, f64)],
    kept: usize,
    weight: f64,
    /// The residual, as a part of the merged table's peak.
    part: f64,
}

/// How well one merged table replaces another, if known: the factor, and the residual.
type Multiple = Option<(f64, f64)>;

/// The places of the terms that use each merged table, with their peaks.
type Users = Vec<Vec<(usize, f64)>>;

impl Structure {
    /// Adds up terms of an output that differ along only one variable, and replaces tables by multiples of others,
    /// as long as that is cheaper and fits into the spare tolerance.
    pub fn fold(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) {
        self.add_up(variables, bases, spare);
        // The terms change from now on, the merged tables do not.
        let at_nodes = |table: &Merged| bases[table.variable].at_nodes(&table.coefficients);
        let curves: Vec<Curve> = self.merged.iter().map(at_nodes).map(Curve::new).collect();
        let mut multiples = vec![None; curves.len() * curves.len()];
        while self.share_once(variables, bases, (&curves, &mut multiples), spare) {}
    }

    /// Replaces a merged table by a multiple of another one, choosing the smallest change. `multiples` keeps how well
    /// each replaces each other one.
    fn share_once(
        &mut self,
        variables: &[Variable],
        bases: &[Basis],
        (curves, multiples): (&[Curve], &mut [Multiple]),
        spare: &mut Spare,
    ) -> bool {
        let merged = |(v, f): (usize, Function)| match f {
            Function::Merged(id) => Some((v, id)),
            _ => None,
        };
        let used: Vec<(usize, usize)> = self.tables().into_iter().filter_map(merged).collect();
        let users = self.users(bases, curves);
        let (uses, mut best) = (Uses::new(self), None);
        for &(v, kept) in &used {
            for &(_, gone) in used.iter().filter(|(w, id)| *w == v && *id != kept) {
                let known = &mut multiples[kept * curves.len() + gone];
                let (weight, rest) =
                    *known.get_or_insert_with(|| curves[kept].nearest(&curves[gone]));
                let replacement = Replacement {
                    variable: v,
                    gone,
                    users: &users[gone],
                    kept,
                    weight,
                    part: rest / curves[gone].peak,
                };
                self.consider(&mut best, &replacement, variables, &uses, spare);
            }
        }
        self.settle(best, spare)
    }

    /// Replaces a merged table. Keeps the edit if it is cheaper, fits into the spare tolerance and changes less than the
    /// best so far.
    fn consider(
        &self,
        best: &mut Option<Edit>,
        with: &Replacement<'_>,
        variables: &[Variable],
        uses: &Uses,
        spare: &Spare,
    ) {
        let error = |&(place, peak): &(usize, f64)| (self.terms[place].output, peak * with.part);
        let errors: Vec<(usize, f64)> = with.users.iter().map(error).collect();
        if !Edit::is_wanted(best.as_ref(), &errors, spare) {
            return;
        }
        let table = (with.variable, Function::Merged(with.gone));
        let mut terms = Vec::new();
        for &(place, _) in with.users {
            let mut term = self.terms[place].clone();
            for factor in std::mem::take(&mut term.factors) {
                if factor == table {
                    term.weight *= with.weight;
                    term.factors
                        .push((with.variable, Function::Merged(with.kept)));
                } else {
                    term.factors.push(factor);
                }
            }
            terms.push((place, Some(term)));
        }
        let edit = Edit {
            errors,
            terms,
            merged: None,
        };
        if self.is_cheaper_with(&edit, uses, variables) {
            *best = Some(edit);
        }
    }

    /// Makes the best edit, if any.
    fn settle(&mut self, best: Option<Edit>, spare: &mut Spare) -> bool {
        let found = best.is_some();
        if let Some(edit) = best {
            self.make(edit, spare);
        }
        found
    }

    fn users(&self, bases: &[Basis], curves: &[Curve]) -> Users {
        let mut users = vec![Vec::new(); curves.len()];
        for (place, term) in self.terms.iter().enumerate() {
            let peak = peak_with(term, bases, |id| curves[id].peak);
            for (i, (_, function)) in term.factors.iter().enumerate() {
                let again = term.factors[..i].iter().any(|(_, f)| f == function);
                if let (Function::Merged(id), false) = (function, again) {
                    users[*id].push((place, peak));
                }
            }
        }
        users
    }

    /// A function as coefficients over its variable's basis.
    pub fn coefficients(&self, function: Function, basis: &Basis) -> Option<Vec<f64>> {
        match function {
            Function::Merged(id) => Some(self.merged[id].coefficients.clone()),
            Function::Numeric(k) => Some(unit(k, basis.len())),
            Function::Generator(_) | Function::Sign => None,
        }
    }
}

/// The coefficients of function `k` alone.
pub fn unit(k: usize, count: usize) -> Vec<f64> {
    let mut coefficients = vec![0.0; count];
    coefficients[k] = 1.0;
    coefficients
}

#[cfg(test)]
mod tests;
