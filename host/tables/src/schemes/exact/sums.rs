//! From a structure to a cheaper one: adds up terms of an output that differ along only one variable.

use super::basis::Basis;
use super::edit::{Edit, Spare, Uses};
use super::fold::{Curve, unit};
use super::structure::{Function, Merged, Structure, Term};
use super::variables::{Generator, Variable};
use std::collections::BTreeMap;
use trueaxis_model::parallel;

/// A function of one variable.
struct Part {
    /// Coefficients over the variable's basis.
    coefficients: Vec<f64>,
    curve: Curve,
}

/// The functions of one variable that terms have, the constant first, and how well each approximates each other one.
struct KnownFunctions<'a> {
    basis: &'a Basis,
    parts: Vec<Part>,
    /// The factor and the residual, by the number of the approximating function and that of the other one.
    nearest: Vec<Vec<(f64, f64)>>,
}

impl<'a> KnownFunctions<'a> {
    fn new(basis: &'a Basis) -> Self {
        let mut constant = Self {
            basis,
            parts: Vec::new(),
            nearest: Vec::new(),
        };
        constant.number(unit(0, basis.len()));
        constant
    }

    /// The number of a function, which is added if it is new.
    fn number(&mut self, coefficients: Vec<f64>) -> usize {
        let is_it = |part: &Part| part.coefficients == coefficients;
        if let Some(number) = self.parts.iter().position(is_it) {
            return number;
        }
        let curve = Curve::new(self.basis.at_nodes(&coefficients));
        for (part, nearest) in self.parts.iter().zip(&mut self.nearest) {
            nearest.push(part.curve.nearest(&curve));
        }
        let to_others = self.parts.iter().map(|part| curve.nearest(&part.curve));
        let itself = match curve.peak > 0.0 {
            true => (1.0, 0.0),
            false => curve.nearest(&curve),
        };
        self.nearest.push(to_others.chain([itself]).collect());
        self.parts.push(Part {
            coefficients,
            curve,
        });
        self.parts.len() - 1
    }

    fn peak(&self, number: usize) -> f64 {
        self.parts[number].curve.peak
    }
}

/// A term as the product of one function of each variable.
struct Separated {
    output: usize,
    weight: f64,
    /// The largest possible contribution.
    peak: f64,
    /// Numbers of [`KnownFunctions`], one for each variable.
    parts: Vec<usize>,
}

/// Two terms, by their numbers, that can become one along a variable: the weight of the second one's function, and
/// the change.
struct Pair {
    error: f64,
    one: usize,
    other: usize,
    variable: usize,
    weight: f64,
}

/// Pairs of terms, kept while terms are added up: a sum changes only the pairs of its own term. A term keeps its number
/// when others are removed.
struct Sums<'a> {
    variables: &'a [Variable],
    /// One for each variable.
    parts: Vec<KnownFunctions<'a>>,
    /// Terms by number; `None` if the bases do not contain all functions of one.
    products: Vec<Option<Separated>>,
    /// The numbers of the remaining terms, in their order.
    numbers: Vec<usize>,
    /// Those that fit into the spare tolerance, the smallest change first.
    pairs: Vec<Pair>,
}

impl Structure {
    /// Adds up pairs of terms as long as that is cheaper and fits into the spare tolerance. In each round, the smallest
    /// change goes first, and a term takes part in no more than one sum.
    pub fn add_up(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) {
        let mut sums = Sums::new(self, variables, bases, spare);
        loop {
            let changed = sums.round(self, spare);
            if !changed.contains(&true) {
                break;
            }
            sums.follow(self, &changed, spare);
        }
    }

    /// `None` if the bases do not contain all functions of the term.
    fn product(&self, term: &Term, parts: &mut [KnownFunctions<'_>]) -> Option<Separated> {
        let bases: Vec<&Basis> = parts.iter().map(|parts| parts.basis).collect();
        let mut numbers = vec![0; parts.len()];
        let mut generators: BTreeMap<usize, Vec<Generator>> = BTreeMap::new();
        let mut put = |v: usize, coefficients: Vec<f64>| {
            let before = std::mem::replace(&mut numbers[v], parts[v].number(coefficients));
            (before == 0).then_some(())
        };
        for &(v, function) in &term.factors {
            match function {
                Function::Generator(g) => generators.entry(v).or_default().push(g),
                Function::Sign => put(v, unit(1, bases[v].len()))?,
                _ => put(v, self.coefficients(function, bases[v])?)?,
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
            put(v, unit(k, bases[v].len()))?;
        }
        let peaks = numbers.iter().zip(parts).map(|(k, parts)| parts.peak(*k));
        Some(Separated {
            output: term.output,
            weight: term.weight,
            peak: peaks.product::<f64>() * term.weight.abs(),
            parts: numbers,
        })
    }
}

impl<'a> Sums<'a> {
    fn new(
        structure: &Structure,
        variables: &'a [Variable],
        bases: &'a [Basis],
        spare: &Spare,
    ) -> Self {
        let mut sums = Self {
            variables,
            parts: bases.iter().map(KnownFunctions::new).collect(),
            products: Vec::new(),
            numbers: (0..structure.terms.len()).collect(),
            pairs: Vec::new(),
        };
        for term in &structure.terms {
            let product = structure.product(term, &mut sums.parts);
            sums.products.push(product);
        }
        sums.add_pairs(&vec![true; structure.terms.len()], spare);
        sums
    }

    /// Adds the pairs of which at least one term is new.
    fn add_pairs(&mut self, is_new: &[bool], spare: &Spare) {
        let of_one = |&one: &usize| {
            let mut pairs = Vec::new();
            for &other in &self.numbers {
                if is_new[one] || is_new[other] {
                    self.compare(one, other, spare, &mut pairs);
                }
            }
            pairs
        };
        let pairs = parallel::map(&self.numbers, of_one);
        self.pairs.extend(pairs.into_iter().flatten());
        let place = |p: &Pair| (p.one, p.other, p.variable);
        let order = |a: &Pair, b: &Pair| a.error.total_cmp(&b.error).then(place(a).cmp(&place(b)));
        self.pairs.sort_by(order);
    }

    /// The place of a term.
    fn place(&self, number: usize) -> usize {
        let place = self.numbers.binary_search(&number);
        place.expect("pairs of removed terms are gone")
    }

    /// Finds the variables along which `other` can be added to `one`, because the two are nearly proportional in all
    /// other variables.
    fn compare(&self, one: usize, other: usize, spare: &Spare, pairs: &mut Vec<Pair>) {
        let (Some(sum), Some(added)) = (&self.products[one], &self.products[other]) else {
            return;
        };
        if one == other || sum.output != added.output {
            return;
        }
        // For each variable: the ratio of `other`'s function to `one`'s, and the change if they count as proportional.
        let each = || {
            let parts = sum.parts.iter().zip(&added.parts).zip(&self.parts);
            let used = parts
                .enumerate()
                .filter(|(_, ((a, b), _))| (**a, **b) != (0, 0));
            used.map(|(v, ((a, b), parts))| {
                let (weight, rest) = parts.nearest[*a][*b];
                (v, weight, added.peak * rest / parts.peak(*b))
            })
        };
        let mut different = each().filter(|(.., error)| !spare.has(sum.output, *error));
        if different.nth(1).is_some() {
            return;
        }
        for (variable, ..) in each() {
            let elsewhere = || each().filter(move |(v, ..)| *v != variable);
            // Without a sign, which an empty sum has: zeros are equal.
            let error = elsewhere().map(|(.., error)| error).sum::<f64>().abs();
            if self.variables[variable].merges() && spare.has(sum.output, error) {
                pairs.push(Pair {
                    error,
                    one,
                    other,
                    variable,
                    weight: added.weight * elsewhere().map(|(_, w, _)| w).product::<f64>(),
                });
            }
        }
    }

    /// Makes the sums that are cheaper, the smallest change first. Returns, by number, which terms are gone or another
    /// one.
    fn round(&mut self, structure: &mut Structure, spare: &mut Spare) -> Vec<bool> {
        let mut uses = Uses::new(structure);
        let mut changed = vec![false; self.products.len()];
        for pair in std::mem::take(&mut self.pairs) {
            if changed[pair.one] || changed[pair.other] {
                continue;
            }
            let places = [pair.one, pair.other].map(|number| self.place(number));
            let output = structure.terms[places[0]].output;
            // What does not fit into the spare tolerance never will.
            if !spare.has(output, pair.error) {
                continue;
            }
            let Some((sum, merged)) = self.sum(structure, &pair) else {
                continue;
            };
            // A table may become a product of several.
            if sum.factors.len() <= trueaxis::FACTORS {
                let edit = Edit {
                    errors: vec![(output, pair.error)],
                    terms: vec![(places[0], Some(sum)), (places[1], None)],
                    merged,
                };
                if structure.is_cheaper_with(&edit, &uses, self.variables) {
                    uses.follow(structure, &edit);
                    structure.make(edit, spare);
                    self.numbers.remove(places[1]);
                    (changed[pair.one], changed[pair.other]) = (true, true);
                    continue;
                }
            }
            self.pairs.push(pair);
        }
        changed
    }

    /// The sum of two terms, and its table if it does not exist yet.
    fn sum(&self, structure: &Structure, pair: &Pair) -> Option<(Term, Option<Merged>)> {
        let v = pair.variable;
        let KnownFunctions { basis, parts, .. } = &self.parts[v];
        let term = &structure.terms[self.place(pair.one)];
        let one = self.products[pair.one].as_ref()?;
        let other = self.products[pair.other].as_ref()?;
        let [a, b] = [one, other].map(|product| &parts[product.parts[v]].coefficients);
        let both = a.iter().zip(b);
        let sum: Vec<f64> = both
            .map(|(a, b)| term.weight * a + pair.weight * b)
            .collect();
        let mut factors = term.factors.clone();
        factors.retain(|(w, _)| *w != v);
        let only = |k: usize| sum.iter().enumerate().all(|(i, c)| i == k || *c == 0.0);
        let mut merged = None;
        let weight = if let Some(k) = (0..basis.products.len()).find(|k| only(*k)) {
            factors.extend(
                basis.products[k]
                    .iter()
                    .map(|g| (v, Function::Generator(*g))),
            );
            sum[k]
        } else {
            let elsewhere = one.parts.iter().zip(&self.parts).enumerate();
            let others = elsewhere
                .filter(|(w, _)| *w != v)
                .map(|(_, (a, parts))| parts.peak(*a));
            let known = structure.multiple(v, &sum, basis, others.product());
            let (id, weight) = match known {
                Some(known) => known,
                None => {
                    merged = Some(Merged {
                        variable: v,
                        coefficients: sum,
                    });
                    (structure.merged.len(), 1.0)
                }
            };
            factors.push((v, Function::Merged(id)));
            weight
        };
        let term = Term {
            output: term.output,
            weight,
            factors,
        };
        Some((term, merged))
    }

    /// Follows sums that were made.
    fn follow(&mut self, structure: &Structure, changed: &[bool], spare: &Spare) {
        self.pairs
            .retain(|pair| !changed[pair.one] && !changed[pair.other]);
        for (product, _) in self.products.iter_mut().zip(changed).filter(|(_, c)| **c) {
            *product = None;
        }
        for (number, term) in self.numbers.iter().zip(&structure.terms) {
            if changed[*number] {
                self.products[*number] = structure.product(term, &mut self.parts);
            }
        }
        self.add_pairs(changed, spare);
    }
}
