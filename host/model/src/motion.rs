//! Rows of positions as a motion: their order gives the direction of travel of every axis.

mod beyond_travel;

use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged, Policy};
use crate::machine::{Machine, PerAxis};
pub use beyond_travel::{
    BeyondRange, Outside, beyond_range, outside_compensation, outside_machine,
};
use trueaxis::{Inputs, Largest, MOST_PERIODS, Reversal, Travel, Travelling};

/// Largest number of axes of a blob.
const MOST_AXES: usize = 16;

/// A position of an axis without limits, or on a modulo table, that is too large for f32 to resolve within a turn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("row {row}: {value} is more than {MOST_PERIODS} periods away from zero on {name}")]
pub struct TooFar {
    /// Row, counted from 1 after the header.
    pub row: usize,
    /// The axis.
    pub name: char,
    /// The position given.
    pub value: f64,
}

/// Corrections (mm, deg) of a compensation along a motion, before the limits.
///
/// Each row has the axes, then the auxiliaries, in the compensation's order. Directions are tracked as in the
/// runtime, with the reversal threshold of the blob: unknown until an axis has moved.
///
/// # Errors
/// [`TooFar`] if f32 cannot resolve the position within a turn; the runtime reports a fault.
pub fn evaluate(compensation: &Largest<'_>, rows: &[Vec<f64>]) -> Result<Vec<Vec<f32>>, TooFar> {
    let axes = compensation.axes();
    let mut reversals = [Reversal::new(); MOST_AXES];
    let mut corrections = Vec::with_capacity(rows.len());
    for (row, values) in rows.iter().enumerate() {
        let mut inputs = Inputs::at([0.0; MOST_AXES]);
        let mut travelling = Travelling([Travel::Unknown; MOST_AXES]);
        for (i, axis) in axes.iter().enumerate() {
            let q = values[i] as f32;
            if compensation.farthest(i).is_some_and(|most| q.abs() > most) {
                return Err(TooFar {
                    row: row + 1,
                    name: char::from(axis.name),
                    value: values[i],
                });
            }
            inputs.axes[i] = q;
            travelling.0[i] = reversals[i].update(q, axis.reversal_threshold, axis.period);
        }
        for (auxiliary, value) in inputs.auxiliaries.iter_mut().zip(&values[axes.len()..]) {
            *auxiliary = *value as f32;
        }
        let all = compensation.evaluate(&inputs, &travelling, &compensation.weights());
        corrections.push(all[..axes.len()].to_vec());
    }
    Ok(corrections)
}

/// Input of the kinematic model along a motion: position (mm, rad) and situation of every row.
///
/// Each row has the axes, the tool length (mm) if it is an input of the machine, then the sensors (K from their
/// reference). Directions are tracked as in [`evaluate`].
#[must_use]
pub fn situations(machine: &Machine, rows: &[Vec<f64>]) -> Vec<(PerAxis, Situation)> {
    let n = machine.axes.len();
    let mut reversals = [Reversal::new(); MOST_AXES];
    let mut along = Vec::with_capacity(rows.len());
    for values in rows {
        let axes = machine.axes.iter().zip(values).zip(&mut reversals);
        let travel = axes.map(|((axis, q), reversal)| {
            let period = if axis.modulo { 360.0 } else { 0.0 };
            reversal.update(*q as f32, axis.reversal_threshold as f32, period)
        });
        let situation = situation(machine, travel, values[n..].iter().copied());
        // The position in the range in which error motions of axes without limits are described.
        let axes = machine.axes.iter().zip(&values[..n]);
        let position: Vec<f64> = axes.map(|(axis, q)| axis.within_turn(*q)).collect();
        along.push((machine.to_kinematic(&position), situation));
    }
    along
}

/// From the direction of travel of each axis, the tool length (mm) if it is an input, and the temperatures (K from
/// their reference).
pub(crate) fn situation(
    machine: &Machine,
    travel: impl Iterator<Item = Travel>,
    mut auxiliaries: impl Iterator<Item = f64>,
) -> Situation {
    let mut situation = Situation::default();
    for (sign, travel) in situation.sign.iter_mut().zip(travel) {
        *sign = match travel {
            Travel::Positive => 1.0,
            Travel::Negative => -1.0,
            Travel::Unknown => 0.0,
        };
    }
    situation.length = machine.length_range.and_then(|_| auxiliaries.next());
    for (kelvin, value) in situation.kelvin.iter_mut().zip(auxiliaries) {
        *kelvin = value;
    }
    situation
}

/// Exact kinematic corrections (mm, deg) along a motion, whose rows are those of [`situations`].
///
/// # Errors
/// [`NotConverged`], with the row counted from 1.
pub fn correct(
    machine: &Machine,
    errors: &ErrorModel,
    policy: Policy,
    rows: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>, (usize, NotConverged)> {
    let kinematics = Kinematics::new(machine, errors).with_policy(policy);
    let n = machine.axes.len();
    let mut corrections = Vec::with_capacity(rows.len());
    for (row, (q, situation)) in situations(machine, rows).iter().enumerate() {
        let dq = kinematics
            .correction(q, situation, &Switches::ALL)
            .map_err(|error| (row + 1, error))?
            .dq;
        corrections.push(machine.to_command(&dq)[..n].to_vec());
    }
    Ok(corrections)
}
