//! Logs of programs that were stopped early or restarted.

use super::log::Touched;
use super::planned::{elsewhere, named};
use crate::plan::PER_BALL;
use std::ops::Range;
use trueaxis_identify::formats::probings::{Probing, Probings, ball_index};
use trueaxis_model::machine::Machine;

/// A program that goes back more often than this is a different one.
const BEGUN: usize = 5;

/// The rows of a plan whose touches are all in the log, their touches, and the other rows as text. `None` if no
/// row is complete or some touches belong to no row.
///
/// Consecutive touches with the same rotary positions belong to the rows that have these positions, in order. A
/// restarted program repeats rows: the last repetition counts, and of more than five touches of one row the last
/// five.
pub(super) fn whole_rows(
    machine: &Machine,
    plan: &Probings,
    log: &[Touched],
) -> Option<(Probings, Vec<Touched>, Vec<String>)> {
    let is_at = |row: &Probing, touched: &Touched| elsewhere(machine, row, touched).is_none();
    let same = |a: &Probing, b: &Probing| {
        (0..machine.axes.len())
            .all(|i| !machine.axes[i].letter.is_rotary() || a.position[i] == b.position[i])
    };
    let groups = runs(plan.rows.len(), |a, b| same(&plan.rows[a], &plan.rows[b]));
    let mut logged = LoggedRows {
        touches: vec![None; plan.rows.len()],
        count: vec![0; plan.rows.len()],
    };
    let mut next = 0;
    let mut begun = 0;
    let mut at = 0;
    while at < log.len() {
        let fits = |group: &Range<usize>| is_at(&plan.rows[group.start], &log[at]);
        // The next row in order, or one before it if the program was restarted.
        let ahead = (next..groups.len()).find(|g| fits(&groups[*g]));
        let number = ahead.or_else(|| (0..next).rev().find(|g| fits(&groups[*g])))?;
        begun += usize::from(number < next);
        if begun > BEGUN {
            return None;
        }
        let rows = groups[number].clone();
        let stay = (log[at..].iter()).take_while(|t| is_at(&plan.rows[rows.start], t));
        let touches = &log[at..at + stay.count()];
        at += touches.len();
        logged.add(rows, touches, at == log.len());
        next = number + 1;
    }
    logged.kept(machine, plan)
}

/// What a log has of each row of a plan.
struct LoggedRows<'a> {
    /// All touches of a row that has all.
    touches: Vec<Option<&'a [Touched]>>,
    count: Vec<usize>,
}

impl<'a> LoggedRows<'a> {
    /// Adds the touches at the rotary positions of some rows; `is_last` at the end of the log.
    fn add(&mut self, rows: Range<usize>, touches: &'a [Touched], is_last: bool) {
        let wanted = rows.len() * PER_BALL;
        if rows.len() == 1 {
            self.count[rows.start] = touches.len().min(PER_BALL);
            if let Some(begin) = touches.len().checked_sub(PER_BALL) {
                self.touches[rows.start] = Some(&touches[begin..]);
            }
            return;
        }
        // Which of several balls lacks a touch is only known at the end of the log.
        let is_told = touches.len() == wanted || (is_last && touches.len() < wanted);
        for (row, place) in rows.zip(0..) {
            let own = touches.get(place * PER_BALL..(place + 1) * PER_BALL);
            if is_told && own.is_some() {
                self.touches[row] = own;
            }
            let there = touches.len().saturating_sub(place * PER_BALL).min(PER_BALL);
            self.count[row] = if is_told { there } else { 0 };
        }
    }

    /// The complete rows as a plan, their touches, and the other rows as text.
    fn kept(
        self,
        machine: &Machine,
        plan: &Probings,
    ) -> Option<(Probings, Vec<Touched>, Vec<String>)> {
        let mut kept = Probings::default();
        let (mut touches, mut missing) = (Vec::new(), Vec::new());
        for ((row, found), count) in plan.rows.iter().zip(self.touches).zip(self.count) {
            let Some(own) = found else {
                missing.push(format!(
                    "{count} of {PER_BALL} touches of {}",
                    named(machine, plan, row)
                ));
                continue;
            };
            touches.extend_from_slice(own);
            let ball = ball_index(&mut kept.balls, &plan.balls[row.ball]);
            kept.rows.push(Probing {
                ball,
                ..row.clone()
            });
        }
        (!kept.rows.is_empty()).then_some((kept, touches, missing))
    }
}

/// Ranges of consecutive equal elements.
fn runs(count: usize, same: impl Fn(usize, usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for i in 0..count {
        match runs.last_mut() {
            Some(run) if same(run.start, i) => run.end = i + 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}
