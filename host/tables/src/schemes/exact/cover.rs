//! From samples and basis functions to terms: the coefficients of products, and which sums of them become one table.

use super::basis::{Basis, Choice};
use super::component::Component;
use super::components::Split;
use super::entries::entries;
use super::grid::BYTES_PER_INSTRUCTION;
use super::sampling::Sampler;
use super::share::Spare;
use super::structure::{Decomposition, Entry, Function, Key, Memory, Structure, Term};
use super::variables::Variable;
use crate::cost;
use crate::size::Size;
use crate::target::Target;
use std::collections::BinaryHeap;
use trueaxis::Draft;
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::order;
use trueaxis_model::parallel::{self, Sort};
use trueaxis_model::validate::Runtime;

/// Share that a basis may leave out, as a fraction of that: every function is combined with many others.
const BASIS_SHARE: f64 = 0.1;
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

impl Minimize {
    /// What it minimizes, of a draft; infinite if a blob cannot hold it.
    pub(crate) fn cost(self, draft: &Draft) -> f64 {
        let blob = draft.encode();
        let Some(runtime) = blob.as_ref().ok().and_then(|b| Runtime::load(b).ok()) else {
            return f64::INFINITY;
        };
        let size = Size::of(&runtime);
        match self {
            Self::Cost => cost::instructions(&runtime) + size.bytes as f64 / BYTES_PER_INSTRUCTION,
            Self::Tables => size.tables as f64,
        }
    }
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
    /// True if tables that are multiples of each other become one at the end.
    shares: bool,
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
        let keys: Vec<f64> = entries.iter().map(|entry| -entry.peak).collect();
        Self {
            entries,
            variables,
            bases,
            fibres,
            order: order(&keys),
            shares: false,
        }
    }

    /// This cover, with tables shared at the end.
    fn sharing(self, shares: bool) -> Self {
        Self { shares, ..self }
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
        let (entries, variables, bases) = (self.entries, self.variables, self.bases);
        let mut structure = Structure::default();
        let mut left = Left::new(entries, share);
        self.merge(&mut structure, &mut left, capacity, most)?;
        // Add the remaining entries, the largest first.
        for &i in &self.order {
            if structure.terms.len() > most {
                return None;
            }
            if !left.is_little(entries[i].output) && left.take(entries, i) {
                structure.single(&entries[i], variables, bases);
            }
        }
        if self.shares {
            structure.share(bases, &mut Spare::new(left.squares, share));
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
            memory: Memory::default(),
        }
    }
}

/// Finds the functions of every variable, if the structure may leave out `share` of the tolerance.
pub fn bases(
    sampler: &Sampler<'_>,
    split: &Split,
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
        true => {
            let along = split.along(*v, tolerance);
            Basis::find(*v, &along, sampler, &split.components, tolerance, choice)
        }
        false => Ok(Basis::of_lever(variable)),
    })
}

/// Finds terms that leave out no more than `share` of the tolerance. If the target cannot hold them, they leave out as
/// little as it allows, or all if not `leaves_out`.
pub fn attempt(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: Vec<Basis>,
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
    leaves_out: bool,
) -> Result<Attempt, NotConverged> {
    let entries = entries(sampler, components, &bases, tolerance)?;
    let direction = matches!(sampler.kinematics.policy, Policy::Direction { .. });
    let cover = Cover::new(&entries, &sampler.variables, &bases, minimize).sharing(direction);
    let choose = |share: f64| {
        let structure = cover.choose(share, target.tables * 2 / 3, target.terms);
        structure.filter(|s| s.count() <= target.tables)
    };
    let (mut structure, mut left_out) = (choose(share), share);
    let is_full = structure.is_none();
    if is_full {
        left_out = cover.share_of_nothing().max(share);
    }
    if is_full && leaves_out {
        // With everything left out it certainly fits: bisect on a logarithmic scale. Verification shows the effect.
        let mut too_little = share;
        for _ in 0..8 {
            let between = (too_little * left_out).sqrt();
            match choose(between) {
                None => too_little = between,
                fits => (left_out, structure) = (between, fits),
            }
        }
    }
    Ok(Attempt {
        bases,
        structure: structure.unwrap_or_default(),
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
