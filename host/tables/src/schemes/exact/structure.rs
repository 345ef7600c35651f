//! Terms, and the tables whose products they are.

use super::basis::Basis;
use super::core::{Entry, Key};
use super::generators::Generator;
use super::variables::{Kind, Variable};
use std::collections::HashMap;

/// A table of one variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    /// A generator.
    Generator(Generator),
    /// A numerical basis function, by its index in the basis.
    Numeric(usize),
    /// A sum of basis functions, by its index in [`Structure::merged`].
    Merged(usize),
    /// The direction of travel: +1, −1, 0 if unknown.
    Sign,
}

/// One term: weight × product of tables → one output.
#[derive(Clone, Debug)]
pub struct Term {
    /// Index of the output axis.
    pub output: usize,
    /// Weight, in units of the output's tolerance, divided by those of a merged table.
    pub weight: f64,
    /// Tables: variable and function.
    pub factors: Vec<(usize, Function)>,
}

/// A sum of basis functions of one variable, as one table.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The variable.
    pub variable: usize,
    /// Coefficients over the variable's basis.
    pub coefficients: Vec<f64>,
}

/// Terms and the tables they use.
#[derive(Clone, Debug, Default)]
pub struct Structure {
    /// The terms.
    pub terms: Vec<Term>,
    /// Tables that are sums of basis functions.
    pub merged: Vec<Merged>,
}

/// Two merged tables that differ by less than this (in units of the tolerance) are treated as one.
const SAME: f64 = 0.02;

impl Structure {
    /// Adds one entry as a separate term. If its product is too long, the longest parts become merged tables.
    pub fn single(&mut self, entry: &Entry, variables: &[Variable], bases: &[Basis]) {
        let mut key = entry.key;
        let mut short = Vec::new();
        let factors = loop {
            match self.factors(&key, variables, bases) {
                Some(factors) if factors.len() + short.len() <= trueaxis::FACTORS => break factors,
                _ => {
                    let length = |v: usize| {
                        bases[v]
                            .products
                            .get(usize::from(key[v]))
                            .map_or(0, Vec::len)
                    };
                    let long = (0..variables.len()).filter(|v| length(*v) > 1);
                    // Nothing left to shorten: leave the entry out.
                    let Some(v) = long.max_by_key(|v| length(*v)) else {
                        return;
                    };
                    let mut coefficients = vec![0.0; bases[v].len()];
                    coefficients[usize::from(key[v])] = 1.0;
                    let (id, _) = self.merge(v, coefficients, bases, 1.0);
                    short.push((v, Function::Merged(id)));
                    key[v] = 0;
                }
            }
        };
        let factors = factors.into_iter().chain(short).collect();
        self.terms.push(Term {
            output: entry.output,
            weight: entry.value,
            factors,
        });
    }

    /// The tables of a product, or `None` if there are more than a term may hold.
    pub fn factors(
        &self,
        key: &Key,
        variables: &[Variable],
        bases: &[Basis],
    ) -> Option<Vec<(usize, Function)>> {
        let mut factors = Vec::new();
        for (v, variable) in variables.iter().enumerate() {
            let k = usize::from(key[v]);
            match bases[v].products.get(k) {
                _ if k == 0 => {}
                Some(_) if matches!(variable.kind, Kind::Sign(_)) => {
                    factors.push((v, Function::Sign))
                }
                Some(product) => {
                    factors.extend(product.iter().map(|g| (v, Function::Generator(*g))))
                }
                None => factors.push((v, Function::Numeric(k))),
            }
        }
        (factors.len() <= trueaxis::FACTORS).then_some(factors)
    }

    /// A merged table for these coefficients: an existing proportional one, or a new one. Returns its number and the
    /// weight to use with it.
    pub(crate) fn merge(
        &mut self,
        variable: usize,
        coefficients: Vec<f64>,
        bases: &[Basis],
        others: f64,
    ) -> (usize, f64) {
        if let Some(known) = self.multiple(0, variable, &coefficients, bases, others) {
            return known;
        }
        self.merged.push(Merged {
            variable,
            coefficients,
        });
        (self.merged.len() - 1, 1.0)
    }

    /// The first merged table from number `first` on that is proportional to these coefficients, and the weight to use
    /// with it.
    pub(crate) fn multiple(
        &self,
        first: usize,
        variable: usize,
        coefficients: &[f64],
        bases: &[Basis],
        others: f64,
    ) -> Option<(usize, f64)> {
        let norm = |c: &[f64]| c.iter().map(|c| c * c).sum::<f64>();
        let same = self.merged.iter().enumerate().skip(first);
        let mut same = same.filter(|(_, m)| m.variable == variable);
        same.find_map(|(id, known)| {
            let both = || known.coefficients.iter().zip(coefficients);
            let along: f64 = both().map(|(a, b)| a * b).sum();
            let weight = along / norm(&known.coefficients);
            let rest: f64 = both()
                .zip(&bases[variable].peaks)
                .map(|((a, b), peak)| (b - weight * a).abs() * peak)
                .sum();
            (rest * others < SAME).then_some((id, weight))
        })
    }

    /// The number of tables.
    pub fn count(&self) -> usize {
        self.tables().len()
    }

    /// The tables in use, without repetition.
    pub fn tables(&self) -> Vec<(usize, Function)> {
        let mut tables: Vec<(usize, Function)> = self
            .terms
            .iter()
            .flat_map(|t| t.factors.iter().copied())
            .collect();
        tables.sort_unstable();
        tables.dedup();
        tables
    }

    /// Evaluates the terms with given function values for each variable.
    pub fn evaluate(&self, values: &HashMap<(usize, Function), f64>, outputs: usize) -> Vec<f64> {
        let mut sums = vec![0.0; outputs];
        for term in &self.terms {
            let product: f64 = term.factors.iter().map(|f| values[f]).product();
            sums[term.output] += term.weight * product;
        }
        sums
    }
}
