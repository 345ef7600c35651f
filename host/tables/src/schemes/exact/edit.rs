//! Changes of a structure, proposed before they are made, and what it can do without: bends of merged tables that
//! were chosen for the number of products they hold although these are small. Copies of tables that take over weights.

use super::basis::Basis;
use super::structure::{Function, Merged, Structure, Term};
use super::variables::Variable;
use crate::cost::{CUBIC_TABLE, FACTOR, LINEAR_TABLE, TERM};
use std::collections::BTreeMap;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::order;

/// Terms that others replace.
pub struct Edit {
    /// The change of each output.
    pub errors: Vec<(usize, f64)>,
    /// Places of terms, and what replaces each.
    pub terms: Vec<(usize, Option<Term>)>,
    /// The table with the next number, if the new terms use one that does not exist yet.
    pub merged: Option<Merged>,
}

impl Edit {
    /// True if these changes fit into the spare tolerance and are smaller than those of the best edit so far.
    pub fn is_wanted(best: Option<&Self>, errors: &[(usize, f64)], spare: &Spare) -> bool {
        let largest = |errors: &[(usize, f64)]| errors.iter().fold(0.0, |most, e| e.1.max(most));
        best.is_none_or(|best| largest(errors) < largest(&best.errors)) && spare.has_all(errors)
    }
}

/// How often a structure uses each table.
#[derive(Default)]
pub struct Uses(BTreeMap<(usize, Function), i32>);

impl Uses {
    pub fn new(structure: &Structure) -> Self {
        let mut uses = Self::default();
        for term in &structure.terms {
            uses.count(term, 1);
        }
        uses
    }

    fn count(&mut self, term: &Term, change: i32) {
        for table in &term.factors {
            *self.0.entry(*table).or_insert(0) += change;
        }
    }

    fn of(&self, table: &(usize, Function)) -> i32 {
        self.0.get(table).copied().unwrap_or(0)
    }

    /// Follows an edit that is about to be made.
    pub fn follow(&mut self, structure: &Structure, edit: &Edit) {
        for (place, new) in &edit.terms {
            self.count(&structure.terms[*place], -1);
            if let Some(new) = new {
                self.count(new, 1);
            }
        }
    }
}

/// Estimated instructions of a term without its tables.
fn cost_of_term(term: &Term) -> f64 {
    TERM + FACTOR * term.factors.len().saturating_sub(2) as f64
}

/// Estimated instructions of a table. Assumes that tables with peaks will be cubic.
fn cost_of_table((v, _): (usize, Function), variables: &[Variable]) -> f64 {
    match variables[v].peaks.is_empty() {
        true => LINEAR_TABLE,
        false => CUBIC_TABLE,
    }
}

impl Structure {
    /// True if an edit saves instructions and adds no tables, which are scarce on a target.
    pub fn is_cheaper_with(&self, edit: &Edit, uses: &Uses, variables: &[Variable]) -> bool {
        let mut cost = 0.0;
        let mut changes: Vec<((usize, Function), i32)> = Vec::new();
        let mut count = |term: &Term, sign: i32| {
            cost += f64::from(sign) * cost_of_term(term);
            for factor in &term.factors {
                match changes.iter_mut().find(|(table, _)| table == factor) {
                    Some((_, change)) => *change += sign,
                    None => changes.push((*factor, sign)),
                }
            }
        };
        for (place, new) in &edit.terms {
            count(&self.terms[*place], -1);
            if let Some(new) = new {
                count(new, 1);
            }
        }
        let mut tables = 0;
        for (table, change) in changes {
            let before = uses.of(&table);
            let more = i32::from(before + change > 0) - i32::from(before > 0);
            tables += more;
            cost += f64::from(more) * cost_of_table(table, variables);
        }
        cost < 0.0 && tables <= 0
    }

    /// Makes a change, and takes it from the spare tolerance.
    pub fn make(&mut self, edit: Edit, spare: &mut Spare) {
        for (output, error) in edit.errors {
            spare.take(output, error);
        }
        self.merged.extend(edit.merged);
        let mut gone = Vec::new();
        for (place, new) in edit.terms {
            match new {
                Some(term) => self.terms[place] = term,
                None => gone.push(place),
            }
        }
        gone.sort_unstable();
        for place in gone.into_iter().rev() {
            self.terms.remove(place);
        }
    }
}

/// The remaining tolerance for leaving parts out.
pub struct Spare {
    /// Sum of the squared peaks of what has been left out, per output.
    squares: PerAxis,
    share: f64,
}

impl Spare {
    /// Parts of an output may be left out as long as their total is less than `share` of the tolerance (twice the
    /// root of the sum of squares). `squares` is the sum for what has already been left out.
    pub fn new(squares: PerAxis, share: f64) -> Self {
        Self { squares, share }
    }

    /// True if a part with this peak can still be left out of an output.
    pub fn has(&self, output: usize, peak: f64) -> bool {
        2.0 * (self.squares[output].max(0.0) + peak * peak).sqrt() <= self.share
    }

    /// True if all of these parts can be left out.
    pub fn has_all(&self, peaks: &[(usize, f64)]) -> bool {
        let mut squares = self.squares;
        for &(output, peak) in peaks {
            squares[output] = squares[output].max(0.0) + peak * peak;
        }
        let is_little = |&(output, _): &(usize, f64)| 2.0 * squares[output].sqrt() <= self.share;
        peaks.iter().all(is_little)
    }

    /// Leaves a part out.
    pub fn take(&mut self, output: usize, peak: f64) {
        let left = &mut self.squares[output];
        *left = left.max(0.0) + peak * peak;
    }

    /// Leaves a part out if possible.
    fn try_take(&mut self, output: usize, peak: f64) -> bool {
        let is_little = self.has(output, peak);
        if is_little {
            self.take(output, peak);
        }
        is_little
    }
}

impl Structure {
    /// Replaces merged tables by constants that they nearly equal, those of the smallest terms first.
    pub(crate) fn straighten(&mut self, bases: &[Basis], spare: &mut Spare) {
        let peaks: Vec<f64> = self
            .terms
            .iter()
            .map(|term| self.peak(term, bases))
            .collect();
        for i in order(&peaks) {
            self.straighten_term(i, bases, spare);
        }
    }

    /// Gives terms that share their only bent table with another term a copy of it, so that the copy can take over
    /// the term's weight. This is cheaper than multiplying by the weight, in an output whose terms are products of
    /// at most two tables and can all lose their weights: 376 instead of 406 instructions for the thirteen errors of the
    /// Huron, which the estimated cost does not show.
    pub(crate) fn unshare(&mut self, bases: &[Basis]) {
        let mut seen: Vec<(usize, Function)> = Vec::new();
        let is_bent = |f: &Function| matches!(f, Function::Merged(_) | Function::Numeric(_));
        let has_bent = |t: &Term| t.factors.iter().any(|(_, f)| is_bent(f));
        // Among the users without a table of their own, a term that is the table's only user can put its weight into
        // it.
        let mut users: BTreeMap<(usize, Function), usize> = BTreeMap::new();
        for term in self.terms.iter().filter(|term| !has_bent(term)) {
            let tables = term.factors.iter().enumerate();
            for (_, table) in tables.filter(|(i, f)| !term.factors[..*i].contains(f)) {
                *users.entry(*table).or_insert(0) += 1;
            }
        }
        let takes_weight =
            |t: &Term| has_bent(t) || t.factors.iter().any(|f| users.get(f) == Some(&1));
        let mut heavy: Vec<usize> = (self.terms.iter())
            .filter(|term| term.factors.len() > 2 || !takes_weight(term))
            .map(|term| term.output)
            .collect();
        heavy.sort_unstable();
        heavy.dedup();
        for i in 0..self.terms.len() {
            let mut bent = self.terms[i].factors.iter().filter(|(_, f)| is_bent(f));
            let (Some(&(v, function)), None) = (bent.next(), bent.next()) else {
                continue;
            };
            if !seen.contains(&(v, function)) {
                seen.push((v, function));
                continue;
            }
            if heavy.contains(&self.terms[i].output) {
                continue;
            }
            let coefficients = match function {
                Function::Merged(id) => self.merged[id].coefficients.clone(),
                Function::Numeric(k) => {
                    let mut unit = vec![0.0; bases[v].len()];
                    unit[k] = 1.0;
                    unit
                }
                Function::Generator(_) | Function::Sign => continue,
            };
            self.merged.push(Merged {
                variable: v,
                coefficients,
            });
            let copy = Function::Merged(self.merged.len() - 1);
            for factor in &mut self.terms[i].factors {
                if *factor == (v, function) {
                    factor.1 = copy;
                }
            }
        }
    }

    /// Replaces a merged table by a constant that it nearly equals.
    fn straighten_term(&mut self, i: usize, bases: &[Basis], spare: &mut Spare) {
        let term = &self.terms[i];
        for (place, &(v, function)) in term.factors.iter().enumerate() {
            let Function::Merged(id) = function else {
                continue;
            };
            let mut bend = self.merged[id].coefficients.clone();
            let constant = std::mem::replace(&mut bend[0], 0.0);
            let whole = bases[v].peak_of(&self.merged[id].coefficients);
            if constant == 0.0 || whole == 0.0 {
                continue;
            }
            let peak = self.peak(term, bases) / whole * bases[v].peak_of(&bend);
            if spare.try_take(term.output, peak) {
                let term = &mut self.terms[i];
                term.factors.remove(place);
                term.weight *= constant;
                return;
            }
        }
    }

    /// The largest possible contribution of a term.
    pub fn peak(&self, term: &Term, bases: &[Basis]) -> f64 {
        let merged = |id: usize| {
            let table: &Merged = &self.merged[id];
            bases[table.variable].peak_of(&table.coefficients)
        };
        peak_with(term, bases, merged)
    }
}

/// The largest possible contribution of a term, given the peaks of merged tables.
pub(crate) fn peak_with(term: &Term, bases: &[Basis], merged: impl Fn(usize) -> f64) -> f64 {
    let peaks = term.factors.iter().map(|(v, function)| match function {
        Function::Numeric(k) => bases[*v].peaks[*k],
        Function::Merged(id) => merged(*id),
        Function::Generator(_) | Function::Sign => 1.0,
    });
    term.weight.abs() * peaks.product::<f64>()
}
