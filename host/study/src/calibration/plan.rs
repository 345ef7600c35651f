//! What a calibration probes: from parameters to rows that tell them, rows that validate, and rows that qualify the probe.

use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::{Model, ModelError};
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;
use trueaxis_probing::plan::{PlanError, Planned, Setup, Task, validation};

/// The parameters to identify if nobody says which: those of models 12 and 13 together, every location error and scale,
/// the place of the spindle and the backlash of rotary axes. Without a length standard, the scale of X cannot be told from
/// that of the balls' places.
///
/// # Errors
/// [`ModelError`]: a machine of another layout.
pub fn usual_model(machine: &Machine, artefact: &Artefact) -> Result<Model, ModelError> {
    let has_length = !artefact.bars.is_empty();
    let mut all: Vec<Parameter> = Vec::new();
    for model in [Model::Twelve, Model::Thirteen] {
        for parameter in model.parameters(machine, 0, &[])? {
            let is_known = has_length || parameter.to_string() != "EXX1";
            if is_known && !all.contains(&parameter) {
                all.push(parameter);
            }
        }
    }
    Ok(Model::Named(all))
}

/// Rows to probe.
#[derive(Clone, Debug)]
pub struct CalibrationPlan {
    /// Those that tell the parameters, and how well.
    pub planned: Planned,
    /// Rows of one ball on which the probe is qualified first, if it is.
    pub qualification: Option<Probings>,
    /// Rows at other positions, which validate.
    pub validation: Probings,
}

/// Why there is nothing to probe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationPlanError {
    /// There is no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Nothing is left to validate with.
    #[error("no ball can be probed at other positions to validate the result")]
    NothingToValidate,
    /// The probe cannot be qualified on this ball.
    #[error("--qualify: the plan has no row of ball `{0}` with the spindle at 0")]
    NotInPlan(String),
}

impl CalibrationPlanError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Plan(error) => error.remedy(),
            Self::NothingToValidate => "allow more: --indexings, --cone, more balls; a machine without rotary axes is calibrated by measuring scales and squareness (trueaxis measured)".to_owned(),
            Self::NotInPlan(_) => "name a ball of the artefact that can be probed".to_owned(),
        }
    }
}

/// Rotary positions at which the probe is qualified, at most.
const POSES: usize = 3;

impl CalibrationPlan {
    /// The rows of a task, as many others that validate, and those of a ball on which the probe is qualified.
    ///
    /// # Errors
    /// [`CalibrationPlanError`].
    pub fn of(
        task: &Task<'_>,
        validating: usize,
        qualified_on: Option<&str>,
    ) -> Result<Self, CalibrationPlanError> {
        let planned = task.plan()?;
        let plan = &planned.judgement.plan;
        let qualification = qualified_on.map(|ball| poses(task.setup, plan, ball));
        let validation = validation(task.setup, plan, validating, 1);
        if validation.rows.is_empty() {
            return Err(CalibrationPlanError::NothingToValidate);
        }
        Ok(Self {
            qualification: qualification.transpose()?,
            validation,
            planned,
        })
    }
}

/// Rows of a ball at rotary positions that are far from each other.
fn poses(setup: &Setup<'_>, plan: &Probings, ball: &str) -> Result<Probings, CalibrationPlanError> {
    let axes = &setup.machine.axes;
    let apart = |a: &Probing, b: &Probing| {
        let rotary = (0..axes.len()).filter(|i| axes[*i].letter.is_rotary());
        let distances = rotary.map(|i| (a.position[i] - b.position[i]).abs());
        distances.sum::<f64>()
    };
    let of_ball = |row: &&Probing| plan.balls[row.ball] == ball && row.spindle == 0.0;
    let rows: Vec<&Probing> = plan.rows.iter().filter(of_ball).collect();
    let first = rows.first().copied();
    let first = first.ok_or_else(|| CalibrationPlanError::NotInPlan(ball.to_owned()))?;
    let mut chosen = vec![first];
    while chosen.len() < POSES.min(rows.len()) {
        let least = |row: &Probing| {
            let apart = chosen.iter().map(|other| apart(row, other));
            apart.fold(f64::INFINITY, f64::min)
        };
        let farthest = rows.iter().max_by(|a, b| least(a).total_cmp(&least(b)));
        match farthest.filter(|row| least(row) > 0.0).copied() {
            Some(row) => chosen.push(row),
            None => break,
        }
    }
    Ok(Probings {
        balls: plan.balls.clone(),
        rows: chosen.into_iter().cloned().collect(),
    })
}
