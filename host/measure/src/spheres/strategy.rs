//! Checks that touches belong to a strategy, and describes its rows.

use super::log::Touched;
use crate::formats::probings::{Probing, Probings};
use crate::plan::PER_BALL;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Largest distance (deg) of rotary axes from the positions in the strategy.
const NEAR: f64 = 0.01;
const TURN: f64 = 360.0;

/// A row of a strategy as text.
pub(super) fn named(machine: &Machine, strategy: &Probings, row: &Probing) -> String {
    let axes = machine.axes.iter().zip(row.position);
    let rotary = axes.filter(|(axis, _)| axis.letter.is_rotary());
    let at: Vec<String> = rotary
        .map(|(axis, p)| format!("{} = {p}", axis.letter))
        .collect();
    format!(
        "ball {} at {} (line {} of the strategy)",
        strategy.balls[row.ball],
        at.join(", "),
        row.line
    )
}

/// Checks the number of touches, and that the rotary axes are where the strategy has them.
pub(super) fn belongs(
    machine: &Machine,
    strategy: &Probings,
    log: &[Touched],
) -> Result<(), FileError> {
    for (number, touched) in log.iter().enumerate() {
        let Some(row) = strategy.rows.get(number / PER_BALL) else {
            return Err(FileError::at(
                touched.span.clone(),
                format!(
                    "there are {} touches, where the strategy has {} rows of {PER_BALL}",
                    log.len(),
                    strategy.rows.len()
                ),
                "the first one too many",
                "give the strategy from which the program was written; a log of several runs has to be divided",
            ));
        };
        let Some(axis) = elsewhere(machine, row, touched) else {
            continue;
        };
        let letter = machine.axes[axis].letter;
        let (column, span) = touched.cells[axis].clone();
        let touch = number % PER_BALL;
        let next = strategy.rows.get(number / PER_BALL + 1);
        let last = (number / PER_BALL)
            .checked_sub(1)
            .map(|i| &strategy.rows[i]);
        let is_at = |row: Option<&Probing>| {
            row.is_some_and(|row| elsewhere(machine, row, touched).is_none())
        };
        let (message, remedy) = if touch > 0 && is_at(next) {
            (
                format!(
                    "only {touch} of {PER_BALL} touches are there of {}",
                    named(machine, strategy, row)
                ),
                "probe again with the program of this strategy; or leave this row out of log and strategy",
            )
        } else if touch == 0 && is_at(last) {
            (
                format!(
                    "a sixth touch, where {} should begin",
                    named(machine, strategy, row)
                ),
                "remove the duplicate touch",
            )
        } else {
            (
                format!(
                    "column {column}: {letter} = {}, where it should be touch {} of {}",
                    touched.position[axis],
                    touch + 1,
                    named(machine, strategy, row)
                ),
                "this is the log of another strategy, or touches are missing above: give the strategy from which the program was written",
            )
        };
        return Err(FileError::at(span, message, "here", remedy));
    }
    let (rows, touches) = (log.len() / PER_BALL, log.len() % PER_BALL);
    match (strategy.rows.get(rows), log.last()) {
        (Some(row), Some(last)) => Err(FileError::at(
            last.span.clone(),
            format!(
                "the log ends here, with {touches} of {PER_BALL} touches of {}; {rows} of {} rows are whole",
                named(machine, strategy, row),
                strategy.rows.len()
            ),
            "the last touch",
            "probe to the end, or pass a strategy with only the complete rows and remove the touches after them",
        )),
        _ => Ok(()),
    }
}

/// A rotary axis that is not where a row has it.
pub(super) fn elsewhere(machine: &Machine, row: &Probing, touched: &Touched) -> Option<usize> {
    (0..machine.axes.len()).find(|i| {
        let axis = &machine.axes[*i];
        let off = touched.position[*i] - row.position[*i];
        let off = if axis.modulo {
            off - (off / TURN).round() * TURN
        } else {
            off
        };
        axis.letter.is_rotary() && off.abs() > NEAR
    })
}
