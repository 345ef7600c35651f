//! Predicts what a plan will identify.

use super::band::{Band, UncertaintySpread};
use super::candidates::Setup;
use super::remedy::{Remedy, remedies};
use super::touches::Unreachable;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::simulate::{Disturbances, SimulateError, probings};
use trueaxis_identify::{Foreseen, IdentifyError};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::numbers::extremes;

/// Prediction for a plan.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The plan with the positions at which the assumed machine is at the balls, and with uncertainties.
    pub plan: Probings,
    /// Identifiable parameters, their covariance, and what cannot be identified.
    pub foreseen: Foreseen,
    /// Standard uncertainty of the tip over the travel (mm).
    pub tip: UncertaintySpread,
    /// Standard uncertainty of the tool direction (rad).
    pub direction: UncertaintySpread,
    /// For each parameter that is not identifiable, a probing with which it would be.
    pub remedies: Vec<Remedy>,
    /// Rows that the probe cannot reach.
    pub unreachable: Vec<(Probing, Unreachable)>,
}

/// Why a plan cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JudgeError {
    /// A row is impossible.
    #[error(transparent)]
    Strategy(#[from] SimulateError),
    /// There are too few rows.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// Number of positions at which the volumetric error is evaluated; its mean is accurate to about 2 %.
const POSITIONS: usize = 1000;

/// A plan with the positions at which the assumed machine is at the balls, and with the uncertainty of `setup`
/// unless all of its rows have their own.
///
/// # Errors
/// [`SimulateError`]: a ball without a position, a position outside the travel.
pub fn placed(
    setup: &Setup<'_>,
    plan: &Probings,
    assumed: &ErrorModel,
) -> Result<Probings, SimulateError> {
    let kinematics = Kinematics::new(setup.machine, assumed);
    let nothing = Disturbances::default();
    let mut placed = probings(&kinematics, setup.artefact, plan, &nothing)?;
    for (row, wanted) in placed.rows.iter_mut().zip(&plan.rows) {
        for (i, axis) in setup.machine.axes.iter().enumerate() {
            if axis.letter.is_rotary() {
                // Without rounding errors from radians.
                row.position[i] = wanted.position[i];
            }
        }
    }
    if placed.rows.iter().any(|row| row.sigma.is_none()) {
        for row in &mut placed.rows {
            row.sigma = Some(setup.sigma);
        }
    }
    Ok(placed)
}

/// Evaluates a plan by the equations of `identify`.
///
/// # Errors
/// [`JudgeError`]: rows that are impossible, or too few.
pub fn judge(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    plan: &Probings,
    assumed: &ErrorModel,
) -> Result<Judgement, JudgeError> {
    let mut judgement = judge_alone(setup, parameters, plan, assumed)?;
    let setup = setup.of_plan(&judgement.plan);
    let (plan, foreseen) = (&judgement.plan, &judgement.foreseen);
    let perfect = ErrorModel::perfect(setup.machine);
    judgement.remedies = remedies(&setup, parameters, &perfect, plan, assumed, foreseen);
    Ok(judgement)
}

/// Like `judge`, without remedies, which take most of the time.
pub(super) fn judge_alone(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    plan: &Probings,
    assumed: &ErrorModel,
) -> Result<Judgement, JudgeError> {
    let plan = placed(setup, plan, assumed)?;
    let perfect = ErrorModel::perfect(setup.machine);
    let foreseen = setup
        .problem(&plan, parameters, &perfect)
        .foresee(assumed)?;
    let band = band(setup, &foreseen.parameters, &plan, assumed);
    let [tip, direction] = band.spread(&foreseen.covariance);
    let of_plan = setup.of_plan(&plan);
    let unreachable = plan.rows.iter().filter_map(|row| {
        let reason = of_plan.touching(row).err()?;
        Some((row.clone(), reason))
    });
    Ok(Judgement {
        unreachable: unreachable.collect(),
        remedies: Vec::new(),
        plan,
        foreseen,
        tip,
        direction,
    })
}

/// The volumetric error after probings at these positions and what instruments read.
pub(super) fn band(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    probings: &Probings,
    assumed: &ErrorModel,
) -> Band {
    let axes = 0..setup.machine.axes.len();
    let observed = setup.observations.map_or(&[][..], |o| &o.rows);
    let probed = axes.map(|i| {
        let positions = probings.rows.iter().map(|row| row.position[i]);
        let positions = positions.chain(observed.iter().map(|row| row.position[i]));
        extremes(positions)
    });
    let probed: Vec<[f64; 2]> = probed.collect();
    Band::new(setup.machine, assumed, parameters, &probed, POSITIONS)
}
