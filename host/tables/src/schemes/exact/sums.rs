//! Adds up terms of an output that differ along only one variable.

use super::basis::Basis;
use super::core::merges;
use super::edit::{Edit, Uses};
use super::fold::{Curve, unit};
use super::generators::Generator;
use super::prune::Spare;
use super::structure::{Function, Merged, Structure, Term};
use super::variables::Variable;
use std::collections::BTreeMap;
use trueaxis_model::parallel;

/// A function of one variable.
struct Part {
    /// Coefficients over the variable's basis.
    coefficients: Vec<f64>,
    curve: Curve,
}

impl Part {
    fn new(coefficients: Vec<f64>, basis: &Basis) -> Self {
        Self {
            curve: Curve::new(basis.at_nodes(&coefficients)),
            coefficients,
        }
    }

    /// [`Curve::nearest`]: often the functions are the same.
    fn nearest(&self, other: &Self) -> (f64, f64) {
        match self.coefficients == other.coefficients && self.curve.peak > 0.0 {
            true => (1.0, 0.0),
            false => self.curve.nearest(&other.curve),
        }
    }

    fn constant(basis: &Basis) -> Self {
        Self::new(unit(0, basis.len()), basis)
    }
}

/// A term as the product of one function of each variable. Variables without one are constant.
struct Product {
    output: usize,
    weight: f64,
    parts: Vec<Option<Part>>,
}

/// Two terms, by their numbers, that can become one along a variable: the weight of the second one's function, and
/// the change. The sum is no multiple of the first merged tables, as many as were compared.
struct Pair {
    error: f64,
    one: usize,
    other: usize,
    variable: usize,
    weight: f64,
    compared: usize,
}

/// Pairs of terms, kept while terms are added up: a sum changes only the pairs of its own term. A term keeps its number
/// when others are removed.
struct Sums<'a> {
    variables: &'a [Variable],
    bases: &'a [Basis],
    constants: Vec<Part>,
    /// Terms by number; `None` if the bases do not contain all functions of one.
    products: Vec<Option<Product>>,
    /// The numbers of the remaining terms, in their order.
    numbers: Vec<usize>,
    /// Those that fit into the spare tolerance, the smallest change first.
    pairs: Vec<Pair>,
}

impl Structure {
    /// Adds up pairs of terms as long as that is cheaper and fits into the spare tolerance, the smallest change first.
    pub fn add_up(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) {
        let mut sums = Sums::new(self, variables, bases, spare);
        while let Some((edit, one, other)) = sums.best(self, spare) {
            self.make(edit, spare);
            sums.follow(self, one, other, spare);
        }
    }

    /// `None` if the bases do not contain all functions of the term.
    fn product(&self, term: &Term, bases: &[Basis]) -> Option<Product> {
        let mut parts: Vec<Option<Part>> = bases.iter().map(|_| None).collect();
        let mut generators: BTreeMap<usize, Vec<Generator>> = BTreeMap::new();
        let mut put = |v: usize, coefficients: Vec<f64>| {
            let part = Part::new(coefficients, &bases[v]);
            parts[v].replace(part).is_none().then_some(())
        };
        for &(v, function) in &term.factors {
            match function {
                Function::Generator(g) => generators.entry(v).or_default().push(g),
                Function::Sign => put(v, unit(1, bases[v].len()))?,
                _ => put(v, self.coefficients(v, function, bases)?)?,
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
        Some(Product {
            output: term.output,
            weight: term.weight,
            parts,
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
        let of_term = |term| structure.product(term, bases);
        let products = parallel::map(&structure.terms, of_term);
        let mut sums = Self {
            variables,
            bases,
            constants: bases.iter().map(Part::constant).collect(),
            numbers: (0..products.len()).collect(),
            products,
            pairs: Vec::new(),
        };
        let of_one = |&one: &usize| {
            let mut pairs = Vec::new();
            for &other in &sums.numbers {
                sums.compare(one, other, spare, &mut pairs);
            }
            pairs
        };
        let pairs = parallel::map(&sums.numbers, of_one);
        sums.pairs = pairs.into_iter().flatten().collect();
        sums.sort();
        sums
    }

    fn sort(&mut self) {
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
        let both = || {
            let functions = sum.parts.iter().zip(&added.parts);
            let each = functions.zip(&self.constants).enumerate();
            let used = each.filter(|(_, ((a, b), _))| a.is_some() || b.is_some());
            used.map(|(v, ((a, b), c))| (v, a.as_ref().unwrap_or(c), b.as_ref().unwrap_or(c)))
        };
        let whole: f64 = both().map(|(_, _, b)| b.curve.peak).product::<f64>() * added.weight.abs();
        // For each variable: the ratio of `other`'s function to `one`'s, and the change if they count as proportional.
        let mut compared: Vec<(usize, f64, f64)> = Vec::with_capacity(sum.parts.len());
        let mut different = 0;
        for (v, a, b) in both() {
            let (weight, rest) = a.nearest(b);
            let error = whole * rest / b.curve.peak;
            different += usize::from(!spare.has(sum.output, error));
            if different > 1 {
                return;
            }
            compared.push((v, weight, error));
        }
        for &(variable, ..) in &compared {
            let elsewhere = || compared.iter().filter(move |c| c.0 != variable);
            // Without a sign, which an empty sum has: zeros are equal.
            let error = elsewhere().map(|c| c.2).sum::<f64>().abs();
            if merges(&self.variables[variable].kind) && spare.has(sum.output, error) {
                let weight = added.weight * elsewhere().map(|c| c.1).product::<f64>();
                pairs.push(Pair {
                    error,
                    one,
                    other,
                    variable,
                    weight,
                    compared: 0,
                });
            }
        }
    }

    /// The sum with the smallest change that is cheaper, and the numbers of its terms.
    fn best(&mut self, structure: &Structure, spare: &Spare) -> Option<(Edit, usize, usize)> {
        let uses = Uses::new(structure);
        // What does not fit into the spare tolerance never will.
        let products = &self.products;
        let output = |number: usize| products[number].as_ref().map(|product| product.output);
        self.pairs
            .retain(|pair| output(pair.one).is_some_and(|output| spare.has(output, pair.error)));
        for i in 0..self.pairs.len() {
            let pair = &self.pairs[i];
            let places = [pair.one, pair.other].map(|number| self.place(number));
            let [one, other] = places.map(|place| &structure.terms[place]);
            // A sum that is known to need a table of its own adds one, unless another one ends.
            let mut since = structure.merged[pair.compared..].iter();
            if pair.compared > 0
                && !since.any(|table| table.variable == pair.variable)
                && !uses.ends_with(one, pair.variable, other)
            {
                continue;
            }
            let errors = vec![(one.output, pair.error)];
            let (sum, merged) = self.sum(structure, pair)?;
            // A table may become a product of several.
            if sum.factors.len() > trueaxis::FACTORS {
                continue;
            }
            let edit = Edit {
                errors,
                terms: vec![(places[0], Some(sum)), (places[1], None)],
                merged,
            };
            if structure.is_cheaper_with(&edit, &uses, self.variables) {
                return Some((edit, pair.one, pair.other));
            }
            if edit.merged.is_some() {
                self.pairs[i].compared = structure.merged.len();
            }
        }
        None
    }

    /// The sum of two terms, and its table if it does not exist yet.
    fn sum(&self, structure: &Structure, pair: &Pair) -> Option<(Term, Option<Merged>)> {
        let v = pair.variable;
        let term = &structure.terms[self.place(pair.one)];
        let one = self.products[pair.one].as_ref()?;
        let other = self.products[pair.other].as_ref()?;
        let constant = &self.constants[v];
        let [a, b] = [one, other].map(|p| &p.parts[v].as_ref().unwrap_or(constant).coefficients);
        let both = a.iter().zip(b);
        let sum: Vec<f64> = both
            .map(|(a, b)| term.weight * a + pair.weight * b)
            .collect();
        let mut factors = term.factors.clone();
        factors.retain(|(w, _)| *w != v);
        let products = &self.bases[v].products;
        let only = |k: usize| sum.iter().enumerate().all(|(i, c)| i == k || *c == 0.0);
        let mut merged = None;
        let weight = if let Some(k) = (0..products.len()).find(|k| only(*k)) {
            factors.extend(products[k].iter().map(|g| (v, Function::Generator(*g))));
            sum[k]
        } else {
            let elsewhere = one.parts.iter().enumerate().filter(|(w, _)| *w != v);
            let others = elsewhere.filter_map(|(_, part)| Some(part.as_ref()?.curve.peak));
            let first = pair.compared;
            let known = structure.multiple(first, v, &sum, self.bases, others.product());
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

    /// Follows a sum that was made: `other` was added to `one`.
    fn follow(&mut self, structure: &Structure, one: usize, other: usize, spare: &Spare) {
        self.numbers.retain(|number| *number != other);
        self.products[other] = None;
        let sum = &structure.terms[self.place(one)];
        self.products[one] = structure.product(sum, self.bases);
        let is_changed = |number: usize| [one, other].contains(&number);
        self.pairs
            .retain(|pair| !is_changed(pair.one) && !is_changed(pair.other));
        let mut pairs = Vec::new();
        for &number in &self.numbers {
            self.compare(one, number, spare, &mut pairs);
            self.compare(number, one, spare, &mut pairs);
        }
        self.pairs.append(&mut pairs);
        self.sort();
    }
}
