//! From samples and basis functions to terms: the coefficients of products, and which sums of them become one table.

use super::along::Shows;
use super::basis::{Basis, Choice, ROUNDING};
use super::edit::Spare;
use super::sampling::{Component, Sampler};
use super::structure::{Decomposition, Entry, Function, Key, Structure, Term};
use super::variables::{MAX_VARIABLES, Variable};
use crate::target::Target;
use nalgebra::DMatrix;
use std::collections::{BTreeMap, BinaryHeap, HashMap};
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel::{self, Sort};

/// Share that a basis may leave out, as a fraction of that: every function is combined with many others.
const BASIS_SHARE: f64 = 0.1;
/// Products that contribute less than this (in units of the tolerance) are dropped; a thousand of them would not add
/// up to a tenth.
const NOISE: f64 = 1e-4;
/// Number of products considered, the largest first. A target can hold a fiftieth of them; sums of products along
/// each variable come on top.
const MOST_ENTRIES: usize = 200_000;
/// Adding up and pruning about halve the number of terms, so this many times what the target holds may be chosen
/// first.
const BEFORE_FOLDING: usize = 2;

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

/// Projects all components onto the bases. If the structure will leave out more than the tolerance anyway
/// (`left_out`, in units of it), small products are dropped in proportion.
pub fn entries(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
    left_out: f64,
) -> Result<Vec<Entry>, NotConverged> {
    let outputs = &tolerance[..sampler.kinematics.machine.axes.len()];
    let noise = NOISE * left_out.max(1.0);
    let inverses = inverses(sampler, components, bases, tolerance)?;
    // Each component separately, then summed in a fixed order.
    let parts = parallel::map(components, |component| {
        coefficients(component, &inverses, outputs, 1e-3 * noise)
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
        .filter(|e| e.peak > noise)
        .collect();
    // If there are more than any target can hold, keep the largest.
    if entries.len() > MOST_ENTRIES {
        entries.sort_by(|a, b| {
            b.peak
                .total_cmp(&a.peak)
                .then_with(|| (a.output, a.key).cmp(&(b.output, b.key)))
        });
        entries.truncate(MOST_ENTRIES);
        entries.sort_by_key(|e| (e.output, e.key));
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

/// The quantity to minimize.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Minimize {
    /// Instructions per evaluation.
    ///
    /// Sums of functions of one variable become one table.
    Cost,
    /// The number of tables.
    ///
    /// Products of few generators, many terms.
    Tables,
}

/// A set of entries whose sum can become one term with one merged table.
type Fibre = (usize, usize, Key);

/// An entry whose peak is at least this fraction of what may be left out counts fully when fibres are compared, a
/// smaller one by the square of its fraction.
const COUNTS: f64 = 0.08;
/// Fewer entries than this are cheaper as separate terms: 10 instructions per term, 7 per table.
const MERGE: f64 = 1.7;

/// Number of significant entries in a fibre.
#[derive(Clone, Copy, Debug)]
struct Score(f64);

impl PartialEq for Score {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Score {}

impl PartialOrd for Score {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Score {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The entries that no term holds yet.
struct Left {
    taken: Vec<bool>,
    /// Sum of squared peaks for each output.
    squares: PerAxis,
    share: f64,
}

impl Left {
    fn new(entries: &[Entry], share: f64) -> Self {
        let mut squares = PerAxis::default();
        for entry in entries {
            squares[entry.output] += entry.peak.powi(2);
        }
        Self {
            taken: vec![false; entries.len()],
            squares,
            share,
        }
    }

    fn score(&self, entries: &[Entry], members: &[usize]) -> Score {
        let full = COUNTS * self.share;
        let weight = |i: &usize| (entries[*i].peak / full).powi(2).min(1.0);
        Score(
            members
                .iter()
                .filter(|i| !self.taken[**i])
                .map(weight)
                .sum(),
        )
    }

    fn take(&mut self, entries: &[Entry], i: usize) -> bool {
        if std::mem::replace(&mut self.taken[i], true) {
            return false;
        }
        self.squares[entries[i].output] -= entries[i].peak.powi(2);
        true
    }

    fn is_little(&self, output: usize) -> bool {
        // Subtraction leaves the rounding error of the largest squares.
        2.0 * self.squares[output].max(0.0).sqrt() <= self.share
    }
}

/// Entries and the fibres they could be merged along.
pub struct Cover<'a> {
    entries: &'a [Entry],
    variables: &'a [Variable],
    bases: &'a [Basis],
    /// Each with its entries.
    fibres: Vec<(Fibre, Vec<usize>)>,
    /// All entries, the largest first.
    order: Vec<usize>,
    /// True if small parts are removed at the end.
    prunes: bool,
}

impl<'a> Cover<'a> {
    /// Finds the fibres; there are none if the number of tables is minimized.
    pub fn new(
        entries: &'a [Entry],
        variables: &'a [Variable],
        bases: &'a [Basis],
        minimize: Minimize,
    ) -> Self {
        let mut along: Vec<(Fibre, usize)> = Vec::new();
        if minimize == Minimize::Cost {
            for (i, entry) in entries.iter().enumerate() {
                for (v, variable) in variables.iter().enumerate() {
                    if variable.merges() {
                        let mut key = entry.key;
                        key[v] = u8::MAX;
                        along.push(((entry.output, v, key), i));
                    }
                }
            }
        }
        along.par_sort_unstable();
        // A single entry gains nothing from a merged table.
        let fibres = along
            .chunk_by(|(a, _), (b, _)| a == b)
            .filter(|members| members.len() > 1)
            .map(|members| (members[0].0, members.iter().map(|(_, i)| *i).collect()))
            .collect();
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_by(|a, b| entries[*b].peak.total_cmp(&entries[*a].peak).then(a.cmp(b)));
        Self {
            entries,
            variables,
            bases,
            fibres,
            order,
            prunes: false,
        }
    }

    /// This cover, with small parts removed at the end.
    pub(crate) fn pruned(self, prunes: bool) -> Self {
        Self { prunes, ..self }
    }

    /// The share at which nothing is chosen.
    pub(crate) fn share_of_nothing(&self) -> f64 {
        let squares = Left::new(self.entries, 0.0).squares;
        2.0 * squares.into_iter().fold(0.0, f64::max).sqrt() * (1.0 + 1e-9)
    }

    /// Chooses terms until what is left out is less than `share` of the tolerance in every output (twice the root of
    /// the sum of squares).
    ///
    /// A fibre is the sum of all entries that differ in the function of only one variable; it becomes one term with
    /// one merged table. The fibre with the most significant entries is chosen first; small entries are included at
    /// no cost or left out. `capacity` limits the number of merged tables. `None` if more than `most` terms are needed.
    pub fn choose(&self, share: f64, capacity: usize, most: usize) -> Option<Structure> {
        let first_most = if self.prunes {
            BEFORE_FOLDING * most
        } else {
            most
        };
        let (entries, variables, bases) = (self.entries, self.variables, self.bases);
        let mut structure = Structure::default();
        let mut left = Left::new(entries, share);
        self.merge(&mut structure, &mut left, capacity, first_most)?;
        // Add the remaining entries, the largest first.
        for &i in &self.order {
            if structure.terms.len() > first_most {
                return None;
            }
            if !left.is_little(entries[i].output) && left.take(entries, i) {
                structure.single(&entries[i], variables, bases);
            }
        }
        if self.prunes {
            let mut spare = Spare::new(left.squares, share);
            structure.fold(variables, bases, &mut spare);
            structure.prune(bases, &mut spare);
            structure.unshare(bases);
        }
        (structure.terms.len() <= most).then_some(structure)
    }

    /// Makes fibres to terms, the one with the most significant entries first, with up to `capacity` merged tables. `None`
    /// if there are more than `most` terms.
    fn merge(
        &self,
        structure: &mut Structure,
        left: &mut Left,
        capacity: usize,
        most: usize,
    ) -> Option<()> {
        // Scores in the heap may be out of date and are recomputed when popped. They only decrease.
        let scores = self.fibres.iter();
        let scores = scores.map(|(_, members)| left.score(self.entries, members));
        let mut heap: BinaryHeap<(Score, std::cmp::Reverse<usize>)> = scores
            .zip(0..)
            .filter(|(score, _)| *score >= Score(MERGE))
            .map(|(score, fibre)| (score, std::cmp::Reverse(fibre)))
            .collect();
        while let Some((score, std::cmp::Reverse(fibre))) = heap.pop() {
            if structure.terms.len() > most {
                return None;
            }
            if structure.merged.len() >= capacity {
                break;
            }
            let ((output, ..), members) = &self.fibres[fibre];
            let now = left.score(self.entries, members);
            if left.is_little(*output) || now < Score(MERGE) {
                continue;
            }
            match now < score {
                true => heap.push((now, std::cmp::Reverse(fibre))),
                false => self.add_fibre(structure, left, fibre),
            }
        }
        Some(())
    }

    /// Adds a fibre as one term with one merged table, unless that has too many factors.
    fn add_fibre(&self, structure: &mut Structure, left: &mut Left, fibre: usize) {
        let (entries, bases) = (self.entries, self.bases);
        let &((output, v, mut key), ref members) = &self.fibres[fibre];
        key[v] = 0;
        let factors = structure.factors(&key, self.variables, bases);
        let Some(mut factors) = factors.filter(|f| f.len() < trueaxis::FACTORS) else {
            return;
        };
        let mut coefficients = vec![0.0; bases[v].len()];
        for &i in members {
            if left.take(entries, i) {
                coefficients[usize::from(entries[i].key[v])] += entries[i].value;
            }
        }
        let others = key.iter().zip(bases).map(|(k, b)| b.peaks[usize::from(*k)]);
        let (id, weight) = structure.merge(v, coefficients, bases, others.product());
        factors.push((v, Function::Merged(id)));
        structure.terms.push(Term {
            output,
            weight,
            factors,
        });
    }
}

/// Bases and terms for one limit on what may be left out.
pub struct Attempt {
    bases: Vec<Basis>,
    pub structure: Structure,
    /// True if more terms or tables are needed than the target holds.
    pub is_full: bool,
    /// What was left out, in units of the tolerance.
    pub left_out: f64,
}

impl Attempt {
    /// This attempt, with everything that its tables are sampled from.
    pub fn found<'a>(
        &'a self,
        sampler: &'a Sampler<'a>,
        components: &'a [Component],
        tolerance: &'a PerAxis,
    ) -> Decomposition<'a> {
        Decomposition {
            sampler,
            components,
            bases: &self.bases,
            tolerance,
            structure: &self.structure,
        }
    }
}

/// Finds the functions of every variable, if the structure may leave out `share` of the tolerance.
pub fn bases(
    sampler: &Sampler<'_>,
    components: &[Component],
    tolerance: &PerAxis,
    minimize: Minimize,
    share: f64,
) -> Result<Vec<Basis>, NotConverged> {
    let choice = Choice {
        degree: if minimize == Minimize::Tables { 5 } else { 4 },
        leave: BASIS_SHARE * share,
    };
    let variables: Vec<_> = sampler.variables.iter().enumerate().collect();
    parallel::try_map(&variables, |(v, variable)| match variable.is_rich() {
        true => Basis::find(*v, sampler, components, tolerance, choice),
        false => Ok(Basis::of_lever(variable)),
    })
}

/// True if the target holds the terms that leave out no more than `share` of the tolerance.
pub fn fits(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
) -> Result<bool, NotConverged> {
    let entries = entries(sampler, components, bases, tolerance, 0.0)?;
    let cover = Cover::new(&entries, &sampler.variables, bases, minimize);
    Ok(cover
        .choose(share, target.tables * 2 / 3, target.terms)
        .is_some_and(|structure| structure.count() <= target.tables))
}

/// Finds terms that leave out no more than `share` of the tolerance, or as little as the target allows. `before` is the
/// part that an earlier attempt had to leave out.
pub fn attempt(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: Vec<Basis>,
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
    before: f64,
) -> Result<Attempt, NotConverged> {
    let entries = entries(sampler, components, &bases, tolerance, before)?;
    let direction = matches!(sampler.kinematics.policy, Policy::Direction { .. });
    let cover = Cover::new(&entries, &sampler.variables, &bases, minimize).pruned(direction);
    let choose = |share: f64| {
        let structure = cover.choose(share, target.tables * 2 / 3, target.terms);
        structure.filter(|s| s.count() <= target.tables)
    };
    let (mut structure, mut left_out) = (choose(share), share);
    let is_full = structure.is_none();
    if is_full {
        // Leave out the smallest entries that the target cannot hold; verification shows the effect. With everything
        // left out it certainly fits: bisect on a logarithmic scale.
        let (mut too_little, mut enough) = (share, cover.share_of_nothing().max(share));
        for _ in 0..8 {
            let between = (too_little * enough).sqrt();
            match choose(between) {
                None => too_little = between,
                fits => (enough, structure) = (between, fits),
            }
        }
        left_out = enough;
    }
    let structure = structure.unwrap_or_default();
    Ok(Attempt {
        bases,
        structure,
        is_full,
        left_out,
    })
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::super::variables::{MAX_VARIABLES, variables};
    use super::*;
    use trueaxis::FACTORS;
    use trueaxis_model::kinematics::Kinematics;

    /// The structure of one entry over levers, given the power of each.
    fn single(powers: &[u8]) -> Structure {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let lever = variables(&Kinematics::new(&machine, &errors), 1e-6).remove(0);
        let variables = vec![lever; powers.len()];
        let bases: Vec<Basis> = variables.iter().map(Basis::of_lever).collect();
        let mut key = [0; MAX_VARIABLES];
        key[..powers.len()].copy_from_slice(powers);
        let entries = [Entry {
            output: 0,
            key,
            value: 3.0,
            peak: 3.0,
        }];
        let cover = Cover::new(&entries, &variables, &bases, Minimize::Tables);
        cover.choose(0.1, 255, 100).unwrap()
    }

    #[test]
    fn a_product_has_no_more_tables_than_a_term_holds() {
        assert_eq!(single(&[1; FACTORS]).terms[0].factors.len(), FACTORS);
        // The longest product that fits, and one factor too many: the square becomes a table of its own.
        let mut powers = [1; FACTORS];
        powers[2] = 2;
        let structure = single(&powers);
        assert_eq!(structure.terms[0].factors.len(), FACTORS);
        assert_eq!(structure.merged.len(), 1);
    }

    #[test]
    fn a_product_of_more_variables_than_a_term_holds_stays_out() {
        assert!(single(&[1; FACTORS + 1]).terms.is_empty());
    }
}
