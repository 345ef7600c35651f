//! The baselines on all machines of a round.

use crate::answer::{Answer, Stated};
use crate::baseline::answers;
use crate::left::left;
use crate::score::Score;
use crate::table::Scored;
use crate::task::Hidden;
use rayon::prelude::*;
use trueaxis_model::errors::{Parameter, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::validate::Command;

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

/// The kinematic correction of the true errors, which are stated: what no correction can do better.
///
/// # Errors
/// If it does not converge somewhere.
pub fn of_the_truth(hidden: &Hidden) -> Result<Answer, String> {
    let task = &hidden.task;
    let commands: Vec<Command> = task.positions.iter().map(|p| p.command).collect();
    let of = |(i, command): (usize, &Command)| {
        let kinematics = Kinematics::new(&task.machine, hidden.truth_at(i));
        let (q, situation) = command.kinematic(&task.machine);
        let found = kinematics.correction(&q, &situation, &Switches::ALL);
        found.map(|c| c.dq).map_err(|e| e.to_string())
    };
    let each = commands.iter().enumerate().map(of);
    let corrections: Vec<PerAxis> = each.collect::<Result<_, _>>()?;
    let left = left(task, &commands, |i| hidden.truth_at(i), &corrections);
    let values = &hidden.truth_at(0).parameters;
    let stated = |p: &Parameter| {
        let value = values.get(p).copied().unwrap_or_default();
        (*p, Stated { value, band: 0.0 })
    };
    Ok(Answer {
        bands: left.iter().map(|l| [l.tip, l.direction]).collect(),
        parameters: task.asked.iter().map(stated).collect(),
        corrections,
        cost: None,
    })
}

/// The name of its row.
const TRUTH: &str = "the true errors";

/// Scores of every baseline, and of the true errors, on the first `count` machines of a round. `progress` is called after each machine.
#[must_use]
pub fn baselines(round: u64, count: usize, progress: impl Fn(usize) + Sync) -> Vec<Scored> {
    let one = |number: usize| {
        let hidden = Hidden::new(round, number);
        let mut all: Vec<Scored> = answers(&hidden.task)
            .into_iter()
            .map(|(baseline, answer)| scored(&hidden, baseline.to_string(), answer))
            .collect();
        all.push(scored(&hidden, TRUTH.to_owned(), of_the_truth(&hidden)));
        progress(number);
        all
    };
    (0..count).into_par_iter().flat_map_iter(one).collect()
}
