//! From samples and basis functions to the coefficients of products.

use super::along::Shows;
use super::basis::{Basis, ROUNDING};
use super::component::Component;
use super::sampling::Sampler;
use super::structure::{Entry, Key};
use super::variables::MAX_VARIABLES;
use nalgebra::DMatrix;
use std::collections::{BTreeMap, HashMap};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::order;
use trueaxis_model::parallel::{self, Sort};

/// Products that contribute less than this (in units of the tolerance) are dropped; a thousand of them would not add
/// up to a tenth.
const NOISE: f64 = 1e-4;
/// Number of products considered, the largest first. A target can hold a fiftieth of them; sums of products along
/// each variable come on top.
const MOST_ENTRIES: usize = 200_000;

/// The functions that make up samples of a kind, and the matrix that converts samples to their coefficients.
type Inverse = (Vec<usize>, DMatrix<f64>);

/// A variable, what samples along it show, and their number of nodes.
type SampleKind = (usize, Shows, usize);

/// The kind of a component's samples along its `k`-th rich variable.
fn kind(component: &Component, k: usize) -> SampleKind {
    let (v, positions) = &component.rich[k];
    (*v, Shows::of(component, k), positions.len())
}

/// The inverses of all kinds that occur.
fn inverses(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
) -> Result<HashMap<SampleKind, Inverse>, NotConverged> {
    let mut kinds: BTreeMap<SampleKind, &[f64]> = BTreeMap::new();
    for component in components {
        for (k, (_, positions)) in component.rich.iter().enumerate() {
            kinds.entry(kind(component, k)).or_insert(positions);
        }
    }
    let inverse = |((v, shows, nodes), positions): (SampleKind, &[f64])| {
        let all = bases[v].values(v, sampler, components, tolerance, positions)?;
        let shown = bases[v].shown(shows, nodes).to_vec();
        let part = all.select_columns(&shown);
        let inverse = part.pseudo_inverse(ROUNDING);
        let inverse = inverse.unwrap_or_else(|_| DMatrix::zeros(shown.len(), nodes));
        Ok(((v, shows, nodes), (shown, inverse)))
    };
    let inverses = parallel::try_map(&Vec::from_iter(kinds), |kind| inverse(*kind))?;
    Ok(inverses.into_iter().collect())
}

/// Converts samples (`outer` × nodes × `inner`) to coefficients of functions.
fn projected(values: &[f64], inverse: &DMatrix<f64>, outer: usize, inner: usize) -> Vec<f64> {
    let (from, to) = (inverse.ncols(), inverse.nrows());
    let mut projected = vec![0.0; outer * to * inner];
    for block in 0..outer {
        for function in 0..to {
            let target = &mut projected[(block * to + function) * inner..][..inner];
            for node in 0..from {
                let factor = inverse[(function, node)];
                let source = &values[(block * from + node) * inner..][..inner];
                for (t, s) in target.iter_mut().zip(source) {
                    *t += factor * s;
                }
            }
        }
    }
    projected
}

/// Projects all components onto the bases.
pub fn entries(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
) -> Result<Vec<Entry>, NotConverged> {
    let outputs = &tolerance[..sampler.kinematics.machine.axes.len()];
    let inverses = inverses(sampler, components, bases, tolerance)?;
    // Each component separately, then summed in a fixed order.
    let parts = parallel::map(components, |component| {
        coefficients(component, &inverses, outputs, 1e-3 * NOISE)
    });
    let mut parts = parts.concat();
    // The sort is stable, and so is the order of summation.
    parts.par_sort_by_key(|(key, _)| *key);
    let mut entries: Vec<Entry> = parts
        .chunk_by(|(a, _), (b, _)| a == b)
        .map(|same| {
            let (output, key) = same[0].0;
            let value: f64 = same.iter().map(|(_, value)| value).sum();
            let peaks = key.iter().zip(bases).map(|(k, b)| b.peaks[usize::from(*k)]);
            Entry {
                output,
                key,
                value,
                peak: value.abs() * peaks.product::<f64>(),
            }
        })
        .filter(|e| e.peak > NOISE)
        .collect();
    // If there are more than any target can hold, keep the largest.
    if entries.len() > MOST_ENTRIES {
        let keys: Vec<f64> = entries.iter().map(|entry| -entry.peak).collect();
        let mut is_kept = vec![false; entries.len()];
        for place in order(&keys).into_iter().take(MOST_ENTRIES) {
            is_kept[place] = true;
        }
        let mut is_kept = is_kept.into_iter();
        entries.retain(|_| is_kept.next().unwrap_or_default());
    }
    Ok(entries)
}

/// The coefficients of a component's products in the outputs with these tolerances, in units of them, except those below
/// `least`.
fn coefficients(
    component: &Component,
    inverses: &HashMap<SampleKind, Inverse>,
    outputs: &[f64],
    least: f64,
) -> Vec<((usize, Key), f64)> {
    let mut functions_of: Vec<&[usize]> = Vec::new();
    let mut shape: Vec<usize> = component.rich.iter().map(|(_, p)| p.len()).collect();
    let monomials = component.monomials.len();
    let of_output = |(o, unit): (usize, &f64)| {
        let unit = *unit;
        component.values.iter().map(move |v| v[o] / unit)
    };
    let mut values: Vec<f64> = outputs.iter().enumerate().flat_map(of_output).collect();
    // Layout of values: output, monomial, rich nodes. Rich variables are converted to functions one after the
    // other.
    for k in 0..component.rich.len() {
        let (shown, inverse) = &inverses[&kind(component, k)];
        functions_of.push(shown);
        let outer: usize = outputs.len() * monomials * shape[..k].iter().product::<usize>();
        let inner: usize = shape[k + 1..].iter().product();
        values = projected(&values, inverse, outer, inner);
        shape[k] = inverse.nrows();
    }
    let functions: usize = shape.iter().product();
    let mut found = Vec::new();
    for (index, value) in values.iter().enumerate() {
        if value.abs() < least {
            continue;
        }
        let mut key = [0; MAX_VARIABLES];
        let mut rest = index % functions;
        for (k, (v, _)) in component.rich.iter().enumerate().rev() {
            key[*v] = functions_of[k][rest % shape[k]] as u8;
            rest /= shape[k];
        }
        let block = index / functions;
        for &v in &component.monomials[block % monomials] {
            key[v] += 1;
        }
        for &v in &component.odd {
            key[v] = if component.even { 2 } else { 1 };
        }
        found.push(((block / monomials, key), *value));
    }
    found
}
