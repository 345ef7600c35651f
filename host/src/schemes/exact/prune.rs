//! What a structure can do without: terms, and bends of merged tables, that were taken for how many
//! products they hold, though these are small.

use super::basis::Basis;
use super::cover::{Function, Merged, Structure, Term};
use crate::machine::PerAxis;

impl Structure {
    /// Leaves out what is small, the smallest first, as long as what is left out of an output is less than
    /// `share` of the tolerance (root of the sum of squares, twice); `squares` is what has been left out
    /// before.
    pub fn prune(&mut self, bases: &[Basis], squares: &PerAxis, share: f64) {
        let mut squares = *squares;
        let mut spare = |output: usize, peak: f64| {
            let left = &mut squares[output];
            let next = left.max(0.0) + peak * peak;
            let is_little = 2.0 * next.sqrt() <= share;
            if is_little {
                *left = next;
            }
            is_little
        };
        let mut order: Vec<(f64, usize)> = (0..self.terms.len())
            .map(|i| (self.peak(&self.terms[i], bases), i))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut gone = Vec::new();
        for &(peak, i) in &order {
            if !spare(self.terms[i].output, peak) {
                break;
            }
            gone.push(i);
        }
        for (_, i) in order {
            if !gone.contains(&i) {
                self.straighten(i, bases, &mut spare);
            }
        }
        let mut number = 0;
        self.terms.retain(|_| {
            number += 1;
            !gone.contains(&(number - 1))
        });
    }

    /// Gives terms that share their only bent table with another a copy of it, so that it can take the
    /// term's weight: in an output whose terms are products of at most two tables that is cheaper than to
    /// multiply by the weight.
    pub fn unshare(&mut self, bases: &[Basis]) {
        let mut seen: Vec<(usize, Function)> = Vec::new();
        for i in 0..self.terms.len() {
            let output = self.terms[i].output;
            let mut same = self.terms.iter().filter(|t| t.output == output);
            let is_short = same.all(|t| t.factors.len() <= 2);
            let mut bent = self.terms[i]
                .factors
                .iter()
                .filter(|(_, f)| matches!(f, Function::Merged(_) | Function::Numeric(_)));
            let (Some(&(v, function)), None) = (bent.next(), bent.next()) else {
                continue;
            };
            if !seen.contains(&(v, function)) {
                seen.push((v, function));
                continue;
            }
            if !is_short {
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

    /// Takes a merged table for the constant that it nearly is.
    fn straighten(
        &mut self,
        i: usize,
        bases: &[Basis],
        spare: &mut impl FnMut(usize, f64) -> bool,
    ) {
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
            if spare(term.output, peak) {
                let term = &mut self.terms[i];
                term.factors.remove(place);
                term.weight *= constant;
                return;
            }
        }
    }

    /// The most that a term can contribute.
    fn peak(&self, term: &Term, bases: &[Basis]) -> f64 {
        let peaks = term.factors.iter().map(|(v, function)| match function {
            Function::Numeric(k) => bases[*v].peaks[*k],
            Function::Merged(id) => bases[*v].peak_of(&self.merged[*id].coefficients),
            Function::Generator(_) | Function::Sign => 1.0,
        });
        term.weight.abs() * peaks.product::<f64>()
    }
}
