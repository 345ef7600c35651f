//! The baselines on all machines of a round.

use crate::answer::Answer;
use crate::baseline::answers;
use crate::score::Score;
use crate::table::Scored;
use crate::task::Hidden;
use rayon::prelude::*;

/// Number of machines of a round.
pub const MACHINES: usize = 200;
/// Seed of the published round.
pub const ROUND: u64 = 1;

/// Scores an answer; a failure counts as no correction.
#[must_use]
pub fn scored(hidden: &Hidden, name: String, answer: Result<Answer, String>) -> Scored {
    let none = || Answer::none(hidden.task.positions.len());
    let (answer, failure) = match answer {
        Ok(answer) => (answer, None),
        Err(failure) => (none(), Some(failure)),
    };
    Scored {
        machine: hidden.task.number,
        name,
        score: Score::of(hidden, &answer),
        failure,
    }
}

/// Scores of every baseline on the first `count` machines of a round. `progress` is called after each machine.
#[must_use]
pub fn baselines(round: u64, count: usize, progress: impl Fn(usize) + Sync) -> Vec<Scored> {
    let one = |number: usize| {
        let hidden = Hidden::new(round, number);
        let scored: Vec<Scored> = answers(&hidden.task)
            .into_iter()
            .map(|(baseline, answer)| scored(&hidden, baseline.to_string(), answer))
            .collect();
        progress(number);
        scored
    };
    (0..count).into_par_iter().flat_map_iter(one).collect()
}
