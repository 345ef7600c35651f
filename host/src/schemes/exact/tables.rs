//! From a structure to tables with points.

use super::basis::Basis;
use super::cover::{Function, Structure};
use super::generators::Generator;
use super::sampling::{Component, Sampler};
use super::variables::{Kind, Variable};
use crate::kinematics::NotConverged;
use crate::machine::{Machine, PerAxis};
use nalgebra::DMatrix;
use std::collections::{BTreeMap, HashMap};

/// Everything found about a correction.
pub struct Found<'a> {
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

impl Found<'_> {
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

    /// How far linear interpolation of a variable's tables with `intervals` intervals may lead
    /// each output astray, in units of its tolerance: table by table at mid-interval, with the
    /// other factors at their peaks.
    pub fn interpolation_error(
        &self,
        v: usize,
        functions: &[Function],
        intervals: usize,
    ) -> Result<f64, NotConverged> {
        let variable = &self.sampler.variables[v];
        let [low, high] = variable.range;
        let at: Vec<f64> = (0..=2 * intervals)
            .map(|i| low + (high - low) * i as f64 / (2 * intervals) as f64)
            .collect();
        let sampled = self.sample(v, functions, &at)?;
        let peak_of = |w: usize, f: &Function| -> f64 {
            match f {
                Function::Numeric(k) => self.bases[w].peaks[*k],
                Function::Merged(id) => {
                    let coefficients = &self.structure.merged[*id].coefficients;
                    coefficients
                        .iter()
                        .zip(&self.bases[w].peaks)
                        .map(|(c, p)| c.abs() * p)
                        .sum()
                }
                _ => 1.0,
            }
        };
        // Next to the ends of the calibrated range nothing is gained by more points.
        let touches_end = |k: usize| {
            let width = (high - low) / intervals as f64;
            let (from, to) = (low + width * k as f64, low + width * (k + 1) as f64);
            variable
                .ends
                .iter()
                .any(|e| *e > from - 1e-6 * width && *e < to + 1e-6 * width)
        };
        let mut error = vec![PerAxis::default(); intervals];
        for term in &self.structure.terms {
            let others: f64 = term
                .factors
                .iter()
                .filter(|(w, _)| *w != v)
                .map(|(w, f)| peak_of(*w, f))
                .product();
            let own: Vec<usize> = term
                .factors
                .iter()
                .filter(|(w, _)| *w == v)
                .filter_map(|(_, f)| sampled.functions.iter().position(|g| g == f))
                .collect();
            if own.is_empty() {
                continue;
            }
            for (k, error) in error
                .iter_mut()
                .enumerate()
                .filter(|(k, _)| !touches_end(*k))
            {
                let product = |row: usize| {
                    own.iter()
                        .map(|c| sampled.values[(row, *c)])
                        .product::<f64>()
                };
                let interpolated: f64 = own
                    .iter()
                    .map(|c| 0.5 * (sampled.values[(2 * k, *c)] + sampled.values[(2 * k + 2, *c)]))
                    .product();
                error[term.output] +=
                    term.weight * others * (interpolated - product(2 * k + 1)).abs();
            }
        }
        Ok(error
            .iter()
            .flatten()
            .fold(0.0, |worst, e| worst.max(e.abs())))
    }

    /// The smallest number of intervals, at least `least`, that puts the variable's kinks on
    /// points; `least` itself if none up to half as many again does.
    pub fn aligned(&self, v: usize, least: usize) -> usize {
        let variable = &self.sampler.variables[v];
        let [low, high] = variable.range;
        let fits = |n: usize| {
            variable.kinks.iter().all(|k| {
                let steps = (k - low) / (high - low) * n as f64;
                (steps - steps.round()).abs() < 1e-6
            })
        };
        (least..=least + least / 2)
            .find(|n| fits(*n))
            .unwrap_or(least)
    }

    /// Tables in use per variable, the bent ones and the straight ones.
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
}

/// Which runtime input a variable is, and how its values convert to the input's unit.
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

/// A number for each table, for evaluation in f64 at one place.
pub fn values_at(
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
