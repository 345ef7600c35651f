//! From products of basis functions to terms: which sums become one table.

use super::basis::Basis;
use super::core::{Entry, Key, merges};
use super::limits::BEFORE_FOLDING;
use super::prune::Spare;
use super::structure::{Function, Structure, Term};
use super::variables::Variable;
use std::collections::BinaryHeap;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel::Sort;

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
                    if merges(&variable.kind) {
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

    /// The same, with small parts removed at the end.
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
        // Scores in the heap may be out of date and are recomputed when popped. They only decrease.
        let scores = self.fibres.iter().map(|(_, m)| left.score(entries, m));
        let mut heap: BinaryHeap<(Score, std::cmp::Reverse<usize>)> = scores
            .zip(0..)
            .filter(|(score, _)| *score >= Score(MERGE))
            .map(|(score, fibre)| (score, std::cmp::Reverse(fibre)))
            .collect();
        while let Some((score, std::cmp::Reverse(fibre))) = heap.pop() {
            if structure.terms.len() > first_most {
                return None;
            }
            if structure.merged.len() >= capacity {
                break;
            }
            let &((output, v, mut key), ref members) = &self.fibres[fibre];
            let now = left.score(entries, members);
            if left.is_little(output) || now < Score(MERGE) {
                continue;
            }
            if now < score {
                heap.push((now, std::cmp::Reverse(fibre)));
                continue;
            }
            key[v] = 0;
            let Some(mut factors) = structure.factors(&key, variables, bases) else {
                continue;
            };
            if factors.len() + 1 > trueaxis::FACTORS {
                continue;
            }
            let mut coefficients = vec![0.0; bases[v].len()];
            for &i in members {
                if left.take(entries, i) {
                    coefficients[usize::from(entries[i].key[v])] += entries[i].value;
                }
            }
            let others: f64 = key
                .iter()
                .zip(bases)
                .map(|(k, b)| b.peaks[usize::from(*k)])
                .product();
            let (id, weight) = structure.merge(v, coefficients, bases, others);
            factors.push((v, Function::Merged(id)));
            structure.terms.push(Term {
                output,
                weight,
                factors,
            });
        }
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
