//! Changes of a structure, proposed before they are made.

use super::prune::Spare;
use super::structure::{Function, Merged, Structure, Term};
use super::variables::Variable;
use crate::cost::{CUBIC_TABLE, FACTOR, LINEAR_TABLE, TERM};

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

/// How often a structure uses each table, in the order of the tables.
pub struct Uses(Vec<((usize, Function), i32)>);

impl Uses {
    pub fn new(structure: &Structure) -> Self {
        let factors = structure.terms.iter().flat_map(|t| t.factors.iter());
        let mut factors: Vec<(usize, Function)> = factors.copied().collect();
        factors.sort_unstable();
        let same = factors.chunk_by(|a, b| a == b);
        Self(same.map(|uses| (uses[0], uses.len() as i32)).collect())
    }

    fn of(&self, table: &(usize, Function)) -> i32 {
        let place = self.0.binary_search_by(|(known, _)| known.cmp(table));
        place.map_or(0, |place| self.0[place].1)
    }

    /// True if some table is used no more once `one` has lost its tables of a variable, and `other` all of its own.
    pub fn ends_with(&self, one: &Term, variable: usize, other: &Term) -> bool {
        let own = one.factors.iter().filter(|(v, _)| *v == variable);
        let gone = || own.clone().chain(&other.factors);
        gone().any(|table| self.of(table) == gone().filter(|g| *g == table).count() as i32)
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
    /// Estimated instructions.
    pub fn cost(&self, variables: &[Variable]) -> f64 {
        let terms: f64 = self.terms.iter().map(cost_of_term).sum();
        let tables = self.tables().into_iter();
        terms + tables.map(|t| cost_of_table(t, variables)).sum::<f64>()
    }

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
