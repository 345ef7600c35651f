//! Checks that touches belong to a plan, and describes its rows.

use super::log::Touched;
use crate::plan::PER_BALL;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// Largest distance (deg) of rotary axes from the positions in the plan.
const NEAR: f64 = 0.01;
const TURN: f64 = 360.0;

/// A row of a plan as text.
pub(super) fn named(machine: &Machine, plan: &Probings, row: &Probing) -> String {
    let axes = machine.axes.iter().zip(row.position);
    let rotary = axes.filter(|(axis, _)| axis.letter.is_rotary());
    let at: Vec<String> = rotary
        .map(|(axis, p)| format!("{} = {p}", axis.letter))
        .collect();
    format!(
        "ball {} at {} (line {} of the plan)",
        plan.balls[row.ball],
        at.join(", "),
        row.line
    )
}

/// Checks the number of touches, and that the rotary axes are where the plan has them.
pub(super) fn belongs(
    machine: &Machine,
    plan: &Probings,
    log: &[Touched],
) -> Result<(), FileError> {
    for (number, touched) in log.iter().enumerate() {
        let Some(row) = plan.rows.get(number / PER_BALL) else {
            return Err(FileError::at(
                touched.span.clone(),
                format!(
                    "there are {} touches, where the plan has {} rows of {PER_BALL}",
                    log.len(),
                    plan.rows.len()
                ),
                "the first one too many",
                "give the plan from which the program was written; a log of several runs has to be divided",
            ));
        };
        if let Some(axis) = elsewhere(machine, row, touched) {
            let (column, span) = touched.cells[axis].clone();
            return Err(FileError::here(
                span,
                format!(
                    "column {column}: {} = {}, where it should be touch {} of {}",
                    machine.axes[axis].letter,
                    touched.position[axis],
                    number % PER_BALL + 1,
                    named(machine, plan, row)
                ),
                "this is the log of another plan, or there are touches too many or too few above: give the plan from which the program was written, and probe again what is missing",
            ));
        }
    }
    let (rows, touches) = (log.len() / PER_BALL, log.len() % PER_BALL);
    match (plan.rows.get(rows), log.last()) {
        (Some(row), Some(last)) => Err(FileError::at(
            last.span.clone(),
            format!(
                "the log ends here, with {touches} of {PER_BALL} touches of {}; {rows} of {} rows are whole",
                named(machine, plan, row),
                plan.rows.len()
            ),
            "the last touch",
            "probe to the end, or pass a plan with only the complete rows and remove the touches after them",
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
