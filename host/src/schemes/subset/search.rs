//! The search for the best set of tables.
//!
//! Greedy first: the term that removes most for each of its tables, again and again. Then exchanges: one or two
//! terms go, what they were is filled greedily again, and the best of these sets is taken, until none is better.

use super::candidates::{Candidate, tables};
use super::remains::Remains;
use rayon::prelude::*;

/// What is better by less than this part of everything is as good: rounding.
const AS_GOOD: f64 = 1e-12;
/// Up to so many terms also every two are exchanged.
const PAIRS: usize = 8;
/// Exchanges end after so many.
const ROUNDS: usize = 100;

/// The best set found of candidates (by index, in order) that takes at most so many tables.
pub fn best(remains: &Remains, most: usize) -> Vec<usize> {
    // What is best for each of its tables, or as a whole: neither begins better everywhere.
    let starts =
        [true, false].map(|each| exchanged(remains, filled(remains, &[], most, each), most));
    let [a, b] = starts;
    let mut best = if remains.left(&a) <= remains.left(&b) {
        a
    } else {
        b
    };
    best.sort_unstable();
    best
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
        let gain = |candidate: usize| {
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
        let gains = (0..remains.candidates.len())
            .into_par_iter()
            .filter_map(gain);
        // The first of those that are as good, so that threads do not decide.
        let best = gains.max_by(|a, b| a.0.total_cmp(&b.0).then(b.2.cmp(&a.2)));
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
