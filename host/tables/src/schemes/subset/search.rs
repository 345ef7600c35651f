//! The search for the best set of tables.
//!
//! Few tables are looked through, every set there is. For more, what is best of as many as can be looked through,
//! and nothing at all, are filled greedily: the term that removes most for each of its tables, or most in all, again
//! and again. Then exchanges: one or two terms go, what they were is filled in the same way, and the best of these
//! sets is taken, until none is better.

use super::candidates::{Candidate, tables};
use super::remains::Remains;
use trueaxis_model::parallel;

/// What is better by less than this part of everything is as good: rounding.
const AS_GOOD: f64 = 1e-12;
/// The most sets that are looked through.
const SETS: usize = 40_000;
/// Up to so many terms also every two are exchanged.
const PAIRS: usize = 8;
/// Exchanges end after so many.
const ROUNDS: usize = 100;
/// Of the filled sets so many are bettered by exchanges: those that leave least.
const STARTS: usize = 3;

/// The best set found of candidates (by index, in order) that takes at most so many tables.
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
    let left = |end: &Vec<usize>| remains.left(end);
    ends.sort_by(|a, b| left(a).total_cmp(&left(b)));
    let ends = ends.into_iter().take(STARTS);
    let ends = ends.map(|end| exchanged(remains, end, most));
    let mut best = least(remains, ends.collect());
    best.sort_unstable();
    best
}

/// All sets that take at most so many tables, unless there are more than `limit`.
pub fn all(remains: &Remains, most: usize, limit: usize) -> Option<Vec<Vec<usize>>> {
    let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
    // Each set once: grown by candidates behind its last.
    let mut grown = 0;
    while grown < sets.len() {
        let set = sets[grown].clone();
        grown += 1;
        let from = set.last().map_or(0, |last| last + 1);
        for candidate in from..remains.candidates.len() {
            let with: Vec<usize> = set.iter().copied().chain([candidate]).collect();
            // One that is too large stays so.
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

/// The set that leaves least; the first of those that are as good.
fn least(remains: &Remains, sets: Vec<Vec<usize>>) -> Vec<usize> {
    let left = parallel::map(&sets, |set| remains.left(set));
    let numbered = sets.into_iter().zip(left);
    let best = numbered.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Vec::new, |(set, _)| set)
}

/// How many tables a set takes.
pub fn size(remains: &Remains, chosen: &[usize]) -> usize {
    let chosen: Vec<Candidate> = chosen.iter().map(|c| remains.candidates[*c]).collect();
    tables(&chosen)
}

/// A set with what removes most added as long as there is room: most for each table, or (`each` false) in all.
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
        // The first of those that are as good.
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

/// A set after all exchanges that make it better.
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
