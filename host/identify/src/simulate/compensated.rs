//! Probings of a machine with its compensation on.

use super::{Disturbances, SimulateError, disturb_all, in_travel, on_balls};
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::validate::{Command, Runtime};

/// Commands have settled when none changes by more than this (mm, deg). Corrections are f32 numbers, in steps of
/// 6e-8 at 1 mm, and so are the positions at which they are evaluated.
const SETTLED: f64 = 1e-6;
/// Each reduces the error by a factor of the slope of the corrections, 1e-2 or better.
const STEPS: usize = 10;

/// Commanded axis positions with the stylus at each ball, as in [`probings`](super::probings()), while a
/// compensation corrects the axes: their real positions include the corrections. `corrections` gives, for rows with
/// the commanded positions, what is added to each axis (mm, deg).
///
/// # Errors
/// [`SimulateError`], or an error of `corrections`.
pub fn compensated<E: From<SimulateError>>(
    kinematics: &Kinematics<'_>,
    artefact: &Artefact,
    plan: &Probings,
    disturbances: &Disturbances,
    mut corrections: impl FnMut(&[Probing]) -> Result<Vec<PerAxis>, E>,
) -> Result<Probings, E> {
    let at = |off: &[PerAxis]| on_balls(kinematics, artefact, plan, disturbances, off);
    let off = vec![[0.0; MAX_AXES]; plan.rows.len()];
    let mut measured = settled(at(&off)?, |rows| at(&corrections(rows)?).map_err(E::from))?;
    disturb_all(kinematics.machine, &mut measured, disturbances);
    in_travel(kinematics.machine, &measured)?;
    Ok(measured)
}

/// Recorded probings as they would have been read with a compensation on: the axes are at the same real position q,
/// and the command p satisfies p + dq(p) = q. The source document's Eq. 33, q − dq(q), is its first step.
/// `corrections` is that of [`compensated`].
///
/// # Errors
/// [`SimulateError`]: corrections that do not settle, a command outside the travel; or an error of `corrections`.
pub fn applied<E: From<SimulateError>>(
    machine: &Machine,
    recorded: &Probings,
    mut corrections: impl FnMut(&[Probing]) -> Result<Vec<PerAxis>, E>,
) -> Result<Probings, E> {
    let commanded = settled(recorded.clone(), |rows| {
        let mut next = recorded.clone();
        for (row, dq) in next.rows.iter_mut().zip(corrections(rows)?) {
            for (position, dq) in row.position.iter_mut().zip(dq) {
                *position -= dq;
            }
        }
        Ok::<_, E>(next)
    })?;
    in_travel(machine, &commanded)?;
    Ok(commanded)
}

/// Repeats `next`, which gives the commands that follow from those of the step before, until they settle.
fn settled<E: From<SimulateError>>(
    mut commanded: Probings,
    mut next: impl FnMut(&[Probing]) -> Result<Probings, E>,
) -> Result<Probings, E> {
    let mut moving = None;
    for _ in 0..STEPS {
        let after = next(&commanded.rows)?;
        let moves = |(row, after): &(&Probing, &Probing)| {
            let mut both = row.position.iter().zip(&after.position);
            both.any(|(a, b)| (a - b).abs() > SETTLED)
        };
        let mut pairs = commanded.rows.iter().zip(&after.rows);
        moving = pairs.find(moves).map(|(row, _)| (row.line, row.ball));
        commanded = after;
        if moving.is_none() {
            break;
        }
    }
    match moving {
        None => Ok(commanded),
        Some((line, ball)) => Err(E::from(SimulateError::Unsettled {
            line,
            ball: commanded.balls[ball].clone(),
        })),
    }
}

/// The compensation's corrections of the axes (mm, deg) in each of these rows, from the runtime.
#[must_use]
pub fn corrections(machine: &Machine, runtime: &Runtime<'_>, rows: &[Probing]) -> Vec<PerAxis> {
    let of = |row: &Probing| {
        let command = Command::coming(machine, &row.position, &row.direction);
        runtime.evaluate(&command).map(f64::from)
    };
    rows.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::probings;

    const MACHINE: &str = include_str!("../../../../examples/kolibri/machine.toml");

    /// The command of Y for a recorded Y.
    fn commanded(y: f64, dq: impl Fn(f64) -> f64) -> f64 {
        let machine = Machine::from_toml(MACHINE).unwrap();
        let csv = format!("ball,X,Y,Z,A,C\n1,0,{y},0,0,0\n");
        let recorded = probings::read(&csv, &machine, true).unwrap();
        let index = machine.index('Y').unwrap();
        let corrections = |rows: &[Probing]| {
            let of = |row: &Probing| {
                let mut all = [0.0; MAX_AXES];
                all[index] = dq(row.position[index]);
                all
            };
            Ok::<_, SimulateError>(rows.iter().map(of).collect())
        };
        applied(&machine, &recorded, corrections).unwrap().rows[0].position[index]
    }

    #[test]
    fn a_recorded_position_becomes_that_of_equation_33() {
        // The document's Fig. 5.5: read at 4 mm, corrected by −1 mm, the ball is at 5 mm.
        assert_eq!(commanded(4.0, |_| -1.0), 5.0);
    }

    #[test]
    fn the_correction_is_that_of_the_command_not_of_the_place() {
        // p + 0.01 p = q. After settling, a further step may still move by half of 1e-6.
        assert!((commanded(5.05, |p| 0.01 * p) - 5.0).abs() < 1e-8);
    }
}
