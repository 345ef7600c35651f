//! From a structure to tables with points.

use super::basis::Basis;
use super::generators::Generator;
use super::sampling::{Component, Sampler};
use super::structure::{Function, Structure, Term};
use super::variables::{Kind, Variable};
use nalgebra::DMatrix;
use std::collections::{BTreeMap, HashMap};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::{Machine, PerAxis};

/// Everything that is known about a correction.
pub struct Decomposition<'a> {
    pub sampler: &'a Sampler<'a>,
    pub components: &'a [Component],
    pub bases: &'a [Basis],
    pub tolerance: &'a PerAxis,
    pub structure: &'a Structure,
}

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
    /// Its weight times the peaks of its other tables.
    weight: f64,
    /// Its own tables of the variable, by their columns.
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

/// The values of all tables at one place, in f64.
pub(crate) fn values_at(
    sampled: &BTreeMap<usize, Sampled>,
    row: usize,
) -> HashMap<(usize, Function), f64> {
    sampled
        .iter()
        .flat_map(|(v, s)| {
            s.functions
                .iter()
                .enumerate()
                .map(move |(k, f)| ((*v, *f), s.values[(row, k)]))
        })
        .collect()
}
