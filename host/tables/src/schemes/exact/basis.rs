//! Finds, for each variable, the functions that the correction consists of.

use super::along::{Along, Column, Shows};
use super::component::Component;
use super::sampling::Sampler;
use super::variables::{Generator, Kind, Variable, products};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::order;

/// Singular values below this fraction of the largest are rounding; samples are accurate to 1e-10 of their values.
pub const ROUNDING: f64 = 1e-12;
/// The functions of one variable. Number 0 is the constant 1, followed by products of generators, then by functions
/// found numerically: those present with the axis' own motions off, those of its motions, and those of its motions
/// together with another axis'.
#[derive(Clone, Debug)]
pub struct Basis {
    /// Products of generators; the first is empty: the constant.
    pub products: Vec<Vec<Generator>>,
    /// Functions found numerically.
    numeric: Vec<Numeric>,
    /// The functions that make up samples of a kind at a given number of nodes.
    shown: BTreeMap<(Shows, usize), Vec<usize>>,
    /// Values at nodes of the calibrated range: nodes × functions.
    seen: DMatrix<f64>,
    /// Largest magnitude of each function there.
    pub peaks: Vec<f64>,
}

/// Functions found numerically in one kind of samples, in the residual of the functions before them.
#[derive(Clone, Debug)]
struct Numeric {
    /// Samples from which the functions can be computed at any position.
    columns: Vec<Column>,
    /// Columns × earlier functions: their coefficients in the samples.
    known: DMatrix<f64>,
    /// Pseudo-inverse: columns × functions.
    unfold: DMatrix<f64>,
}

/// How a basis is chosen.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Highest degree of the products of generators tried.
    pub degree: usize,
    /// Largest residual permitted in any sample, in units of the tolerance.
    pub leave: f64,
}

impl Basis {
    fn of_products(products: Vec<Vec<Generator>>) -> Self {
        Self {
            peaks: vec![1.0; products.len()],
            products,
            numeric: Vec::new(),
            shown: BTreeMap::new(),
            seen: DMatrix::zeros(0, 0),
        }
    }

    /// The basis of a lever with its peaks in the calibrated range.
    pub(crate) fn of_lever(variable: &Variable) -> Self {
        Self::of_generators(variable, 2, &variable.calibrated)
    }

    /// All products of generators up to a degree, with their peaks at given positions.
    pub(crate) fn of_generators(variable: &Variable, degree: usize, at: &[f64]) -> Self {
        let basis = Self::of_products(products(&variable.kind, degree));
        let seen = basis.product_values(variable, at);
        basis.seen_as(seen)
    }

    /// Number of functions.
    pub fn len(&self) -> usize {
        self.products.len() + self.numeric.iter().map(|n| n.unfold.ncols()).sum::<usize>()
    }

    /// The functions that make up samples of a kind at `nodes` nodes.
    pub fn shown(&self, shows: Shows, nodes: usize) -> &[usize] {
        self.shown.get(&(shows, nodes)).map_or(&[], Vec::as_slice)
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

    /// Finds the basis of a rich variable from samples along it, in units of the tolerance (per output, mm or rad).
    pub fn find(
        v: usize,
        groups: &[Along],
        sampler: &Sampler<'_>,
        components: &[Component],
        tolerance: &PerAxis,
        choice: Choice,
    ) -> Result<Self, NotConverged> {
        let variable = &sampler.variables[v];
        let of = |shows: Shows| groups.iter().filter(move |g| g.shows == shows);
        let alone: Vec<&Along> = groups.iter().filter(|g| g.shows != Shows::Joint).collect();
        let turning: Vec<&Along> = of(Shows::Turning).collect();
        // Products for all samples; if that fails, for sines and cosines; if that fails too, those needed for first
        // order. Numerical functions cover the rest.
        let found = Self::fitting(variable, &alone, choice)
            .or_else(|| Self::fitting(variable, &turning, choice));
        let mut basis = found.unwrap_or_else(|| Self::of_products(products(&variable.kind, 2)));
        // Samples of a kind consist of the functions found so far and of new functions in their residual; groups
        // with the most nodes go first, as they resolve most.
        for shows in [Shows::Turning, Shows::Moving, Shows::Joint] {
            for group in of(shows).rev() {
                let values = basis.values(v, sampler, components, tolerance, &group.nodes)?;
                // No more than the nodes can separate.
                let told = values.ncols().min(group.nodes.len() - 1);
                let found = numeric(group, &values, told, choice.leave);
                basis.numeric.extend(found);
                let shown = (0..told).chain(values.ncols()..basis.len()).collect();
                basis.shown.insert((shows, group.nodes.len()), shown);
            }
        }
        basis.with_peaks(v, sampler, components, tolerance)
    }

    /// The products of the lowest degree that leave no more than `choice.leave` in any sample.
    fn fitting(variable: &Variable, groups: &[&Along], choice: Choice) -> Option<Self> {
        let lowest = if matches!(variable.kind, Kind::Rotary(_)) {
            0
        } else {
            2
        };
        (lowest..=choice.degree)
            .map(|degree| Self::of_products(products(&variable.kind, degree)))
            .find(|basis| {
                // Each group at its own nodes, with no more products than these can separate.
                groups.iter().all(|group| {
                    let mut values = basis.product_values(variable, &group.nodes);
                    let told = values.ncols().min(group.nodes.len() - 1);
                    values = values.columns(0, told).into_owned();
                    explain(&group.samples, &values, choice.leave)
                })
            })
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
        let mut values = self.product_values(&sampler.variables[v], at);
        for numeric in &self.numeric {
            let samples = sampled(&numeric.columns, v, sampler, components, tolerance, at)?;
            let rest = samples - &values * numeric.known.transpose();
            let new = rest * &numeric.unfold;
            let before = values.ncols();
            values = values.insert_columns(before, new.ncols(), 0.0);
            values.columns_mut(before, new.ncols()).copy_from(&new);
        }
        Ok(values)
    }

    fn with_peaks(
        self,
        v: usize,
        sampler: &Sampler<'_>,
        components: &[Component],
        tolerance: &PerAxis,
    ) -> Result<Self, NotConverged> {
        let at = sampler.variables[v].many();
        let values = self.values(v, sampler, components, tolerance, &at)?;
        Ok(self.seen_as(values))
    }

    fn seen_as(self, seen: DMatrix<f64>) -> Self {
        Self {
            peaks: seen.column_iter().map(|c| c.amax()).collect(),
            seen,
            ..self
        }
    }

    /// Values of a sum of functions at nodes of the calibrated range.
    pub(crate) fn at_nodes(&self, coefficients: &[f64]) -> Vec<f64> {
        let nodes = self.seen.nrows();
        let mut sums = vec![0.0; nodes];
        let columns = self.seen.as_slice().chunks_exact(nodes.max(1));
        for (column, c) in columns.zip(coefficients).filter(|(_, c)| **c != 0.0) {
            for (sum, f) in sums.iter_mut().zip(column) {
                *sum += f * c;
            }
        }
        sums
    }

    /// Largest magnitude of a sum of functions.
    pub(crate) fn peak_of(&self, coefficients: &[f64]) -> f64 {
        let sums = self.at_nodes(coefficients).into_iter();
        sums.fold(0.0, |most, sum: f64| most.max(sum.abs()))
    }
}

/// Least-squares residual of samples (nodes × columns) after a fit of functions (nodes × functions), and the
/// pseudo-inverse of the functions.
fn residual(samples: &DMatrix<f64>, values: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let inverse = values.clone().pseudo_inverse(ROUNDING).ok()?;
    Some((samples - values * (&inverse * samples), inverse))
}

/// True if a fit of functions (nodes × functions) leaves less than `leave` in every sample (nodes × columns). Ends at
/// the first column of which it leaves more.
fn explain(samples: &DMatrix<f64>, values: &DMatrix<f64>, leave: f64) -> bool {
    let Ok(inverse) = values.clone().pseudo_inverse(ROUNDING) else {
        return false;
    };
    let mut weights = DVector::zeros(values.ncols());
    let mut rest = DVector::zeros(values.nrows());
    samples.column_iter().all(|column| {
        weights.gemv(1.0, &inverse, &column, 0.0);
        rest.copy_from(&column);
        rest.gemv(-1.0, values, &weights, 1.0);
        rest.amax() < leave
    })
}

/// The functions that explain the residual of the samples after the earlier functions (`values`, nodes × functions),
/// and the columns to compute them from; `None` if the residual is negligible. Of the earlier functions, only
/// the first `told` are used.
fn numeric(group: &Along, values: &DMatrix<f64>, told: usize, leave: f64) -> Option<Numeric> {
    let before = values.ncols();
    let values = values.columns(0, told).into_owned();
    let (rest, _) = residual(&group.samples, &values)?;
    let (functions, count) = leading(&rest, leave);
    if count == 0 {
        return None;
    }
    let mut all = values.insert_columns(told, count, 0.0);
    all.columns_mut(told, count).copy_from(&functions);
    let inverse = all.pseudo_inverse(ROUNDING).ok()?;
    let weights = inverse.rows(told, count) * &group.samples; // functions × columns
    let chosen = columns(&weights);
    let part = weights.select_columns(&chosen);
    let weights = inverse.rows(0, told) * group.samples.select_columns(&chosen);
    let mut known = DMatrix::zeros(chosen.len(), before);
    known.columns_mut(0, told).copy_from(&weights.transpose());
    Some(Numeric {
        known,
        unfold: part.transpose().pseudo_inverse(ROUNDING).ok()?.transpose(),
        columns: chosen
            .into_iter()
            .map(|c| group.columns[c].clone())
            .collect(),
    })
}

/// The columns from which functions can be computed well, given their weights (functions × columns): twice those that a
/// pivoted factorisation picks.
fn columns(weights: &DMatrix<f64>) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::new();
    for _ in 0..2 {
        let mut rest = weights.clone();
        for _ in 0..weights.nrows() {
            let norms = (0..rest.ncols()).filter(|c| !chosen.contains(c));
            let norms = norms.map(|c| (c, rest.column(c).norm_squared()));
            let Some((pivot, norm)) = norms.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            if norm <= 0.0 {
                break;
            }
            chosen.push(pivot);
            let direction: DVector<f64> = rest.column(pivot) / norm.sqrt();
            let along = direction.transpose() * &rest;
            rest -= &direction * along;
        }
    }
    chosen
}

/// Samples of columns at positions along variable `v`, in units of the tolerances: positions × columns.
fn sampled(
    columns: &[Column],
    v: usize,
    sampler: &Sampler<'_>,
    components: &[Component],
    tolerance: &PerAxis,
    at: &[f64],
) -> Result<DMatrix<f64>, NotConverged> {
    let mut samples = sampler.along(columns, v, components, at)?;
    for (mut sampled, from) in samples.column_iter_mut().zip(columns) {
        sampled /= tolerance[from.output];
    }
    Ok(samples)
}

/// The leading left singular functions of the residual (nodes × columns): as many as needed to leave no more than
/// `leave` in any sample.
fn leading(residual: &DMatrix<f64>, leave: f64) -> (DMatrix<f64>, usize) {
    // The left factor of an SVD is that of R in a QR of the transpose. Columns are folded in by blocks, so memory
    // and time stay proportional to their number.
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
    let order = order((-&svd.singular_values).as_slice());
    let mut rest = residual.clone();
    let mut most = rest.amax();
    let mut count = 0;
    while count < order.len() && most >= leave {
        let u: Vec<f64> = v_t.row(order[count]).iter().copied().collect();
        most = without(rest.as_mut_slice(), &u);
        count += 1;
    }
    let functions = DMatrix::from_fn(n, count, |i, k| v_t[(order[k], i)]);
    (functions, count)
}

/// Removes a unit vector from columns as long as it; returns the largest magnitude left. Four columns at a time, in one
/// pass through memory.
fn without(columns: &mut [f64], u: &[f64]) -> f64 {
    let n = u.len();
    let mut most = [0.0_f64; 4];
    for some in columns.chunks_mut(4 * n) {
        let mut along = [0.0; 4];
        for (i, u) in u.iter().enumerate() {
            for (along, x) in along.iter_mut().zip(some[i..].iter().step_by(n)) {
                *along += u * x;
            }
        }
        for (column, along) in some.chunks_mut(n).zip(along) {
            for (k, (x, u)) in column.iter_mut().zip(u).enumerate() {
                *x -= u * along;
                most[k % 4] = most[k % 4].max(x.abs());
            }
        }
    }
    most.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
