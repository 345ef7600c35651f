//! Terms, and the tables whose products they are: from basis functions to the values of tables at any position.

use super::basis::Basis;
use super::component::Component;
use super::sampling::Sampler;
use super::variables::{Generator, Kind, MAX_VARIABLES, Variable};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::sync::Mutex;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::{Machine, PerAxis};

/// The function of each variable in a product; 0 is the constant.
pub type Key = [u8; MAX_VARIABLES];

/// One product of basis functions in one output.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Index of the output axis.
    pub output: usize,
    /// The functions.
    pub key: Key,
    /// Coefficient, in units of the output's tolerance.
    pub value: f64,
    /// The largest possible contribution, in the same units.
    pub peak: f64,
}

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
        if let Some(known) = self.multiple(variable, &coefficients, &bases[variable], others) {
            return known;
        }
        self.merged.push(Merged {
            variable,
            coefficients,
        });
        (self.merged.len() - 1, 1.0)
    }

    /// The first merged table that is proportional to these coefficients, and the weight to use with it.
    pub(crate) fn multiple(
        &self,
        variable: usize,
        coefficients: &[f64],
        basis: &Basis,
        others: f64,
    ) -> Option<(usize, f64)> {
        let most = SAME / others;
        let same = self.merged.iter().enumerate();
        let mut same = same.filter(|(_, m)| m.variable == variable);
        same.find_map(|(id, known)| {
            let both = || known.coefficients.iter().zip(coefficients);
            let sums = |(along, square), (a, b): (&f64, &f64)| (along + a * b, square + a * a);
            let (along, square) = both().fold((0.0, 0.0), sums);
            let weight: f64 = along / square;
            // Most tables already differ too much in their first coefficients.
            let rest = both()
                .zip(&basis.peaks)
                .try_fold(0.0, |rest, ((a, b), peak)| {
                    let rest = rest + (b - weight * a).abs() * peak;
                    (rest < most).then_some(rest)
                });
            rest.map(|_| (id, weight))
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
}

/// Everything that is known about a correction.
pub struct Decomposition<'a> {
    pub sampler: &'a Sampler<'a>,
    pub components: &'a [Component],
    pub bases: &'a [Basis],
    pub tolerance: &'a PerAxis,
    pub structure: &'a Structure,
    /// Errors of grids, each measured once: drafts with more and with fewer points look at many of the same.
    pub memory: Memory,
}

/// The error of linear interpolation between a variable's tables on a grid: by the variable, and the bits of the grid's start and step.
pub type Memory = Mutex<BTreeMap<(usize, u64, u64), f64>>;

/// Values of one variable's tables at some positions.
pub struct Sampled {
    /// The tables, in the order of the columns.
    pub functions: Vec<Function>,
    /// Positions × tables.
    pub values: DMatrix<f64>,
}

/// What a term makes of the tables of one variable.
pub struct Contribution {
    output: usize,
    /// The weight times the peaks of the term's other tables.
    weight: f64,
    /// The term's tables of the variable, by their columns.
    own: Vec<usize>,
}

/// The error in each output if tables are interpolated with these weights of rows, compared with the true values in a
/// row of `truth`. Both have a column for each table.
pub fn errors_at(
    contributions: &[Contribution],
    (sampled, weights): (&DMatrix<f64>, &[(usize, f64)]),
    (truth, row): (&DMatrix<f64>, usize),
) -> PerAxis {
    let mut errors = PerAxis::default();
    for term in contributions {
        let exact: f64 = term.own.iter().map(|c| truth[(row, *c)]).product();
        let between = |c: &usize| {
            let parts = weights.iter().map(|(k, w)| w * sampled[(*k, *c)]);
            parts.sum::<f64>()
        };
        let interpolated: f64 = term.own.iter().map(between).product();
        errors[term.output] += (term.weight * (interpolated - exact)).abs();
    }
    errors
}

impl Decomposition<'_> {
    /// The tables of one variable, at positions in its kinematic unit.
    pub fn sample(
        &self,
        v: usize,
        functions: &[Function],
        at: &[f64],
    ) -> Result<Sampled, NotConverged> {
        let basis = &self.bases[v];
        let variable = &self.sampler.variables[v];
        let known = functions
            .iter()
            .all(|f| matches!(f, Function::Generator(_) | Function::Sign));
        let all = if known {
            DMatrix::zeros(0, 0)
        } else {
            basis.values(v, self.sampler, self.components, self.tolerance, at)?
        };
        let value = |i: usize, function: &Function| match function {
            Function::Generator(generator) => generator.value(variable, at[i]),
            Function::Numeric(k) => all[(i, *k)],
            Function::Merged(id) => {
                let coefficients = &self.structure.merged[*id].coefficients;
                coefficients
                    .iter()
                    .enumerate()
                    .map(|(k, c)| c * all[(i, k)])
                    .sum()
            }
            Function::Sign => at[i],
        };
        Ok(Sampled {
            functions: functions.to_vec(),
            values: DMatrix::from_fn(at.len(), functions.len(), |i, k| value(i, &functions[k])),
        })
    }

    /// True for tables that are straight lines over the whole range.
    pub fn is_straight(&self, v: usize, function: &Function) -> bool {
        match function {
            Function::Generator(Generator::Coordinate) => true,
            Function::Merged(id) => {
                let products = &self.bases[v].products;
                let coefficients = &self.structure.merged[*id].coefficients;
                coefficients.iter().enumerate().all(|(k, c)| {
                    *c == 0.0
                        || k == 0
                        || matches!(
                            products.get(k).map(Vec::as_slice),
                            Some([Generator::Coordinate])
                        )
                })
            }
            _ => false,
        }
    }

    /// Tables in use per variable: bent ones and straight ones.
    pub fn tables(&self) -> BTreeMap<usize, (Vec<Function>, Vec<Function>)> {
        let mut tables: BTreeMap<usize, (Vec<Function>, Vec<Function>)> = BTreeMap::new();
        for (v, function) in self.structure.tables() {
            let (bent, straight) = tables.entry(v).or_default();
            if self.is_straight(v, &function) {
                straight.push(function);
            } else {
                bent.push(function);
            }
        }
        tables
    }

    /// The terms that contain some of the tables of one variable, with all others at their peaks.
    pub fn contributions(&self, v: usize, functions: &[Function]) -> Vec<Contribution> {
        let of_term = |term: &Term| {
            let own = term.factors.iter().filter(|(w, _)| *w == v);
            let own = own.filter_map(|(_, f)| functions.iter().position(|g| g == f));
            let others = term.factors.iter().filter(|(w, _)| *w != v);
            let others: f64 = others.map(|(w, f)| self.peak(*w, f)).product();
            Contribution {
                output: term.output,
                weight: term.weight * others,
                own: own.collect(),
            }
        };
        let all = self.structure.terms.iter().map(of_term);
        all.filter(|term| !term.own.is_empty()).collect()
    }

    /// Largest magnitude of a table in the calibrated range, or an upper bound.
    fn peak(&self, v: usize, function: &Function) -> f64 {
        match function {
            Function::Numeric(k) => self.bases[v].peaks[*k],
            Function::Merged(id) => self.bases[v].peak_of(&self.structure.merged[*id].coefficients),
            _ => 1.0,
        }
    }
}

/// The runtime input of a variable, and the factor that converts its values to the input's unit.
pub fn input(machine: &Machine, variables: &[Variable], v: usize) -> (u8, f64) {
    let axes = machine.axes.len();
    let with_length = usize::from(variables.iter().any(|w| w.kind == Kind::Length));
    match variables[v].kind {
        Kind::Affine(i) | Kind::Bending(i) => (i as u8, 1.0),
        Kind::Rotary(i) => (i as u8, 1.0_f64.to_degrees()),
        Kind::Sign(i) => (i as u8, 1.0),
        Kind::Length => (axes as u8, 1.0),
        Kind::Kelvin(k) => ((axes + with_length + k) as u8, 1.0),
    }
}
