//! Planning in one call: the parameters to identify, the rows that are given or proposed, their judgement, and what to say
//! about it.

use super::candidates::{Allowed, AllowedError, Setup};
use super::compare::as_good_as;
use super::design::{Criterion, DesignError, WantedDesign, design, needs_spindle};
use super::judge::{JudgeError, Judgement, judge};
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::{IdentifyError, Model, ModelError, effect_over_travel, lacks};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// What is to be measured, and what it is to identify.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    /// Machine, artefact, probe and instruments.
    pub setup: &'a Setup<'a>,
    /// The parameters to identify.
    pub model: &'a Model,
    /// Polynomial degree under [`Model::Auto`].
    pub degree: u8,
    /// Errors that the machine is assumed to have.
    pub assumed: &'a ErrorModel,
    /// The rows to probe.
    pub rows: PlannedRows<'a>,
}

/// The rows to probe: those of a plan, or rows to be chosen.
#[derive(Clone, Copy, Debug)]
pub enum PlannedRows<'a> {
    /// Those of this plan.
    Given(&'a Probings),
    /// The most informative ones.
    Best {
        /// Positions that rotary axes and spindle may take, as in [`Allowed::restrict`]; without them, their travel.
        indexings: Option<&'a str>,
        /// How many; without it, as many as unknowns.
        probings: Option<usize>,
        /// What they optimize.
        criterion: Criterion,
    },
    /// The fewest after which the criterion is met as well as after another plan.
    AsGoodAs {
        /// Positions that rotary axes and spindle may take.
        indexings: Option<&'a str>,
        /// The other plan.
        other: &'a Probings,
        /// What must be as good.
        criterion: Criterion,
    },
}

/// A plan: a plan, what it will identify, and what to say about it.
#[derive(Clone, Debug)]
pub struct Planned {
    /// The plan with its prediction.
    pub judgement: Judgement,
    /// The prediction for the plan of [`PlannedRows::AsGoodAs`].
    pub other: Option<Judgement>,
    /// Location errors that the model lacks and cannot reproduce.
    pub missing: Vec<Parameter>,
    /// Remarks.
    pub notes: Vec<String>,
    /// What the model lacks, in a sentence.
    pub warning: Option<String>,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The machine does not support the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The allowed positions are invalid.
    #[error("--indexings: {0}")]
    Indexings(#[from] AllowedError),
    /// No rows can be proposed.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The plan cannot be judged.
    #[error("{error}")]
    Strategy {
        /// Why not.
        error: JudgeError,
        /// True of the plan of [`PlannedRows::AsGoodAs`].
        is_other: bool,
        /// True if there are balls to probe.
        has_balls: bool,
    },
    /// No plan with as few rows is as good.
    #[error(
        "no measurement plan with {probings} probings or fewer identifies all parameters as well"
    )]
    NotAsGood {
        /// Number of rows of the other plan.
        probings: usize,
    },
    /// The equations of the plan cannot be evaluated.
    #[error(transparent)]
    Equations(#[from] IdentifyError),
}

impl PlanError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::Model(error) => return error.remedy.clone(),
            Self::Indexings(error) => error.remedy,
            Self::Design(error) => return error.remedy.clone(),
            Self::Strategy {
                error: JudgeError::Strategy(_),
                ..
            }
            | Self::Equations(_) => "correct the plan, or where the balls are in the artefact",
            Self::Strategy {
                has_balls: false, ..
            } => "read more, add probings (--artefact), or give a model with fewer parameters",
            Self::Strategy { .. } => {
                "probe at more rotary positions, or give a model with fewer parameters"
            }
            Self::NotAsGood { .. } => {
                "allow more positions (--indexings, --balls, --cone), or judge the plan itself with --plan"
            }
        }
        .to_owned()
    }
}

impl Task<'_> {
    /// Chooses the rows, unless they are given, and predicts what they will identify.
    ///
    /// # Errors
    /// [`PlanError`]: an impossible plan, or nothing to propose.
    pub fn plan(&self) -> Result<Planned, PlanError> {
        let machine = self.setup.machine;
        let directions = self.directions()?;
        let parameters = self.model.parameters(machine, self.degree, &directions)?;
        let mut notes = Vec::new();
        let (judgement, other) = self.judgement(&parameters, &directions, &mut notes)?;
        notes.extend(turned(machine, &judgement.plan));
        let missing = self.missing(&parameters, &judgement.plan)?;
        Ok(Planned {
            warning: (!missing.is_empty()).then(|| lacks(machine, &parameters, &missing)),
            judgement,
            other,
            missing,
            notes,
        })
    }

    /// The judgement of the plan, and that of the one that it has to be as good as.
    fn judgement(
        &self,
        parameters: &[Parameter],
        directions: &[bool],
        notes: &mut Vec<String>,
    ) -> Result<(Judgement, Option<Judgement>), PlanError> {
        match self.rows {
            PlannedRows::Given(plan) => Ok((self.judged(parameters, plan, false)?, None)),
            PlannedRows::Best {
                indexings,
                probings,
                criterion,
            } => {
                let allowed = self.allowed(parameters, directions, indexings, notes)?;
                let wanted = |rank: usize| WantedDesign {
                    probings: probings.unwrap_or(rank),
                    criterion,
                };
                let plan = design(self.setup, &allowed, parameters, self.assumed, wanted)?;
                Ok((self.judged(parameters, &plan, false)?, None))
            }
            PlannedRows::AsGoodAs {
                indexings,
                other: plan,
                criterion,
            } => {
                let other = self.judged(parameters, plan, true)?;
                let allowed = self.allowed(parameters, directions, indexings, notes)?;
                let (setup, assumed) = (self.setup, self.assumed);
                let found = as_good_as(setup, &allowed, parameters, assumed, &other, criterion)?;
                if !found.is_whole {
                    notes.push("the search was ended: fewer probings may do".to_owned());
                }
                let probings = other.plan.rows.len();
                let plan = found.plan.ok_or(PlanError::NotAsGood { probings })?;
                Ok((self.judged(parameters, &plan, false)?, Some(other)))
            }
        }
    }

    fn judged(
        &self,
        parameters: &[Parameter],
        plan: &Probings,
        is_other: bool,
    ) -> Result<Judgement, PlanError> {
        let judgement = judge(self.setup, parameters, plan, self.assumed);
        judgement.map_err(|error| PlanError::Strategy {
            error,
            is_other,
            has_balls: !self.setup.balls.is_empty(),
        })
    }

    /// The axes whose direction of approach will be known: those stated in the plan, or those whose backlash is
    /// identified.
    fn directions(&self) -> Result<Vec<bool>, ModelError> {
        let machine = self.setup.machine;
        if let PlannedRows::Given(plan) = self.rows {
            let probed = plan.rows.iter().map(|row| &row.direction);
            let observed = self.setup.observations.iter().flat_map(|all| &all.rows);
            let all = probed.chain(observed.map(|row| &row.direction));
            let of = |i: usize| all.clone().any(|direction| direction[i] != 0.0);
            return Ok((0..machine.axes.len()).map(of).collect());
        }
        let none = vec![false; machine.axes.len()];
        if *self.model == Model::Auto {
            return Ok(none);
        }
        let parameters = self.model.parameters(machine, self.degree, &none)?;
        let backlash = |letter: char| {
            let of = |p: &Parameter| p.axis == letter && p.kind == ParameterKind::Backlash;
            parameters.iter().any(of)
        };
        Ok((machine.axes.iter())
            .map(|a| a.letter.is_rotary() && backlash(a.letter.char()))
            .collect())
    }

    /// The positions that a proposal may use: with an indexed spindle if it was asked for, or is needed and possible.
    fn allowed(
        &self,
        parameters: &[Parameter],
        directions: &[bool],
        indexings: Option<&str>,
        notes: &mut Vec<String>,
    ) -> Result<Allowed, PlanError> {
        let machine = self.setup.machine;
        let mut allowed = Allowed::of(machine, directions);
        if let Some(text) = indexings {
            allowed.restrict(machine, text)?;
        }
        let is_spindle = |text: &str| text.split(',').any(|part| part.trim().starts_with("S="));
        if !indexings.is_some_and(is_spindle) {
            let needs = needs_spindle(self.setup, &allowed, parameters, self.assumed)?;
            if machine.can_orient && !needs.is_empty() {
                allowed.index_spindle();
            } else if !needs.is_empty() {
                notes.push(not_oriented(machine, &needs));
            }
        }
        Ok(allowed)
    }

    /// Location errors that the model lacks.
    fn missing(
        &self,
        parameters: &[Parameter],
        plan: &Probings,
    ) -> Result<Vec<Parameter>, IdentifyError> {
        let perfect = ErrorModel::perfect(self.setup.machine);
        self.setup.problem(plan, parameters, &perfect).missing()
    }
}

/// That a plan turns the spindle, if it does.
fn turned(machine: &Machine, plan: &Probings) -> Option<String> {
    let turns = plan.rows.iter().any(|row| row.spindle != 0.0);
    turns.then(|| {
        let unknown = match machine.can_orient {
            true => "",
            false => {
                ", which the machine file does not say that it can: write can_be_oriented = true under [spindle] if it can"
            }
        };
        format!("the plan turns the spindle (M19){unknown}")
    })
}

/// What turning the spindle would have identified.
fn not_oriented(machine: &Machine, needs: &[Parameter]) -> String {
    let each = needs.iter().map(|p| {
        if p.kind != ParameterKind::Inter {
            return p.to_string();
        }
        let (unit, factor) = if p.is_angular() {
            ("µrad", 1e-2)
        } else {
            ("µm", 10.0)
        };
        let effect = effect_over_travel(machine, *p) * factor;
        format!("{p} (10 {unit} move the tip by up to {effect:.1} µm over the travel)")
    });
    format!(
        "the spindle is not turned, for the machine file does not say that it can be oriented; that would show {}. If it can (M19), write can_be_oriented = true under [spindle]; if not, zero the stylus for run-out and state x_mm and y_mm with their standard uncertainties under [stylus] in the artefact",
        each.collect::<Vec<_>>().join(", ")
    )
}
