//! Merges terms, and tables, that are equal to within the tolerance.
//!
//! Sums of basis functions are chosen one fibre after the other. Only afterwards does it show that two of the
//! resulting tables are multiples of each other, or that one is a product of others.

use super::basis::Basis;
use super::core::merges;
use super::generators::Generator;
use super::prune::{Spare, peak_with};
use super::structure::{Function, Merged, Structure, Term};
use super::variables::Variable;
use crate::cost::{CUBIC_TABLE, FACTOR, LINEAR_TABLE, TERM};
use std::collections::BTreeMap;

/// The function of each variable in a term.
type Parts = BTreeMap<usize, Part>;

/// A function of one variable.
struct Part {
    /// Coefficients over the variable's basis.
    coefficients: Vec<f64>,
    /// Its values at nodes.
    values: Vec<f64>,
}

impl Part {
    fn new(coefficients: Vec<f64>, basis: &Basis) -> Self {
        let values = basis.at_nodes(&coefficients);
        Self {
            coefficients,
            values,
        }
    }

    fn constant(basis: &Basis) -> Self {
        Self::new(unit(0, basis.len()), basis)
    }
}

/// One function, with its term's weight, is nearly a multiple of another: the factor, and the largest change if one
/// replaces the other.
struct Multiple {
    weight: f64,
    error: f64,
}

/// Tables of one variable, and the values of their product at the nodes.
struct Product {
    factors: Vec<(usize, Function)>,
    values: Vec<f64>,
}

/// Merged tables: values at nodes, and peaks.
struct Known {
    values: Vec<Vec<f64>>,
    peaks: Vec<f64>,
}

/// A cheaper structure, and its change of each output.
struct Cheaper {
    errors: Vec<(usize, f64)>,
    structure: Structure,
}

impl Cheaper {
    fn error(&self) -> f64 {
        largest(self.errors.iter().map(|(_, error)| *error))
    }

    /// True if no better one is known and its changes fit into the spare tolerance.
    fn is_wanted(best: Option<&Self>, errors: &[(usize, f64)], spare: &Spare) -> bool {
        let error = largest(errors.iter().map(|(_, error)| *error));
        best.is_none_or(|best| error < best.error()) && spare.has_all(errors)
    }
}

impl Structure {
    /// Adds up terms of an output that differ along only one variable, and replaces tables by multiples or products
    /// of others, as long as that is cheaper and fits into the spare tolerance.
    pub fn fold(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) {
        while self.fold_once(variables, bases, spare) {}
        while self.share_once(variables, bases, spare) {}
        while self.split_once(variables, bases, spare) {}
    }

    /// Estimated instructions. Assumes that tables with peaks will be cubic.
    pub fn cost(&self, variables: &[Variable]) -> f64 {
        let beyond = |t: &Term| t.factors.len().saturating_sub(2);
        let factors: usize = self.terms.iter().map(beyond).sum();
        let table = |(v, _): (usize, Function)| match variables[v].peaks.is_empty() {
            true => LINEAR_TABLE,
            false => CUBIC_TABLE,
        };
        let tables: f64 = self.tables().into_iter().map(table).sum();
        TERM * self.terms.len() as f64 + tables + FACTOR * factors as f64
    }

    /// True if it takes fewer instructions and no more tables, which are scarce on a target.
    fn is_cheaper(&self, than: &Self, variables: &[Variable]) -> bool {
        self.cost(variables) < than.cost(variables) && self.count() <= than.count()
    }

    /// Adds up the two terms with the smallest change, if that is cheaper.
    fn fold_once(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) -> bool {
        let parts: Vec<Option<Parts>> = (self.terms.iter())
            .map(|term| self.parts(term, bases))
            .collect();
        let mut best: Option<Cheaper> = None;
        for (i, one) in self.terms.iter().enumerate() {
            for (j, other) in self.terms.iter().enumerate() {
                let (Some(of_one), Some(of_other)) = (&parts[i], &parts[j]) else {
                    continue;
                };
                if i == j || one.output != other.output {
                    continue;
                }
                for (v, multiple) in along(of_one, of_other, other.weight, variables, bases) {
                    let errors = vec![(one.output, multiple.error)];
                    if !Cheaper::is_wanted(best.as_ref(), &errors, spare) {
                        continue;
                    }
                    let sum = added(of_one, of_other, v, one.weight, multiple.weight, bases);
                    let mut with = self.clone();
                    with.put(i, of_one, v, sum, bases);
                    with.terms.remove(j);
                    if with.is_cheaper(self, variables) {
                        best = Some(Cheaper {
                            errors,
                            structure: with,
                        });
                    }
                }
            }
        }
        self.settle(best, spare)
    }

    /// Replaces a merged table by a multiple of another one, choosing the smallest change.
    fn share_once(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) -> bool {
        let tables = self.tables();
        let known = self.known(bases);
        let merged = |&(v, f): &(usize, Function)| match f {
            Function::Merged(id) => Some((v, id)),
            _ => None,
        };
        let used: Vec<(usize, usize)> = tables.iter().filter_map(merged).collect();
        let mut best: Option<Cheaper> = None;
        for &(v, kept) in &used {
            for &(_, gone) in used.iter().filter(|(w, id)| *w == v && *id != kept) {
                let product = Product {
                    factors: vec![(v, Function::Merged(kept))],
                    values: known.values[kept].clone(),
                };
                let tables = (variables, bases, &known);
                self.consider(&mut best, (v, gone), &product, tables, spare);
            }
        }
        self.settle(best, spare)
    }

    /// Replaces a merged table by the product of a generator and another table, choosing the smallest change.
    fn split_once(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) -> bool {
        let tables = self.tables();
        let known = self.known(bases);
        let mut best: Option<Cheaper> = None;
        for &(v, whole) in &tables {
            let Function::Merged(gone) = whole else {
                continue;
            };
            for (k, product) in bases[v].products.iter().enumerate() {
                let &[Generator::Sine | Generator::Cosine] = product.as_slice() else {
                    continue;
                };
                let generator = (v, Function::Generator(product[0]));
                if !tables.contains(&generator) {
                    continue;
                }
                let by = bases[v].at_nodes(&unit(k, bases[v].len()));
                for &(w, kept) in tables.iter().filter(|t| t.0 == v && **t != (v, whole)) {
                    let Some(coefficients) = self.coefficients(v, kept, bases) else {
                        continue;
                    };
                    let other = bases[v].at_nodes(&coefficients);
                    let product = Product {
                        factors: vec![generator, (w, kept)],
                        values: other.iter().zip(&by).map(|(a, by)| a * by).collect(),
                    };
                    let tables = (variables, bases, &known);
                    self.consider(&mut best, (v, gone), &product, tables, spare);
                }
            }
        }
        self.settle(best, spare)
    }

    /// Replaces a merged table by the nearest multiple of a product. Keeps the result if it is cheaper, fits into
    /// the spare tolerance and changes less than the best so far.
    fn consider(
        &self,
        best: &mut Option<Cheaper>,
        (v, gone): (usize, usize),
        product: &Product,
        (variables, bases, known): (&[Variable], &[Basis], &Known),
        spare: &Spare,
    ) {
        let (weight, rest) = nearest(&product.values, &known.values[gone]);
        let errors = self.errors(v, gone, rest, bases, known);
        if !Cheaper::is_wanted(best.as_ref(), &errors, spare) {
            return;
        }
        let mut with = self.clone();
        for term in &mut with.terms {
            for factor in std::mem::take(&mut term.factors) {
                if factor == (v, Function::Merged(gone)) {
                    term.weight *= weight;
                    term.factors.extend(&product.factors);
                } else {
                    term.factors.push(factor);
                }
            }
            if term.factors.len() > trueaxis::FACTORS {
                return;
            }
        }
        if with.is_cheaper(self, variables) {
            *best = Some(Cheaper {
                errors,
                structure: with,
            });
        }
    }

    /// Adopts the best candidate, if any.
    fn settle(&mut self, best: Option<Cheaper>, spare: &mut Spare) -> bool {
        let Some(best) = best else {
            return false;
        };
        for (output, error) in best.errors {
            spare.take(output, error);
        }
        *self = best.structure;
        true
    }

    /// The change in each term that uses a table, if that table changes by the given amount.
    fn errors(
        &self,
        v: usize,
        id: usize,
        wrong: f64,
        bases: &[Basis],
        known: &Known,
    ) -> Vec<(usize, f64)> {
        let table = (v, Function::Merged(id));
        let part = wrong / known.peaks[id];
        let users = self.terms.iter().filter(|t| t.factors.contains(&table));
        users
            .map(|t| (t.output, peak_with(t, bases, |id| known.peaks[id]) * part))
            .collect()
    }

    /// Values of merged tables at the nodes.
    fn known(&self, bases: &[Basis]) -> Known {
        let at_nodes = |table: &Merged| bases[table.variable].at_nodes(&table.coefficients);
        let values: Vec<Vec<f64>> = self.merged.iter().map(at_nodes).collect();
        Known {
            peaks: values.iter().map(|v| largest(v.iter().copied())).collect(),
            values,
        }
    }

    /// A function as coefficients over its variable's basis.
    fn coefficients(&self, v: usize, function: Function, bases: &[Basis]) -> Option<Vec<f64>> {
        match function {
            Function::Merged(id) => Some(self.merged[id].coefficients.clone()),
            Function::Numeric(k) => Some(unit(k, bases[v].len())),
            Function::Generator(_) | Function::Sign => None,
        }
    }

    /// The function of each variable; `None` if the bases do not contain all of them.
    fn parts(&self, term: &Term, bases: &[Basis]) -> Option<Parts> {
        let mut parts = Parts::new();
        let mut generators: BTreeMap<usize, Vec<Generator>> = BTreeMap::new();
        for &(v, function) in &term.factors {
            match function {
                Function::Generator(g) => generators.entry(v).or_default().push(g),
                Function::Sign => {
                    parts.insert(v, Part::new(unit(1, bases[v].len()), &bases[v]));
                }
                _ => {
                    let coefficients = self.coefficients(v, function, bases)?;
                    let part = Part::new(coefficients, &bases[v]);
                    if parts.insert(v, part).is_some() {
                        return None;
                    }
                }
            }
        }
        for (v, mut product) in generators {
            product.sort_unstable();
            let is_it = |known: &Vec<Generator>| {
                let mut known = known.clone();
                known.sort_unstable();
                known == product
            };
            let k = bases[v].products.iter().position(is_it)?;
            let part = Part::new(unit(k, bases[v].len()), &bases[v]);
            if parts.insert(v, part).is_some() {
                return None;
            }
        }
        Some(parts)
    }

    /// Replaces a term by parts, with `sum` along variable `v`.
    fn put(&mut self, i: usize, parts: &Parts, v: usize, sum: Vec<f64>, bases: &[Basis]) {
        let generators = &bases[v].products;
        let mut factors = self.terms[i].factors.clone();
        factors.retain(|(w, _)| *w != v);
        let only = |k: usize| sum.iter().enumerate().all(|(i, c)| i == k || *c == 0.0);
        self.terms[i].weight = if let Some(k) = (0..generators.len()).find(|k| only(*k)) {
            factors.extend(generators[k].iter().map(|g| (v, Function::Generator(*g))));
            sum[k]
        } else {
            let others: f64 = (parts.iter().filter(|(w, _)| **w != v))
                .map(|(_, part)| largest(part.values.iter().copied()))
                .product();
            let (id, weight) = self.merge(v, sum, bases, others);
            factors.push((v, Function::Merged(id)));
            weight
        };
        self.terms[i].factors = factors;
    }
}

/// The variables along which `other`, with its weight, can be added to `one`, because the two are nearly
/// proportional in all other variables.
fn along(
    one: &Parts,
    other: &Parts,
    weight_of_other: f64,
    variables: &[Variable],
    bases: &[Basis],
) -> Vec<(usize, Multiple)> {
    let mut all: Vec<usize> = one.keys().chain(other.keys()).copied().collect();
    all.sort_unstable();
    all.dedup();
    // For each variable: the ratio of `other`'s part to `one`'s, the residual, and its peak.
    let compared: Vec<(usize, f64, f64, f64)> = all
        .into_iter()
        .map(|v| {
            let constant = Part::constant(&bases[v]);
            let [a, b] = [one, other].map(|parts| &parts.get(&v).unwrap_or(&constant).values);
            let (weight, rest) = nearest(a, b);
            (v, weight, rest, largest(b.iter().copied()))
        })
        .collect();
    let whole: f64 = compared.iter().map(|c| c.3).product::<f64>() * weight_of_other.abs();
    (compared.iter())
        .filter(|(v, ..)| merges(&variables[*v].kind))
        .map(|&(v, ..)| {
            let elsewhere = || compared.iter().filter(move |c| c.0 != v);
            let weight = weight_of_other * elsewhere().map(|c| c.1).product::<f64>();
            let error = elsewhere().map(|c| whole * c.2 / c.3).sum();
            (v, Multiple { weight, error })
        })
        .collect()
}

/// The sum of two terms' functions of a variable.
fn added(
    one: &Parts,
    other: &Parts,
    v: usize,
    weight_of_one: f64,
    weight_of_other: f64,
    bases: &[Basis],
) -> Vec<f64> {
    let constant = Part::constant(&bases[v]);
    let [a, b] = [one, other].map(|parts| &parts.get(&v).unwrap_or(&constant).coefficients);
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| weight_of_one * a + weight_of_other * b)
        .collect()
}

/// The factor by which `a` best approximates `b`, and the residual.
fn nearest(a: &[f64], b: &[f64]) -> (f64, f64) {
    let along: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let square: f64 = a.iter().map(|a| a * a).sum();
    let weight = if square > 0.0 { along / square } else { 0.0 };
    let rest = largest(a.iter().zip(b).map(|(a, b)| b - weight * a));
    (weight, rest)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

/// The coefficients of function `k` alone.
fn unit(k: usize, count: usize) -> Vec<f64> {
    let mut coefficients = vec![0.0; count];
    coefficients[k] = 1.0;
    coefficients
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::variables::variables;
    use super::*;
    use trueaxis_model::kinematics::Kinematics;
    use trueaxis_model::machine::PerAxis;

    /// X, Y, Z and C of a machine, with all products of their generators up to the second degree.
    fn specimen() -> (Vec<Variable>, Vec<Basis>) {
        let machine = with_rotary(&[('C', [-100.0, 100.0])]);
        let errors = errors(&machine, "");
        let variables = variables(&Kinematics::new(&machine, &errors), 1e-6);
        let basis = |v: &Variable| match v.is_rich() {
            true => Basis::of_generators(v, 2, &v.many()),
            false => Basis::of_lever(v),
        };
        let bases = variables.iter().map(basis).collect();
        (variables, bases)
    }

    fn number_of(basis: &Basis, product: &[Generator]) -> usize {
        basis.products.iter().position(|p| p == product).unwrap()
    }

    /// Tables of variables, and terms of outputs with a weight and tables; their sums at some positions.
    #[derive(Clone, Default)]
    struct Made(Structure);

    impl Made {
        fn table(&mut self, variable: usize, coefficients: Vec<f64>) -> (usize, Function) {
            self.0.merged.push(Merged {
                variable,
                coefficients,
            });
            (variable, Function::Merged(self.0.merged.len() - 1))
        }

        fn term(&mut self, output: usize, weight: f64, factors: &[(usize, Function)]) {
            self.0.terms.push(Term {
                output,
                weight,
                factors: factors.to_vec(),
            });
        }
    }

    fn value(structure: &Structure, variables: &[Variable], at: &[f64], output: usize) -> f64 {
        let function = |&(v, f): &(usize, Function)| match f {
            Function::Generator(g) => g.value(&variables[v], at[v]),
            Function::Merged(id) => {
                let basis = Basis::of_generators(&variables[v], 2, &[at[v]]);
                basis.at_nodes(&structure.merged[id].coefficients)[0]
            }
            Function::Numeric(_) | Function::Sign => panic!("there are none"),
        };
        let terms = structure.terms.iter().filter(|t| t.output == output);
        terms
            .map(|t| t.weight * t.factors.iter().map(function).product::<f64>())
            .sum()
    }

    /// Folds a structure. Also returns the largest change at the corners and in the middle of two variables.
    fn folded(made: &Made, may_lose: f64, along: [usize; 2]) -> (Structure, f64) {
        let (variables, bases) = specimen();
        let mut structure = made.0.clone();
        // The limit is compared with twice the root.
        let mut spare = Spare::new(PerAxis::default(), 2.0 * may_lose);
        structure.fold(&variables, &bases, &mut spare);
        let mut most: f64 = 0.0;
        for place in 0..9 {
            let mut at = [0.0; 4];
            for (v, step) in along.into_iter().zip([place % 3, place / 3]) {
                let [low, high] = variables[v].calibrated;
                at[v] = low + (high - low) * step as f64 / 2.0;
            }
            for output in 0..2 {
                let [before, after] =
                    [&made.0, &structure].map(|s| value(s, &variables, &at, output));
                most = most.max((after - before).abs());
            }
        }
        (structure, most)
    }

    const X: usize = 0;
    const Y: usize = 1;
    const C: usize = 3;
    const ALONG_X: (usize, Function) = (X, Function::Generator(Generator::Coordinate));

    #[test]
    fn terms_that_differ_along_one_variable_become_one() {
        let mut made = Made::default();
        // y + 0.5, and −2 times that, except for 0.01.
        let one = made.table(Y, vec![0.5, 1.0, 0.0]);
        let other = made.table(Y, vec![-1.01, -2.0, 0.0]);
        made.term(0, 3.0, &[ALONG_X, one]);
        made.term(0, 1.0, &[other]);
        let (structure, change) = folded(&made, 0.02, [X, Y]);
        assert_eq!((structure.terms.len(), structure.count()), (1, 2));
        assert!((1e-6..0.02).contains(&change), "{change}");
        // A change beyond the spare tolerance is not made.
        let (structure, change) = folded(&made, 0.002, [X, Y]);
        assert_eq!((structure.terms.len(), change), (2, 0.0));
    }

    #[test]
    fn terms_of_other_outputs_and_along_two_variables_stay() {
        let mut made = Made::default();
        let one = made.table(Y, vec![0.5, 1.0, 0.0]);
        made.term(0, 3.0, &[ALONG_X, one]);
        made.term(1, 3.0, &[one]);
        made.term(0, 1.0, &[(Y, Function::Generator(Generator::Coordinate))]);
        let (structure, change) = folded(&made, 0.1, [X, Y]);
        assert_eq!((structure.terms.len(), change), (3, 0.0));
    }

    #[test]
    fn tables_that_are_multiples_of_each_other_become_one() {
        let mut made = Made::default();
        let one = made.table(Y, vec![0.5, 1.0, 0.3]);
        let other = made.table(Y, vec![-1.0, -2.0, -0.601]);
        made.term(0, 1.0, &[one]);
        made.term(1, 1.0, &[other]);
        let (structure, change) = folded(&made, 0.01, [X, Y]);
        assert_eq!((structure.terms.len(), structure.count()), (2, 1));
        assert!((1e-6..0.01).contains(&change), "{change}");
        assert_eq!(folded(&made, 0.0001, [X, Y]).0.count(), 2);
    }

    #[test]
    fn a_table_that_is_a_product_of_two_others_goes() {
        use Generator::{Cosine, Sine};
        let (_, bases) = specimen();
        let mut coefficients = [0; 2].map(|_| vec![0.0; bases[C].len()]);
        let [single, double] = &mut coefficients;
        for (product, c) in [(vec![Sine], 0.7), (vec![Cosine], -0.4)] {
            single[number_of(&bases[C], &product)] = c;
        }
        for (product, c) in [(vec![Sine, Cosine], 1.4), (vec![Cosine; 2], -0.8)] {
            double[number_of(&bases[C], &product)] = c;
        }
        let [single, double] = coefficients;
        let mut made = Made::default();
        let single = made.table(C, single);
        let double = made.table(C, double);
        made.term(0, 1.0, &[double, ALONG_X]);
        made.term(1, 1.0, &[single]);
        made.term(1, 1.0, &[(C, Function::Generator(Cosine)), ALONG_X]);
        let (structure, change) = folded(&made, 1e-6, [X, C]);
        assert_eq!((structure.terms.len(), structure.count()), (3, 3));
        assert_eq!(structure.terms[0].factors.len(), 3);
        assert!(change < 1e-12, "{change}");
    }
}
