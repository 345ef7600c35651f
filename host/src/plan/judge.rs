//! What a strategy will tell.

use super::band::{Band, Spread};
use super::candidates::{Allowed, Setup, Unreachable};
use crate::errors::{Parameter, ParameterKind};
use crate::formats::probings::{Probing, Probings};
use crate::identify::{Assumed, Foreseen, IdentifyError, Problem, Unknown};
use crate::kinematics::Kinematics;
use crate::simulate::{Disturbances, SimulateError, probings};
use nalgebra::DVector;

/// What a strategy will tell.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The strategy with the positions at which the assumed machine is on the balls, and with uncertainties.
    pub strategy: Probings,
    /// Parameters, their covariance, what is not seen.
    pub foreseen: Foreseen,
    /// Standard uncertainty of the tip over the travel (mm).
    pub tip: Spread,
    /// Of the tool direction (rad).
    pub direction: Spread,
    /// For each of the parameters that are not seen, a probing with which it would be.
    pub remedies: Vec<Remedy>,
    /// Rows that the probe does not reach.
    pub unreachable: Vec<(Probing, Unreachable)>,
}

/// A probing that shows what the others do not.
#[derive(Clone, Debug, PartialEq)]
pub struct Remedy {
    /// What is not seen without it.
    pub unseen: Unknown,
    /// The probing; its ball is one of the strategy's.
    pub add: Option<Probing>,
}

/// Why a strategy cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JudgeError {
    /// A row cannot be.
    #[error(transparent)]
    Strategy(#[from] SimulateError),
    /// It has too few rows.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// Positions at which the volumetric error is looked at: the mean is certain to some 2 %.
const POSITIONS: usize = 1000;
/// For so many parameters that are not seen another position is looked for.
const REMEDIES: usize = 12;
/// Of the spindle, where one is added.
const SPINDLE: [f64; 4] = [0.0, 90.0, 180.0, 270.0];

/// A strategy with the positions at which the assumed machine is on the balls, and with the uncertainty of the
/// setup where its own rows do not all have one.
///
/// # Errors
/// [`SimulateError`]: a ball without a place, a position outside the travel.
pub fn placed(
    setup: &Setup<'_>,
    strategy: &Probings,
    assumed: Assumed<'_>,
) -> Result<Probings, SimulateError> {
    let kinematics = Kinematics::new(setup.machine, assumed.errors);
    let nothing = Disturbances::default();
    let mut placed = probings(&kinematics, setup.artefact, strategy, &nothing)?;
    for (row, wanted) in placed.rows.iter_mut().zip(&strategy.rows) {
        for (i, axis) in setup.machine.axes.iter().enumerate() {
            if axis.letter.is_rotary() {
                // Without the rounding of radians.
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

/// Judges a strategy by the equations of `identify`.
///
/// # Errors
/// [`JudgeError`]: rows that cannot be, or too few.
pub fn judge(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    strategy: &Probings,
    assumed: Assumed<'_>,
) -> Result<Judgement, JudgeError> {
    let mut judgement = judge_alone(setup, parameters, strategy, assumed)?;
    let setup = Setup {
        balls: judgement.strategy.balls.clone(),
        ..setup.clone()
    };
    let (strategy, foreseen) = (&judgement.strategy, &judgement.foreseen);
    judgement.remedies = remedies(&setup, parameters, strategy, assumed, foreseen);
    Ok(judgement)
}

/// The same without remedies, which take longest.
pub(super) fn judge_alone(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    strategy: &Probings,
    assumed: Assumed<'_>,
) -> Result<Judgement, JudgeError> {
    let strategy = placed(setup, strategy, assumed)?;
    let foreseen = foreseen(setup, parameters, &strategy, assumed)?;
    let band = band(setup, &foreseen.parameters, &strategy, assumed);
    let [tip, direction] = band.spread(&foreseen.covariance);
    let of_strategy = Setup {
        balls: strategy.balls.clone(),
        ..setup.clone()
    };
    let unreachable = strategy.rows.iter().filter_map(|row| {
        let reason = of_strategy.touching(row).err()?;
        Some((row.clone(), reason))
    });
    Ok(Judgement {
        unreachable: unreachable.collect(),
        remedies: Vec::new(),
        strategy,
        foreseen,
        tip,
        direction,
    })
}

fn foreseen(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    strategy: &Probings,
    assumed: Assumed<'_>,
) -> Result<Foreseen, IdentifyError> {
    let perfect = crate::errors::ErrorModel::perfect(setup.machine);
    let problem = Problem::new(
        setup.machine,
        strategy,
        setup.artefact,
        parameters,
        &perfect,
    );
    problem.foresee(assumed)
}

/// The volumetric error after probings at these positions.
pub(super) fn band(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    probings: &Probings,
    assumed: Assumed<'_>,
) -> Band {
    let axes = 0..setup.machine.axes.len();
    let probed = axes.map(|i| {
        let positions = probings.rows.iter().map(|row| row.position[i]);
        let low = positions.clone().fold(f64::INFINITY, f64::min);
        [low, positions.fold(f64::NEG_INFINITY, f64::max)]
    });
    let probed: Vec<[f64; 2]> = probed.collect();
    Band::new(
        setup.machine,
        assumed.errors,
        parameters,
        &probed,
        POSITIONS,
    )
}

/// For each parameter that is not seen the one probing that shows most of it, if it then is seen.
fn remedies(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    strategy: &Probings,
    assumed: Assumed<'_>,
    foreseen: &Foreseen,
) -> Vec<Remedy> {
    let is_parameter = |u: &Unknown| matches!(u, Unknown::Parameter(_));
    let unseen = foreseen.unseen.iter().zip(&foreseen.hidden);
    let unseen: Vec<_> = (unseen.filter(|(u, _)| is_parameter(&u.unknown)))
        .take(REMEDIES)
        .collect();
    if unseen.is_empty() {
        return Vec::new();
    }
    let backlash = |letter: char| {
        let of = |p: &&Parameter| p.kind == ParameterKind::Backlash && p.axis == letter;
        parameters.iter().find(of).is_some()
    };
    let machine = setup.machine;
    let directions: Vec<bool> = (machine.axes.iter())
        .map(|a| backlash(a.letter.char()))
        .collect();
    let mut allowed = Allowed::of(machine, &directions);
    allowed.spindle = SPINDLE.to_vec();
    let (candidates, _) = setup.candidates(&allowed);
    if candidates.rows.is_empty() {
        return Vec::new();
    }
    let perfect = crate::errors::ErrorModel::perfect(machine);
    let problem = Problem::new(machine, &candidates, setup.artefact, parameters, &perfect);
    let (equations, _) = problem.equations_at(assumed.errors);
    let shown = |i: usize, hidden: &DVector<f64>| (&equations[i] * hidden).norm();
    let remedy = |unknown: Unknown, hidden: &DVector<f64>, indexed: bool| {
        let rows = (0..equations.len()).filter(|i| indexed || candidates.rows[*i].spindle == 0.0);
        let most = rows.max_by(|a, b| {
            let [a, b] = [a, b].map(|i| shown(*i, hidden));
            a.total_cmp(&b)
        })?;
        let mut with = strategy.clone();
        let row = candidates.rows[most].clone();
        with.rows.push(row.clone());
        let then = self::foreseen(setup, parameters, &with, assumed).ok()?;
        let is_seen = then.unseen.iter().all(|u| u.unknown != unknown)
            && then.unseen.len() < foreseen.unseen.len();
        is_seen.then_some(row)
    };
    let each = unseen.into_iter().map(|(unseen, hidden)| Remedy {
        unseen: unseen.unknown,
        // Not every spindle can be indexed.
        add: remedy(unseen.unknown, hidden, false).or_else(|| remedy(unseen.unknown, hidden, true)),
    });
    each.collect()
}
