//! Where the ball of Chapters 5 and 6 stood, inferred from Table 5-5.

use super::ReproduceError;
use super::embedded::{Parameters, Strategy, kolibri};
use super::validated::{Corrector, Validation};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_model::errors::{ErrorModel, Parameter, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::validate::Statistics;

/// Table 5-5, setup S: mean volumetric error (µm) by each parameter but backlash, as printed.
pub const EFFECTS: [(&str, f64); 10] = [
    ("EB0A", 50.6),
    ("EC0A", 88.8),
    ("EY0C", 41.4),
    ("EA0C", 6.38),
    ("EB0C", 2.83),
    ("EC0X", 4.96),
    ("EA0Z", 33.8),
    ("EB0Z", 10.8),
    ("EYY1", 25.2),
    ("EZZ1", 36.5),
];
/// Places (mm) from which the search starts: a ball in each quarter of the table.
const STARTS: [[f64; 3]; 4] = [
    [40.0, 40.0, 60.0],
    [-40.0, 40.0, 60.0],
    [-40.0, -40.0, 60.0],
    [40.0, -40.0, 60.0],
];
const ITERATIONS: usize = 60;
/// Step (mm) of the central differences.
const STEP: f64 = 1e-2;
/// Travel of the linear axes during the search (mm).
const FAR: f64 = 1e5;
/// The search ends with a step below this (mm).
const STILL: f64 = 1e-4;

/// A place of the ball.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// In the workpiece frame (mm).
    pub place: [f64; 3],
    /// Root mean square of the relative differences from the table.
    pub misfit: f64,
    /// The effects there (µm), in the order of [`EFFECTS`].
    pub effects: [f64; 10],
    /// The next best place from other starts (mm), and its misfit.
    pub next: Option<([f64; 3], f64)>,
}

/// Places nearer to each other than this (mm) are the same.
const SAME: f64 = 1.0;

/// The effects (µm) of each parameter of setup S alone, at the 60 positions, with the ball at a place.
fn effects(place: Vector3<f64>) -> Result<[f64; 10], ReproduceError> {
    let mut example = kolibri()?.with_ball(place.into());
    // The search may pass places out of reach.
    for axis in &mut example.machine.axes {
        if !axis.letter.is_rotary() {
            axis.travel = [-FAR, FAR];
        }
    }
    let errors = example.errors(Parameters::Kolibri12AtValidation)?;
    let perfect = ErrorModel::perfect(&example.machine);
    let validation = Validation::new(&example, Strategy::KolibriValidation, &errors)?;
    let probed = validation.probed(&perfect, &Corrector::Nothing, &Disturbances::default())?;
    let at = probed
        .rows
        .iter()
        .map(|row| example.machine.to_kinematic(&row.position));
    let at: Vec<PerAxis> = at.collect();
    let mut found = [0.0; 10];
    for (found, (name, _)) in found.iter_mut().zip(EFFECTS) {
        let mut alone = perfect.clone();
        if let Some(parameter) = Parameter::parse(name) {
            let value = errors.parameters.get(&parameter).copied();
            alone.set(&example.machine, parameter, value.unwrap_or_default());
        }
        let kinematics = Kinematics::new(&example.machine, &alone);
        let (none, situation) = (PerAxis::default(), Situation::default());
        let lengths = at
            .iter()
            .map(|q| kinematics.volumetric_error(q, &none, &situation).t.norm());
        *found = 1e3 * Statistics::of(lengths).mean;
    }
    Ok(found)
}

/// Relative differences of the effects at a place from those of a table.
fn off(printed: &[f64; 10], place: Vector3<f64>) -> Result<[f64; 10], ReproduceError> {
    let found = effects(place)?;
    Ok(std::array::from_fn(|i| found[i] / printed[i] - 1.0))
}

/// Sum of the squares of relative differences.
fn square(off: &[f64; 10]) -> f64 {
    off.iter().map(|o| o * o).sum()
}

/// Derivatives of the differences along X, Y and Z.
fn derivatives(printed: &[f64; 10], place: Vector3<f64>) -> Result<[[f64; 10]; 3], ReproduceError> {
    let mut columns = [[0.0; 10]; 3];
    for (k, column) in columns.iter_mut().enumerate() {
        let mut step = Vector3::zeros();
        step[k] = STEP;
        let (up, down) = (off(printed, place + step)?, off(printed, place - step)?);
        *column = std::array::from_fn(|i| (up[i] - down[i]) / (2.0 * STEP));
    }
    Ok(columns)
}

/// The least squares of relative differences from a start on (Levenberg, Marquardt), and their place.
fn descended(printed: &[f64; 10], start: [f64; 3]) -> Result<(f64, Vector3<f64>), ReproduceError> {
    let mut place = Vector3::from(start);
    let mut here = off(printed, place)?;
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let (mut normal, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        let columns = derivatives(printed, place)?;
        for i in 0..here.len() {
            let row = Vector3::new(columns[0][i], columns[1][i], columns[2][i]);
            normal += row * row.transpose();
            gradient += row * here[i];
        }
        normal += Matrix3::from_diagonal(&(damping * normal.diagonal()));
        let Some(step) = normal.lu().solve(&-gradient) else {
            break;
        };
        let there = off(printed, place + step)?;
        if square(&there) < square(&here) {
            (place, here) = (place + step, there);
            damping /= 5.0;
            if step.norm() < STILL {
                break;
            }
        } else {
            damping *= 5.0;
        }
    }
    Ok((square(&here), place))
}

/// The place that explains a table best.
fn fitted(printed: [f64; 10]) -> Result<Ball, ReproduceError> {
    let ends = STARTS
        .into_par_iter()
        .map(|start| descended(&printed, start));
    let mut ends = ends.collect::<Result<Vec<_>, ReproduceError>>()?;
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (least, place) = ends[0];
    let misfit = |square: f64| (square / 10.0).sqrt();
    let next = ends.iter().find(|(_, other)| (other - place).norm() > SAME);
    Ok(Ball {
        place: place.into(),
        misfit: misfit(least),
        effects: effects(place)?,
        next: next.map(|(square, place)| ((*place).into(), misfit(*square))),
    })
}

/// The ball that explains Table 5-5 as printed, and with the effects of its first two rows exchanged.
pub fn inferred() -> Result<[Ball; 2], ReproduceError> {
    let printed = EFFECTS.map(|(_, effect)| effect);
    let mut exchanged = printed;
    exchanged.swap(0, 1);
    let (printed, exchanged) = rayon::join(|| fitted(printed), || fitted(exchanged));
    Ok([printed?, exchanged?])
}
