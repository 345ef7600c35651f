//! Removes what a structure can do without: small terms, and bends of merged tables, that were chosen for the number
//! of products they hold although these are small.

use super::basis::Basis;
use super::structure::{Function, Merged, Structure, Term};
use trueaxis_model::machine::PerAxis;

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
        self.has_all(&[(output, peak)])
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
    /// Leaves out small parts, the smallest first, as long as the tolerance allows.
    pub(crate) fn prune(&mut self, bases: &[Basis], spare: &mut Spare) {
        let mut order: Vec<(f64, usize)> = (0..self.terms.len())
            .map(|i| (self.peak(&self.terms[i], bases), i))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut gone = Vec::new();
        for &(peak, i) in &order {
            if !spare.try_take(self.terms[i].output, peak) {
                break;
            }
            gone.push(i);
        }
        for (_, i) in order {
            if !gone.contains(&i) {
                self.straighten(i, bases, spare);
            }
        }
        let mut number = 0;
        self.terms.retain(|_| {
            number += 1;
            !gone.contains(&(number - 1))
        });
    }

    /// Gives terms that share their only bent table with another term a copy of it, so that the copy can take over
    /// the term's weight. This is cheaper than multiplying by the weight, in an output whose terms are products of
    /// at most two tables and can all lose their weights.
    pub(crate) fn unshare(&mut self, bases: &[Basis]) {
        let mut seen: Vec<(usize, Function)> = Vec::new();
        let is_bent = |f: &Function| matches!(f, Function::Merged(_) | Function::Numeric(_));
        let has_bent = |t: &Term| t.factors.iter().any(|(_, f)| is_bent(f));
        // Among the users without a table of their own, a term that is the table's only user can put its weight into
        // it.
        let users = |table: &(usize, Function)| {
            let plain = self.terms.iter().filter(|t| !has_bent(t));
            plain.filter(|t| t.factors.contains(table)).count()
        };
        let takes_weight = |t: &Term| has_bent(t) || t.factors.iter().any(|f| users(f) == 1);
        let weightless: Vec<bool> = (self.terms.iter())
            .map(|term| {
                let mut same = self.terms.iter().filter(|t| t.output == term.output);
                same.all(|t| t.factors.len() <= 2 && takes_weight(t))
            })
            .collect();
        for (i, is_weightless) in weightless.into_iter().enumerate() {
            let mut bent = self.terms[i].factors.iter().filter(|(_, f)| is_bent(f));
            let (Some(&(v, function)), None) = (bent.next(), bent.next()) else {
                continue;
            };
            if !seen.contains(&(v, function)) {
                seen.push((v, function));
                continue;
            }
            if !is_weightless {
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
    fn straighten(&mut self, i: usize, bases: &[Basis], spare: &mut Spare) {
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
