//! For each variable, the functions that the correction is made of.

use super::sampling::{Component, Sampler};
use super::variables::{Kind, Variable, positions};
use crate::kinematics::NotConverged;
use crate::machine::PerAxis;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A generator: a table from which functions are made as products.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Generator {
    /// [`Variable::coordinate`].
    Coordinate,
    /// [`Variable::sine`].
    Sine,
    /// [`Variable::cosine`].
    Cosine,
}

impl Generator {
    /// Its value at a position of a variable.
    pub fn value(self, variable: &Variable, x: f64) -> f64 {
        match self {
            Self::Coordinate => variable.coordinate(x),
            Self::Sine => variable.sine(x),
            Self::Cosine => variable.cosine(x),
        }
    }
}

/// The functions of one variable: number 0 is the constant 1, then products of generators, then
/// functions found numerically.
#[derive(Clone, Debug)]
pub struct Basis {
    /// Products of generators; the first is empty: the constant.
    pub products: Vec<Vec<Generator>>,
    /// Number of numerical functions.
    pub numeric: usize,
    /// Samples from which numerical functions are computed anywhere.
    columns: Vec<Column>,
    /// Columns × products: their part in the samples.
    known: DMatrix<f64>,
    /// Pseudo-inverse: columns × numeric.
    unfold: DMatrix<f64>,
    /// Largest magnitude of each function in the calibrated range.
    pub peaks: Vec<f64>,
}

/// One output of one component at fixed values of all other variables.
#[derive(Clone, Debug)]
struct Column {
    component: usize,
    monomial: usize,
    node: usize,
    output: usize,
}

/// Samples along one variable at one set of nodes: node fastest, one run for each column.
#[derive(Default)]
struct Along {
    columns: Vec<Column>,
    samples: Vec<f64>,
    /// One of the components is what no more than one switch adds.
    defines: bool,
}

impl Along {
    /// Takes in component `c` along its `k`-th rich variable, in units of the tolerances.
    fn take(&mut self, c: usize, component: &Component, k: usize, tolerance: &[f64]) {
        self.defines |= component.on.count_ones() <= 1;
        let (stride, rich) = (component.stride(k), component.nodes());
        let count = component.rich[k].1.len();
        for monomial in 0..component.monomials.len() {
            for node in (0..rich).filter(|n| n / stride % count == 0) {
                let base = monomial * rich + node;
                for (output, unit) in tolerance.iter().enumerate() {
                    let value = |i: usize| component.values[base + i * stride][output] / unit;
                    self.samples.extend((0..count).map(value));
                    self.columns.push(Column {
                        component: c,
                        monomial,
                        node,
                        output,
                    });
                }
            }
        }
    }
}

/// How a basis is chosen.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Highest degree of the products of generators tried.
    pub degree: usize,
    /// What may be left out in any sample, in units of the tolerance.
    pub leave: f64,
}

impl Basis {
    fn lever() -> Self {
        Self {
            products: (0..=2).map(|d| vec![Generator::Coordinate; d]).collect(),
            numeric: 0,
            columns: Vec::new(),
            known: DMatrix::zeros(0, 3),
            unfold: DMatrix::zeros(0, 0),
            peaks: vec![1.0; 3],
        }
    }

    /// The basis of a lever with its peaks in the calibrated range.
    pub fn of_lever(variable: &Variable) -> Self {
        let ends = variable.calibrated.map(|x| variable.coordinate(x).abs());
        let peak = ends[0].max(ends[1]);
        Self {
            peaks: vec![1.0, peak, peak * peak],
            ..Self::lever()
        }
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.products.len() + self.numeric
    }

    /// Values of the products at positions: positions × products.
    fn product_values(&self, variable: &Variable, at: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(at.len(), self.products.len(), |i, k| {
            self.products[k]
                .iter()
                .map(|g| g.value(variable, at[i]))
                .product()
        })
    }

    /// Finds the basis of a rich variable from the components that depend on it.
    ///
    /// `tolerance` is per output (mm or rad); all values are taken in its units.
    pub fn find(
        v: usize,
        sampler: &Sampler<'_>,
        components: &[Component],
        tolerance: &PerAxis,
        choice: Choice,
    ) -> Result<Self, NotConverged> {
        let variable = &sampler.variables[v];
        let outputs = sampler.kinematics.machine.axes.len();
        let mut along: BTreeMap<usize, Along> = BTreeMap::new();
        for (c, component) in components.iter().enumerate() {
            let Some(k) = component.rich.iter().position(|(w, _)| *w == v) else {
                continue;
            };
            let group = along.entry(component.rich[k].1.len()).or_default();
            group.take(c, component, k, &tolerance[..outputs]);
        }
        // What several motions add together is seen at few nodes: too few to tell functions by.
        along.retain(|_, group| group.defines);
        let mut basis = Self {
            products: vec![vec![]],
            ..Self::lever()
        };
        // The group with most nodes is the last; where there is none, nothing depends on this.
        let Some((full, last)) = along.pop_last() else {
            return Ok(basis.with_peaks(variable, sampler, components, tolerance));
        };
        let nodes = variable.positions(full);
        let samples = DMatrix::from_vec(full, last.columns.len(), last.samples);
        let few: Vec<(Vec<f64>, DMatrix<f64>)> = along
            .into_iter()
            .map(|(count, group)| {
                let samples = DMatrix::from_vec(count, group.columns.len(), group.samples);
                (variable.positions(count), samples)
            })
            .collect();
        let largest = |m: &DMatrix<f64>| if m.is_empty() { 0.0 } else { m.amax() };
        let lowest = if matches!(variable.kind, Kind::Rotary(_)) {
            0
        } else {
            2
        };
        let mut holds = false;
        for degree in lowest..=choice.degree {
            basis.products = products(&variable.kind, degree);
            let left = |nodes: &[f64], samples: &DMatrix<f64>| {
                let values = basis.product_values(variable, nodes);
                let pinv = values.clone().pseudo_inverse(1e-10).ok()?;
                Some(largest(&(samples - &values * (pinv * samples))))
            };
            // Each group at its own nodes; a product too many for them tells nothing.
            let fits = |(nodes, samples): (&[f64], &DMatrix<f64>)| {
                left(nodes, samples).is_some_and(|left| left < choice.leave)
            };
            holds = fits((&nodes, &samples)) && few.iter().all(|(n, s)| fits((n, s)));
            if holds {
                break;
            }
        }
        // If the products do not do it, the lowest degree that first order calls for and
        // numerical functions for the rest.
        if !holds {
            let degree = 2;
            basis.products = products(&variable.kind, degree);
            let values = basis.product_values(variable, &nodes);
            let pinv = values
                .clone()
                .pseudo_inverse(1e-10)
                .unwrap_or_else(|_| DMatrix::zeros(values.ncols(), values.nrows()));
            let residual = &samples - &values * (pinv * &samples);
            let (functions, numeric) = leading(&residual, choice.leave);
            basis.numeric = numeric;
            let mut all = values.clone().insert_columns(values.ncols(), numeric, 0.0);
            all.columns_mut(values.ncols(), numeric)
                .copy_from(&functions);
            let Ok(pinv) = all.clone().pseudo_inverse(1e-12) else {
                basis.numeric = 0;
                return Ok(basis.with_peaks(variable, sampler, components, tolerance));
            };
            let weights = pinv * &samples; // functions × columns
            basis.choose_columns(&weights, last.columns);
        }
        Ok(basis.with_peaks(variable, sampler, components, tolerance))
    }

    /// Keeps the columns from which the numerical functions can be computed best: those that a
    /// pivoted factorisation of their weights picks, twice over.
    fn choose_columns(&mut self, weights: &DMatrix<f64>, all: Vec<Column>) {
        let p = self.products.len();
        let numeric = weights.rows(p, self.numeric).into_owned();
        let mut chosen: Vec<usize> = Vec::new();
        for _ in 0..2 {
            let mut rest = numeric.clone();
            for _ in 0..self.numeric {
                let best = (0..rest.ncols())
                    .filter(|c| !chosen.contains(c))
                    .map(|c| (c, rest.column(c).norm_squared()))
                    .max_by(|a, b| a.1.total_cmp(&b.1));
                let Some((pivot, norm)) = best else { break };
                if norm <= 0.0 {
                    break;
                }
                chosen.push(pivot);
                let direction: DVector<f64> = rest.column(pivot) / norm.sqrt();
                let along = direction.transpose() * &rest;
                rest -= &direction * along;
            }
        }
        let part = DMatrix::from_fn(self.numeric, chosen.len(), |k, c| numeric[(k, chosen[c])]);
        self.known = DMatrix::from_fn(chosen.len(), p, |c, k| weights[(k, chosen[c])]);
        self.unfold = part
            .transpose()
            .pseudo_inverse(1e-12)
            .map(|m| m.transpose())
            .unwrap_or_else(|_| DMatrix::zeros(chosen.len(), self.numeric));
        self.columns = chosen.into_iter().map(|c| all[c].clone()).collect();
    }

    /// Values of all functions at positions: positions × functions.
    pub fn values(
        &self,
        v: usize,
        sampler: &Sampler<'_>,
        components: &[Component],
        tolerance: &PerAxis,
        at: &[f64],
    ) -> Result<DMatrix<f64>, NotConverged> {
        let products = self.product_values(&sampler.variables[v], at);
        if self.numeric == 0 {
            return Ok(products);
        }
        // Columns that differ in the output only share their exact corrections.
        let mut shared: Vec<(usize, usize, usize)> = self
            .columns
            .iter()
            .map(|c| (c.component, c.monomial, c.node))
            .collect();
        shared.sort_unstable();
        shared.dedup();
        let rows: Result<Vec<Vec<f64>>, NotConverged> = at
            .par_iter()
            .map(|x| {
                let mut found = Vec::with_capacity(shared.len());
                for &(c, monomial, node) in &shared {
                    let component = &components[c];
                    let mut place = component.place(node);
                    place[v] = *x;
                    found.push(sampler.coefficient(component, monomial, &place)?);
                }
                Ok(self
                    .columns
                    .iter()
                    .map(|c| {
                        let key = (c.component, c.monomial, c.node);
                        let k = shared.binary_search(&key).unwrap_or(0);
                        found[k][c.output] / tolerance[c.output]
                    })
                    .collect())
            })
            .collect();
        let rows = rows?;
        let samples = DMatrix::from_fn(at.len(), self.columns.len(), |i, c| rows[i][c]);
        let rest = samples - &products * self.known.transpose();
        let numeric = rest * &self.unfold;
        let mut values = products
            .clone()
            .insert_columns(products.ncols(), self.numeric, 0.0);
        values
            .columns_mut(products.ncols(), self.numeric)
            .copy_from(&numeric);
        Ok(values)
    }

    fn with_peaks(
        mut self,
        variable: &Variable,
        sampler: &Sampler<'_>,
        components: &[Component],
        tolerance: &PerAxis,
    ) -> Self {
        let v = sampler
            .variables
            .iter()
            .position(|w| w == variable)
            .unwrap_or(0);
        let at = positions(variable.calibrated, variable.nodes);
        if let Ok(values) = self.values(v, sampler, components, tolerance, &at) {
            self.peaks = values.column_iter().map(|c| c.amax()).collect();
        } else {
            self.peaks = vec![1.0; self.len()];
        }
        self
    }
}

/// The products of generators up to a degree: sin at most once, for sin² = 1 − cos².
fn products(kind: &Kind, degree: usize) -> Vec<Vec<Generator>> {
    match kind {
        Kind::Rotary(_) => {
            let mut all = vec![vec![]];
            for d in 1..=degree {
                all.push(vec![Generator::Cosine; d]);
                let mut with_sine = vec![Generator::Sine];
                with_sine.extend(vec![Generator::Cosine; d - 1]);
                all.push(with_sine);
            }
            all
        }
        _ => (0..=degree)
            .map(|d| vec![Generator::Coordinate; d])
            .collect(),
    }
}

/// The leading left singular functions of the residual (nodes × columns), as many as leave no
/// more than `leave` in any sample.
fn leading(residual: &DMatrix<f64>, leave: f64) -> (DMatrix<f64>, usize) {
    // The left factor of an SVD is that of R in a QR of the transpose; columns are folded in
    // blocks, so memory and time stay proportional to their number.
    let n = residual.nrows();
    let mut r = DMatrix::<f64>::zeros(0, n);
    let block = 4 * n;
    let mut start = 0;
    while start < residual.ncols() {
        let count = block.min(residual.ncols() - start);
        let rows = residual.columns(start, count).transpose();
        let mut stacked = DMatrix::zeros(r.nrows() + count, n);
        stacked.rows_mut(0, r.nrows()).copy_from(&r);
        stacked.rows_mut(r.nrows(), count).copy_from(&rows);
        r = stacked.qr().unpack_r();
        start += count;
    }
    if r.is_empty() {
        return (DMatrix::zeros(n, 0), 0);
    }
    let svd = r.svd(false, true);
    let Some(v_t) = svd.v_t else {
        return (DMatrix::zeros(n, 0), 0);
    };
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let mut rest = residual.clone();
    let mut count = 0;
    while count < order.len() && rest.amax() >= leave {
        let u = v_t.row(order[count]).transpose();
        let along = u.transpose() * &rest;
        rest -= &u * along;
        count += 1;
    }
    let functions = DMatrix::from_fn(n, count, |i, k| v_t[(order[k], i)]);
    (functions, count)
}
