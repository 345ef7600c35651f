//! From a structure to a cheaper one: adds up terms of an output that differ along only one variable, and merges tables
//! that are equal to within the tolerance.
//!
//! Sums of basis functions are chosen one fibre after the other. Only afterwards does it show that two of the
//! resulting tables are multiples of each other, or that one is a product of others.

use super::basis::Basis;
use super::edit::{Edit, Spare, Uses, peak_with};
use super::structure::{Function, Merged, Structure, Term};
use super::variables::{Generator, Variable};
use std::collections::BTreeMap;
use trueaxis_model::parallel;

/// A function of one variable, by its values at the nodes.
struct Curve {
    values: Vec<f64>,
    square: f64,
    /// The largest magnitude.
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

/// A multiple of a product of tables of one variable, in place of a merged table.
struct Replacement<'a> {
    variable: usize,
    /// The merged table, and the places and peaks of the terms that use it.
    gone: usize,
    users: &'a [(usize, f64)],
    factors: &'a [(usize, Function)],
    weight: f64,
    /// The residual, as a part of the merged table's peak.
    part: f64,
}

/// How well one merged table replaces another, if known: the factor, and the residual.
type Multiple = Option<(f64, f64)>;

/// The places of the terms that use each merged table, with their peaks.
type Users = Vec<Vec<(usize, f64)>>;

impl Structure {
    /// Adds up terms of an output that differ along only one variable, and replaces tables by multiples or products
    /// of others, as long as that is cheaper and fits into the spare tolerance.
    pub fn fold(&mut self, variables: &[Variable], bases: &[Basis], spare: &mut Spare) {
        self.add_up(variables, bases, spare);
        // The terms change from now on, the merged tables do not.
        let at_nodes = |table: &Merged| bases[table.variable].at_nodes(&table.coefficients);
        let curves: Vec<Curve> = self.merged.iter().map(at_nodes).map(Curve::new).collect();
        let mut multiples = vec![None; curves.len() * curves.len()];
        while self.share_once(variables, bases, (&curves, &mut multiples), spare) {}
        while self.split_once(variables, bases, &curves, spare) {}
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
                    factors: &[(v, Function::Merged(kept))],
                    weight,
                    part: rest / curves[gone].peak,
                };
                self.consider(&mut best, &replacement, variables, &uses, spare);
            }
        }
        self.settle(best, spare)
    }

    /// Replaces a merged table by the product of a generator and another table, choosing the smallest change.
    fn split_once(
        &mut self,
        variables: &[Variable],
        bases: &[Basis],
        curves: &[Curve],
        spare: &mut Spare,
    ) -> bool {
        let tables = self.tables();
        let users = self.users(bases, curves);
        let (uses, mut best) = (Uses::new(self), None);
        for of_one in tables.chunk_by(|a, b| a.0 == b.0) {
            let products = self.products_with(of_one, bases);
            for &(v, whole) in of_one {
                let Function::Merged(gone) = whole else {
                    continue;
                };
                for (factors, curve) in products.iter().filter(|(f, _)| f[1] != (v, whole)) {
                    let (weight, rest) = curve.nearest(&curves[gone]);
                    let replacement = Replacement {
                        variable: v,
                        gone,
                        users: &users[gone],
                        factors,
                        weight,
                        part: rest / curves[gone].peak,
                    };
                    self.consider(&mut best, &replacement, variables, &uses, spare);
                }
            }
        }
        self.settle(best, spare)
    }

    /// The products of a sine or cosine and another table, both among these of one variable.
    fn products_with(
        &self,
        tables: &[(usize, Function)],
        bases: &[Basis],
    ) -> Vec<([(usize, Function); 2], Curve)> {
        let mut products = Vec::new();
        for (k, product) in bases[tables[0].0].products.iter().enumerate() {
            let &[Generator::Sine | Generator::Cosine] = product.as_slice() else {
                continue;
            };
            let generator = (tables[0].0, Function::Generator(product[0]));
            if !tables.contains(&generator) {
                continue;
            }
            let basis = &bases[generator.0];
            let by = basis.at_nodes(&unit(k, basis.len()));
            for &(v, kept) in tables {
                if let Some(coefficients) = self.coefficients(kept, basis) {
                    let other = basis.at_nodes(&coefficients);
                    let values = other.iter().zip(&by).map(|(a, by)| a * by).collect();
                    products.push(([generator, (v, kept)], Curve::new(values)));
                }
            }
        }
        products
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
                    term.factors.extend(with.factors);
                } else {
                    term.factors.push(factor);
                }
            }
            if term.factors.len() > trueaxis::FACTORS {
                return;
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
    fn coefficients(&self, function: Function, basis: &Basis) -> Option<Vec<f64>> {
        match function {
            Function::Merged(id) => Some(self.merged[id].coefficients.clone()),
            Function::Numeric(k) => Some(unit(k, basis.len())),
            Function::Generator(_) | Function::Sign => None,
        }
    }
}

/// The coefficients of function `k` alone.
fn unit(k: usize, count: usize) -> Vec<f64> {
    let mut coefficients = vec![0.0; count];
    coefficients[k] = 1.0;
    coefficients
}

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

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::structure::Term;
    use super::super::variables::variables;
    use super::*;
    use trueaxis::FACTORS;
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
    fn three_terms_become_one_in_two_rounds() {
        let mut made = Made::default();
        for (constant, slope) in [(0.5, 1.0), (0.25, -0.5), (1.0, 0.125)] {
            let table = made.table(Y, vec![constant, slope, 0.0]);
            made.term(0, 1.0, &[ALONG_X, table]);
        }
        let (structure, change) = folded(&made, 1e-6, [X, Y]);
        assert_eq!((structure.terms.len(), structure.count()), (1, 2));
        assert!(change < 1e-12, "{change}");
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
    fn a_sum_that_is_a_product_of_too_many_tables_is_not_made() {
        use Generator::{Coordinate, Cosine, Sine};
        let (_, bases) = specimen();
        let [single, double] = [vec![Sine], vec![Sine, Cosine]].map(|p| number_of(&bases[C], &p));
        let (mut one, mut other) = (vec![0.0; bases[C].len()], vec![0.0; bases[C].len()]);
        (one[single], one[double], other[single]) = (0.7, 0.5, -0.7);
        for count in [FACTORS - 1, FACTORS] {
            let mut made = Made::default();
            let [one, other] = [&one, &other].map(|c| made.table(C, c.clone()));
            for own in [one, other] {
                let levers = [X, X, Y, Y, 2].map(|v| (v, Function::Generator(Coordinate)));
                let factors = [&levers[..count - 1], &[own]].concat();
                made.term(0, 1.0, &factors);
            }
            let (structure, change) = folded(&made, 1e-6, [X, C]);
            assert_eq!(structure.terms.len(), if count < FACTORS { 1 } else { 2 });
            assert!(structure.terms.iter().all(|t| t.factors.len() <= FACTORS));
            assert!(change < 1e-9, "{change}");
        }
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
