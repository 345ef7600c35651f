//! Simulates probings and observations of a machine with known errors.

mod compensated;
mod observations;

use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use crate::instrument::turned;
pub use compensated::{applied, compensated, corrections};
use nalgebra::{Matrix3, Vector3};
pub use observations::{OfObservations, observations};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::Situation;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};
use trueaxis_model::numbers::normal;

/// Disturbances of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbances {
    /// Standard deviation of each coordinate of a probing (mm).
    pub noise: f64,
    /// Movement of the workpiece frame from the first to the last row (mm), along each of its axes.
    pub drift: [f64; 3],
    /// Time constant of the drift, as a part of the time from the first to the last row; linear if it is 0.
    pub drift_lag: f64,
    /// Fraction of the rows, 0 to 1, that are off by an additional `outlier`.
    pub outliers: f64,
    /// Size of an outlier (mm), in a random direction.
    pub outlier: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Drift (mm) after a part of the time in which it goes from zero to `whole`, with a time constant as a part of that
/// time, or linear if it is 0.
pub fn drifted(whole: [f64; 3], lag: f64, part: f64) -> Vector3<f64> {
    let part = match lag > 0.0 {
        true => libm::expm1(-part / lag) / libm::expm1(-1.0 / lag),
        false => part,
    };
    Vector3::from(whole) * part
}

/// Why a probing cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulateError {
    /// The position of a ball is unknown.
    #[error("ball `{ball}` has no nominal_mm in the artefact")]
    NoPlace {
        /// Name of the position.
        ball: String,
    },
    /// The machine does not have three linear axes that reach every position.
    #[error("line {line}: the linear axes cannot bring the stylus to ball `{ball}` there")]
    NotReached {
        /// Line of the plan.
        line: usize,
        /// The ball.
        ball: String,
    },
    /// An axis would leave its travel.
    #[error("line {line}: ball `{ball}` is at {axis} = {position:.3}, outside its travel")]
    Outside {
        /// Line of the plan.
        line: usize,
        /// The ball.
        ball: String,
        /// The axis.
        axis: char,
        /// The position it would need (mm).
        position: f64,
    },
    /// The corrections of a compensation change as fast as the position does.
    #[error(
        "line {line}: ball `{ball}` is not found while the compensation is on: its corrections do not settle"
    )]
    Unsettled {
        /// Line of the plan.
        line: usize,
        /// The ball.
        ball: String,
    },
}

/// Axis positions with the stylus at each ball of a plan: rotary axes and spindle as in the plan, linear
/// axes where the tip of the actual machine meets the ball.
///
/// # Errors
/// [`SimulateError`]: a ball without a position, or one that cannot be reached.
pub fn probings(
    kinematics: &Kinematics<'_>,
    artefact: &Artefact,
    plan: &Probings,
    disturbances: &Disturbances,
) -> Result<Probings, SimulateError> {
    let none = vec![[0.0; MAX_AXES]; plan.rows.len()];
    let mut measured = on_balls(kinematics, artefact, plan, disturbances, &none)?;
    disturb_all(kinematics.machine, &mut measured, disturbances);
    in_travel(kinematics.machine, &measured)?;
    Ok(measured)
}

/// The plan with the positions that are commanded when the tip of the actual machine is at the balls and each
/// axis is `off` its command (mm, deg).
fn on_balls(
    kinematics: &Kinematics<'_>,
    artefact: &Artefact,
    plan: &Probings,
    disturbances: &Disturbances,
    off: &[PerAxis],
) -> Result<Probings, SimulateError> {
    let machine = kinematics.machine;
    let tip = artefact.stylus.place(machine);
    let mut commanded = plan.clone();
    let last = (plan.rows.len().max(2) - 1) as f64;
    for ((number, row), off) in commanded.rows.iter_mut().enumerate().zip(off) {
        let name = &plan.balls[row.ball];
        let ball = (artefact.balls.iter())
            .find(|b| b.name == *name)
            .and_then(|b| b.nominal);
        let ball = ball.ok_or_else(|| SimulateError::NoPlace { ball: name.clone() })?;
        let drift = drifted(
            disturbances.drift,
            disturbances.drift_lag,
            number as f64 / last,
        );
        let tip = turned(machine.tool_axis, row.spindle) * tip;
        let mut real = row.clone();
        for (position, off) in real.position.iter_mut().zip(off) {
            *position += off;
        }
        let q = reach(kinematics, &real, &tip, &(ball + drift)).ok_or_else(|| {
            SimulateError::NotReached {
                line: row.line,
                ball: name.clone(),
            }
        })?;
        let real = machine.to_command(&q);
        row.position = std::array::from_fn(|i| real[i] - off[i]);
    }
    Ok(commanded)
}

fn in_travel(machine: &Machine, measured: &Probings) -> Result<(), SimulateError> {
    for row in &measured.rows {
        for (axis, position) in machine.axes.iter().zip(row.position) {
            let [low, high] = axis.travel;
            if !axis.modulo && !(low..=high).contains(&position) {
                return Err(SimulateError::Outside {
                    line: row.line,
                    ball: measured.balls[row.ball].clone(),
                    axis: axis.letter.char(),
                    position,
                });
            }
        }
    }
    Ok(())
}

/// Adds to noise-free simulated probings the noise and the outliers that [`probings`] would have added; no drift.
#[must_use]
pub fn disturbed(machine: &Machine, clean: &Probings, disturbances: &Disturbances) -> Probings {
    let mut measured = clean.clone();
    disturb_all(machine, &mut measured, disturbances);
    measured
}

fn disturb_all(machine: &Machine, measured: &mut Probings, disturbances: &Disturbances) {
    let mut random = Pcg64Mcg::seed_from_u64(disturbances.seed);
    for row in &mut measured.rows {
        disturb(machine, row, disturbances, &mut random);
    }
}

/// Largest number of steps towards a ball; each reduces the distance by a factor of the relative size of the errors.
const STEPS: usize = 20;
/// The tip is at the ball within this (mm): rounding of positions of 1 m.
const REACHED: f64 = 1e-11;

/// Linear positions at which the tip is at the ball (mm, rad).
pub fn reach(
    kinematics: &Kinematics<'_>,
    row: &Probing,
    tip: &Vector3<f64>,
    ball: &Vector3<f64>,
) -> Option<PerAxis> {
    let situation = Situation {
        sign: row.direction,
        ..Situation::default()
    };
    let q = kinematics.machine.to_kinematic(&row.position);
    on_ball(kinematics, &q, &situation, tip, ball)
}

/// Axis positions at which the tip is on the ball, sought from given positions of all axes (mm, rad).
pub(crate) fn on_ball(
    kinematics: &Kinematics<'_>,
    start: &PerAxis,
    situation: &Situation,
    tip: &Vector3<f64>,
    ball: &Vector3<f64>,
) -> Option<PerAxis> {
    let machine = kinematics.machine;
    let linear = three_linear(machine)?;
    let mut q = *start;
    for _ in 0..STEPS {
        let found = kinematics.sensitivity(&q, situation, tip);
        let miss = found.point - ball;
        if miss.norm() < REACHED {
            return Some(q);
        }
        let ways = linear.map(|i| {
            let axis = &machine.axes[i];
            let way: Vector3<f64> = found.by_intra[i].column(axis.letter.component()).into();
            if axis.reversed { -way } else { way }
        });
        let step = Matrix3::from_columns(&ways).try_inverse()? * miss;
        for (i, step) in linear.into_iter().zip(step.iter()) {
            q[i] -= step;
        }
    }
    None
}

/// The first three linear axes.
pub fn three_linear(machine: &Machine) -> Option<[usize; 3]> {
    let linear = (0..machine.axes.len()).filter(|i| !machine.axes[*i].letter.is_rotary());
    linear.take(3).collect::<Vec<_>>().try_into().ok()
}

fn disturb(machine: &Machine, row: &mut Probing, by: &Disturbances, random: &mut Pcg64Mcg) {
    let mut off = Vector3::from_fn(|_, _| normal(random)) * by.noise;
    // Drawn unconditionally, so that the noise of a seed is the same with and without outliers.
    let (chance, direction) = (
        random.random::<f64>(),
        Vector3::from_fn(|_, _| normal(random)),
    );
    if chance < by.outliers {
        off += direction.normalize() * by.outlier;
    }
    for (i, off) in three_linear(machine).into_iter().flatten().zip(off.iter()) {
        row.position[i] += off;
    }
}
