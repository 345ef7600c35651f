//! The search for the best set of tables.
//!
//! For a few tables, all sets are searched. For more, the best of as many as can be searched, and the empty set, are
//! filled greedily: repeatedly add the term that removes most per table, or most in total. Exchanges follow: one or
//! two terms are removed, their place is filled in the same way, and the best of these sets is taken, until none is
//! better.

use super::candidates::{Candidate, tables};
use super::remains::Remains;
use trueaxis_model::numbers::by;
use trueaxis_model::parallel;

/// Sets that are better by less than this fraction of the total are equally good: rounding.
const AS_GOOD: f64 = 1e-12;
/// Largest number of sets searched.
const SETS: usize = 40_000;
/// Up to this number of terms, pairs are exchanged as well.
const PAIRS: usize = 8;
/// Largest number of exchange rounds.
const ROUNDS: usize = 100;
/// Number of filled sets that are improved by exchanges, the best ones.
const STARTS: usize = 3;

/// The best set of candidates found (by index, in order) that takes at most `most` tables.
pub fn best(remains: &Remains, most: usize) -> Vec<usize> {
    let mut begun: Vec<Vec<usize>> = vec![Vec::new()];
    for few in 1..=most {
        match all(remains, few, SETS) {
            Some(sets) => begun.push(least(remains, sets)),
            None => break,
        }
        if few == most {
            return begun.pop().unwrap_or_default();
        }
    }
    let filled = begun
        .iter()
        .flat_map(|begun| [true, false].map(|each| filled(remains, begun, most, each)));
    let mut ends: Vec<Vec<usize>> = filled.collect();
    ends.iter_mut().for_each(|end| end.sort_unstable());
    ends.sort_unstable();
    ends.dedup();
    let ends = by(ends, |end| remains.left(end));
    let ends = ends.into_iter().take(STARTS);
    let ends = ends.map(|end| exchanged(remains, end, most));
    let mut best = least(remains, ends.collect());
    best.sort_unstable();
    best
}

/// All sets that take at most `most` tables, or `None` if there are more than `limit`.
pub fn all(remains: &Remains, most: usize, limit: usize) -> Option<Vec<Vec<usize>>> {
    let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
    // Each set once: extend it only by candidates after its last one.
    let mut grown = 0;
    while grown < sets.len() {
        let set = sets[grown].clone();
        grown += 1;
        let from = set.last().map_or(0, |last| last + 1);
        for candidate in from..remains.candidates.len() {
            let with: Vec<usize> = set.iter().copied().chain([candidate]).collect();
            // A set that is too large remains so.
            if size(remains, &with) <= most {
                sets.push(with);
            }
        }
        if sets.len() > limit {
            return None;
        }
    }
    Some(sets)
}

/// The set that leaves the smallest error; the first of equally good ones.
fn least(remains: &Remains, sets: Vec<Vec<usize>>) -> Vec<usize> {
    let left = parallel::map(&sets, |set| remains.left(set));
    let numbered = sets.into_iter().zip(left);
    let best = numbered.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Vec::new, |(set, _)| set)
}

/// Number of tables of a set.
pub fn size(remains: &Remains, chosen: &[usize]) -> usize {
    let chosen: Vec<Candidate> = chosen.iter().map(|c| remains.candidates[*c]).collect();
    tables(&chosen)
}

/// Fills a set with the term that removes most, as long as there is room: most per table, or in total if `each` is
/// false.
fn filled(remains: &Remains, chosen: &[usize], most: usize, each: bool) -> Vec<usize> {
    let mut chosen = chosen.to_vec();
    let mut left = remains.left(&chosen);
    loop {
        let taken = size(remains, &chosen);
        let gain = |&candidate: &usize| {
            let with: Vec<usize> = chosen.iter().copied().chain([candidate]).collect();
            let more = size(remains, &with) - taken;
            if chosen.contains(&candidate) || taken + more > most {
                return None;
            }
            let then = remains.left(&with);
            let removed = left - then;
            let worth = if each { removed / more as f64 } else { removed };
            Some((worth, then, candidate))
        };
        let gains = parallel::map(&Vec::from_iter(0..remains.candidates.len()), gain);
        // The first of equally good ones.
        let best =
            (gains.into_iter().flatten()).max_by(|a, b| a.0.total_cmp(&b.0).then(b.2.cmp(&a.2)));
        match best {
            Some((_, then, candidate)) if left - then > AS_GOOD * remains.before => {
                chosen.push(candidate);
                left = then;
            }
            _ => return chosen,
        }
    }
}

/// A set after all exchanges that improve it.
fn exchanged(remains: &Remains, mut chosen: Vec<usize>, most: usize) -> Vec<usize> {
    let mut left = remains.left(&chosen);
    for _ in 0..ROUNDS {
        let count = chosen.len();
        let pairs = if count <= PAIRS { count } else { 0 };
        let ones = (0..count).map(|i| [i, i]);
        let out = ones.chain((0..pairs).flat_map(|i| (i + 1..pairs).map(move |j| [i, j])));
        let mut best: Option<(f64, Vec<usize>)> = None;
        for out in out {
            let numbered = chosen.iter().enumerate();
            let kept = numbered.filter(|(i, _)| !out.contains(i)).map(|(_, c)| *c);
            let kept: Vec<usize> = kept.collect();
            for each in [true, false] {
                let other = filled(remains, &kept, most, each);
                let then = remains.left(&other);
                let least = best.as_ref().map_or(left, |(least, _)| *least);
                if then < least - AS_GOOD * remains.before {
                    best = Some((then, other));
                }
            }
        }
        let Some((then, other)) = best else { break };
        (left, chosen) = (then, other);
    }
    chosen
}
