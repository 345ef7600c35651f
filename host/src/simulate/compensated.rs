//! Probings of a machine whose compensation is on.

use super::{Disturbances, SimulateError, disturb_all, in_travel, on_balls};
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use crate::kinematics::Kinematics;
use crate::machine::{MAX_AXES, PerAxis};
use crate::validate::{Command, Runtime};

/// Commands have settled when none changes by more than this (mm, deg): corrections are f32 numbers, those of
/// 1 mm in steps of 6e-8, and so are the positions that they are looked up at.
const SETTLED: f64 = 1e-6;
/// Each gains how fast corrections change with the position: 1e-2 or better.
const STEPS: usize = 10;

/// Where the axes are commanded to be when the stylus is on each ball, as [`probings`](super::probings()), while a
/// compensation corrects them: the axes really are where it takes them. `corrections` gives, for rows with the
/// commanded positions, what is added to each axis (mm, deg).
///
/// # Errors
/// [`SimulateError`], or what `corrections` fails with.
pub fn compensated<E: From<SimulateError>>(
    kinematics: &Kinematics<'_>,
    artefact: &Artefact,
    strategy: &Probings,
    disturbances: &Disturbances,
    mut corrections: impl FnMut(&[Probing]) -> Result<Vec<PerAxis>, E>,
) -> Result<Probings, E> {
    let at = |off: &[PerAxis]| on_balls(kinematics, artefact, strategy, disturbances.drift, off);
    let mut measured = at(&vec![[0.0; MAX_AXES]; strategy.rows.len()])?;
    let mut unsettled = None;
    for _ in 0..STEPS {
        let next = at(&corrections(&measured.rows)?)?;
        let moves = |(row, next): &(&Probing, &Probing)| {
            let mut both = row.position.iter().zip(&next.position);
            both.any(|(a, b)| (a - b).abs() > SETTLED)
        };
        let moving = measured.rows.iter().zip(&next.rows).find(moves);
        unsettled = moving.map(|(row, _)| SimulateError::Unsettled {
            line: row.line,
            ball: strategy.balls[row.ball].clone(),
        });
        measured = next;
        if unsettled.is_none() {
            break;
        }
    }
    if let Some(error) = unsettled {
        return Err(error.into());
    }
    disturb_all(kinematics.machine, &mut measured, disturbances);
    in_travel(kinematics.machine, &measured)?;
    Ok(measured)
}

/// What a compensation adds to the axes (mm, deg) in each of these rows, as the runtime says.
#[must_use]
pub fn corrections(
    kinematics: &Kinematics<'_>,
    runtime: &Runtime<'_>,
    rows: &[Probing],
) -> Vec<PerAxis> {
    let of = |row: &Probing| {
        let command = Command::coming(kinematics.machine, &row.position, &row.direction);
        runtime.evaluate(&command).map(f64::from)
    };
    rows.iter().map(of).collect()
}
