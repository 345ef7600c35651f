//! From a structure to a cheaper one: a table that nearly is a multiple of another one becomes it, and tables take over
//! weights.

use super::basis::Basis;
use super::structure::{Function, Merged, Structure, Term};
use std::collections::BTreeMap;
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

    /// The sums once these parts are left out, too, each a peak in an output.
    fn with(&self, parts: &[(usize, f64)]) -> PerAxis {
        let mut squares = self.squares;
        for &(output, peak) in parts {
            squares[output] = squares[output].max(0.0) + peak * peak;
        }
        squares
    }

    /// True if all of these parts can be left out.
    fn has(&self, parts: &[(usize, f64)]) -> bool {
        let squares = self.with(parts);
        let is_little = |&(output, _): &(usize, f64)| 2.0 * squares[output].sqrt() <= self.share;
        parts.iter().all(is_little)
    }
}

/// A table by its values at the nodes.
struct Curve {
    values: Vec<f64>,
    square: f64,
    peak: f64,
}

impl Curve {
    fn new(values: Vec<f64>) -> Self {
        Self {
            square: values.iter().map(|a| a * a).sum(),
            peak: values.iter().fold(0.0, |most, value| most.max(value.abs())),
            values,
        }
    }

    /// The factor by which this best approximates `other`, and the residual.
    fn nearest(&self, other: &Self) -> (f64, f64) {
        let both = || self.values.iter().zip(&other.values);
        let along: f64 = both().map(|(a, b)| a * b).sum();
        let weight = match self.square > 0.0 {
            true => along / self.square,
            false => 0.0,
        };
        let rest = both().map(|(a, b)| (b - weight * a).abs());
        (weight, rest.fold(0.0, f64::max))
    }
}

/// A merged table, and a multiple of another one of the same variable in its place.
struct Replacement {
    gone: (usize, Function),
    kept: (usize, Function),
    weight: f64,
    /// The residual, as a part of the table's peak.
    part: f64,
}

impl Structure {
    /// Replaces merged tables by multiples of others, the smallest change first, as long as it fits into the spare
    /// tolerance: each is a table less.
    pub fn share(&mut self, bases: &[Basis], spare: &mut Spare) {
        let at_nodes = |table: &Merged| bases[table.variable].at_nodes(&table.coefficients);
        let curves: Vec<Curve> = self.merged.iter().map(at_nodes).map(Curve::new).collect();
        let mut replacements = self.replacements(&curves);
        loop {
            let users = self.users(bases, &curves);
            let changes = replacements.iter().map(|with| {
                let of = |&(output, peak): &(usize, f64)| (output, peak * with.part);
                let users = users.get(&with.gone).map_or(&[][..], Vec::as_slice);
                (with, users.iter().map(of).collect::<Vec<_>>())
            });
            let largest = |parts: &[(usize, f64)]| parts.iter().fold(0.0, |most, p| p.1.max(most));
            let possible = changes.filter(|(_, parts)| spare.has(parts));
            let best = possible.min_by(|a, b| largest(&a.1).total_cmp(&largest(&b.1)));
            let Some((with, parts)) = best else {
                return;
            };
            spare.squares = spare.with(&parts);
            let (gone, kept) = (with.gone, with.kept);
            for term in &mut self.terms {
                for table in term.factors.iter_mut().filter(|table| **table == gone) {
                    *table = kept;
                    term.weight *= with.weight;
                }
            }
            replacements.retain(|with| with.gone != gone && with.kept != gone);
        }
    }

    /// Every merged table in use in place of every other one.
    fn replacements(&self, curves: &[Curve]) -> Vec<Replacement> {
        let merged = |(v, f): (usize, Function)| match f {
            Function::Merged(id) => Some((v, id)),
            _ => None,
        };
        let used: Vec<(usize, usize)> = self.tables().into_iter().filter_map(merged).collect();
        let mut all = Vec::new();
        for &(v, kept) in &used {
            for &(_, gone) in used.iter().filter(|(w, id)| *w == v && *id != kept) {
                let (weight, rest) = curves[kept].nearest(&curves[gone]);
                all.push(Replacement {
                    gone: (v, Function::Merged(gone)),
                    kept: (v, Function::Merged(kept)),
                    weight,
                    part: rest / curves[gone].peak,
                });
            }
        }
        all
    }

    /// The terms that use each merged table: their outputs and largest possible contributions.
    fn users(
        &self,
        bases: &[Basis],
        curves: &[Curve],
    ) -> BTreeMap<(usize, Function), Vec<(usize, f64)>> {
        let mut users = BTreeMap::<_, Vec<_>>::new();
        for term in &self.terms {
            let peaks = term.factors.iter().map(|(v, function)| match function {
                Function::Numeric(k) => bases[*v].peaks[*k],
                Function::Merged(id) => curves[*id].peak,
                Function::Generator(_) | Function::Sign => 1.0,
            });
            let peak = term.weight.abs() * peaks.product::<f64>();
            for (i, table) in term.factors.iter().enumerate() {
                if !term.factors[..i].contains(table) {
                    users.entry(*table).or_default().push((term.output, peak));
                }
            }
        }
        users
    }

    /// Gives terms that share their only bent table with another term a copy of it, so that the copy can take over
    /// the term's weight. This is cheaper than multiplying by the weight, in an output whose terms are products of
    /// at most two tables and can all lose their weights: 376 instead of 406 instructions for the thirteen errors of the
    /// Huron, which the estimated cost does not show.
    pub fn unshare(&mut self, bases: &[Basis]) {
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
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;

    /// What is left of two terms of two outputs, each a table of Y with these coefficients, and of what may be left out.
    fn shared(one: &[f64], other: &[f64], may_lose: f64) -> (Structure, Spare) {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let variables = variables(&Kinematics::new(&machine, &errors), 1e-6);
        let bases: Vec<Basis> = variables
            .iter()
            .map(|v| Basis::of_generators(v, 2, &v.many()))
            .collect();
        let mut structure = Structure::default();
        for (output, coefficients) in [one, other].into_iter().enumerate() {
            structure.merged.push(Merged {
                variable: 1,
                coefficients: coefficients.to_vec(),
            });
            structure.terms.push(Term {
                output,
                weight: 1.0,
                factors: vec![(1, Function::Merged(output))],
            });
        }
        // The limit is compared with twice the root.
        let mut spare = Spare::new(PerAxis::default(), 2.0 * may_lose);
        structure.share(&bases, &mut spare);
        (structure, spare)
    }

    #[test]
    fn tables_that_are_multiples_of_each_other_become_one() {
        // −2 times the first one, but for 1e-3 at the ends.
        let (structure, spare) = shared(&[0.5, 1.0, 0.3], &[-1.0, -2.0, -0.601], 0.01);
        assert_eq!((structure.terms.len(), structure.count()), (2, 1));
        let [one, other] = [0, 1].map(|i| &structure.terms[i]);
        assert_eq!(one.factors, other.factors);
        assert!((other.weight / one.weight + 2.0).abs() < 1e-3);
        let lost = spare.squares.iter().sum::<f64>().sqrt();
        assert!((1e-5..1e-3).contains(&lost), "{lost}");
        // The change has to fit into what may be left out.
        let (structure, spare) = shared(&[0.5, 1.0, 0.3], &[-1.0, -2.0, -0.601], 1e-5);
        assert_eq!((structure.count(), spare.squares), (2, PerAxis::default()));
    }

    #[test]
    fn tables_of_other_shapes_stay() {
        assert_eq!(
            shared(&[0.5, 1.0, 0.3], &[0.5, -1.0, 0.3], 0.4).0.count(),
            2
        );
    }
}
