//! Coefficients of products of basis functions.

use super::along::Shows;
use super::basis::Basis;
use super::limits::{MOST_ENTRIES, NOISE, ROUNDING};
use super::sampling::{Component, Sampler};
use super::variables::{Kind, MAX_VARIABLES};
use crate::kinematics::NotConverged;
use crate::machine::PerAxis;
use nalgebra::DMatrix;
use std::collections::HashMap;

/// Which function of each variable a product takes; 0 is the constant.
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
    /// The most it can contribute, in the same units.
    pub peak: f64,
}

/// The functions that samples of a kind are made of, and the matrix that takes samples to these.
type Inverse = (Vec<usize>, DMatrix<f64>);

/// Projects all components onto the bases. Where more than the tolerance will be left out
/// anyway (`left_out`, in its units), small products are dropped in proportion.
pub fn entries(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
    left_out: f64,
) -> Result<Vec<Entry>, NotConverged> {
    let n = sampler.kinematics.machine.axes.len();
    let noise = NOISE * left_out.max(1.0);
    let mut sums: HashMap<(usize, Key), f64> = HashMap::new();
    let mut inverses: HashMap<(usize, Shows, usize), Inverse> = HashMap::new();
    for component in components {
        let mut functions_of: Vec<Vec<usize>> = Vec::new();
        let mut shape: Vec<usize> = component.rich.iter().map(|(_, p)| p.len()).collect();
        let monomials = component.monomials.len();
        let mut values: Vec<f64> = (0..n)
            .flat_map(|o| component.values.iter().map(move |v| v[o] / tolerance[o]))
            .collect();
        // values: output, monomial, rich nodes; one rich variable after the other becomes functions.
        for (k, (v, positions)) in component.rich.iter().enumerate() {
            let shows = Shows::of(component, k);
            let key = (*v, shows, positions.len());
            if let std::collections::hash_map::Entry::Vacant(slot) = inverses.entry(key) {
                let all = bases[*v].values(*v, sampler, components, tolerance, positions)?;
                let shown = bases[*v].shown(shows, positions.len()).to_vec();
                let part = all.select_columns(&shown);
                let inverse = part
                    .pseudo_inverse(ROUNDING)
                    .unwrap_or_else(|_| DMatrix::zeros(shown.len(), positions.len()));
                slot.insert((shown, inverse));
            }
            let (shown, inverse) = &inverses[&key];
            functions_of.push(shown.clone());
            let outer: usize = n * monomials * shape[..k].iter().product::<usize>();
            let inner: usize = shape[k + 1..].iter().product();
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
            values = projected;
            shape[k] = to;
        }
        let functions: usize = shape.iter().product();
        for (index, value) in values.iter().enumerate() {
            if value.abs() < 1e-3 * noise {
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
            *sums.entry((block / monomials, key)).or_insert(0.0) += value;
        }
    }
    let mut entries: Vec<Entry> = sums
        .into_iter()
        .map(|((output, key), value)| {
            let peaks: f64 = key
                .iter()
                .zip(bases)
                .map(|(k, b)| b.peaks[usize::from(*k)])
                .product();
            Entry {
                output,
                key,
                value,
                peak: value.abs() * peaks,
            }
        })
        .filter(|e| e.peak > noise)
        .collect();
    // Of so many that no target can hold, the largest.
    if entries.len() > MOST_ENTRIES {
        entries.sort_by(|a, b| {
            b.peak
                .total_cmp(&a.peak)
                .then_with(|| (a.output, a.key).cmp(&(b.output, b.key)))
        });
        entries.truncate(MOST_ENTRIES);
    }
    // A fixed order, so that the same input gives the same file.
    entries.sort_by_key(|e| (e.output, e.key));
    Ok(entries)
}

/// True for variables whose functions may be merged into one table.
pub fn merges(kind: &Kind) -> bool {
    !matches!(kind, Kind::Sign(_))
}
