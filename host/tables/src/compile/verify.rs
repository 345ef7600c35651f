//! A compensation judged beside the exact model: from a blob to deviations, what uncertain parameters leave, and verdict.

use super::{CompileError, Progress, Proof, Refusal, Warning, prove_held, worse};
use crate::schemes;
use crate::size::Size;
use serde::Serialize;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{PolicyName, of_blob, tolerance_urad};
use trueaxis_model::uncertainty::{OverTravel, over_travel};
use trueaxis_model::validate::Runtime;

/// What a compensation is compared with, and how thoroughly.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyRequest {
    /// Largest permitted difference from the kinematic correction (µm).
    pub tolerance_um: f64,
    /// Position (mm, deg) at which the tables were made to be 0, if they were.
    pub zero_at: Option<Vec<f64>>,
    /// Rotary axes (index, deg) for which alone the tables are made, if any.
    pub held: Vec<(usize, f64)>,
    /// Random positions in each region.
    pub random: usize,
    /// Seed of the random positions.
    pub seed: u64,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct VerifyOutcome {
    /// Name of the machine.
    pub machine: String,
    /// The policy that the blob states.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// Largest permitted difference from the kinematic correction of a linear axis (µm).
    pub tolerance_um: f64,
    /// That of a rotary axis (µrad).
    pub tolerance_urad: f64,
    /// Whether no difference is larger.
    pub meets_tolerance: bool,
    /// Why the compensation should not be used.
    pub refusals: Vec<Refusal>,
    /// Where it makes an error larger.
    pub warnings: Vec<Warning>,
    /// What it takes in the target.
    #[serde(flatten)]
    pub size: Size,
    /// Deviations from the exact model.
    #[serde(flatten)]
    pub verification: Proof,
    /// 95 % interval of the error that uncertain parameters leave.
    pub uncertainty: Option<OverTravel>,
}

/// Compares a compensation with the exact model, and computes the error that uncertain parameters leave.
///
/// # Errors
/// [`CompileError`] if the kinematic correction fails, or almost nothing is calibrated.
pub fn verify(
    machine: &Machine,
    errors: &ErrorModel,
    runtime: &Runtime<'_>,
    request: &VerifyRequest,
    progress: &dyn Progress,
) -> Result<VerifyOutcome, CompileError> {
    let VerifyRequest {
        tolerance_um,
        zero_at,
        held,
        random,
        seed,
    } = request;
    let policy = runtime.compensation().policy();
    let subtracted = schemes::Options {
        policy: of_blob(policy),
        zero_at: zero_at.clone(),
        ..schemes::Options::default()
    };
    let zero = subtracted.zero(machine, errors)?;
    let verification = prove_held(
        machine, errors, runtime, &zero, held, *random, *seed, progress,
    )?;
    let uncertainty = over_travel(&runtime.kinematics(machine, errors), *seed)?;
    let mut refusals = verification.refusals(*tolerance_um);
    if !held.is_empty() {
        // Elsewhere, deviations are reported but do not fail.
        refusals.retain(Refusal::yields_to_best_effort);
    }
    Ok(VerifyOutcome {
        machine: machine.name.clone(),
        policy: policy.into(),
        tolerance_um: *tolerance_um,
        tolerance_urad: tolerance_urad(of_blob(policy), *tolerance_um),
        meets_tolerance: verification.meets(*tolerance_um),
        warnings: worse(&verification, *tolerance_um),
        size: Size::of(runtime),
        refusals,
        verification,
        uncertainty,
    })
}
