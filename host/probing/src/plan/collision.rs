//! Whether anything meets anything else on the way of a plan.

use super::candidates::{Allowed, Setup};
use super::course::Course;
use super::scene::is_described;
use super::step::ProbingStep;
use super::steps::steps;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::parallel;

/// A move on which two solids would come too close.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("on the way to or from ball {ball} (line {line} of the plan) {meeting}")]
pub struct Collision {
    /// Line of the row to which the move belongs.
    pub line: usize,
    /// The ball of that row.
    pub ball: String,
    /// What meets what.
    pub meeting: String,
}

/// The first move of `steps`, which are those of `plan`, on which anything comes closer than [`Probe::keep`] to
/// anything on the other side: tool, stylus and shank, against table, balls and posts; what stands still against stylus,
/// tool, balls and posts.
/// From balls a stylus keeps nine tenths of the clearance of touches, for they may stand beside their places; near the
/// ball that is touched it only must not touch it. The machine is taken to have no errors, and all axes to start and stop
/// together. Moves before the first row, and whatever is not described, are not known.
///
/// [`Probe::keep`]: super::Probe::keep
#[must_use]
pub fn collision(setup: &Setup<'_>, plan: &Probings, steps: &[ProbingStep]) -> Option<Collision> {
    let (row, meeting) = first(setup, plan, steps)?;
    let row = &plan.rows[row];
    Some(Collision {
        line: row.line,
        ball: plan.balls[row.ball].clone(),
        meeting,
    })
}

/// The row to which the first such move belongs.
fn first(setup: &Setup<'_>, plan: &Probings, steps: &[ProbingStep]) -> Option<(usize, String)> {
    let mut course = Course::new(setup);
    let mut row = 0;
    for step in steps {
        if let ProbingStep::Row(number) = step {
            row = *number;
        }
        let ball = &plan.balls[plan.rows.get(row)?.ball];
        if let Some(meeting) = course.go(step, Some(ball)) {
            return Some((row, meeting));
        }
    }
    None
}

/// The first row of a plan that cannot be reached clear of balls and of what is described.
pub(super) fn obstructed(setup: &Setup<'_>, plan: &Probings) -> Option<usize> {
    let steps = steps(setup, plan).ok()?;
    first(setup, plan, &steps).map(|(row, _)| row)
}

impl Setup<'_> {
    /// What is allowed without the candidates that cannot be touched clear of what is described, wherever the machine
    /// comes from.
    pub(super) fn clear_of_collisions(&self, allowed: &Allowed) -> Allowed {
        let mut clear = allowed.clone();
        if !is_described(self.machine, self.artefact) {
            return clear;
        }
        let (Probings { balls, rows }, _) = self.candidates(allowed);
        let mut alone: Vec<Probings> = Vec::new();
        let mut seen = std::collections::BTreeSet::new();
        for row in rows {
            let place = row.position.map(f64::to_bits);
            if seen.insert((row.ball, row.spindle.to_bits(), place)) {
                let balls = balls.clone();
                alone.push(Probings {
                    balls,
                    rows: vec![row],
                });
            }
        }
        let meets = parallel::map(&alone, |one| obstructed(self, one).is_some());
        let meeting = alone.into_iter().zip(meets).filter(|(_, meets)| *meets);
        clear.without.extend(meeting.map(|(mut one, _)| {
            let row = one.rows.remove(0);
            (one.balls[row.ball].clone(), row)
        }));
        clear
    }
}
