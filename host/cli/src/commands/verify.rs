//! `trueaxis verify`

use super::bad_input::BadInput;
use super::error_source;
use super::files::{self, MachineFiles};
use super::number::positive;
use super::position_argument;
use super::progress::ProgressBarOnScreen;
use super::random::RandomOptions;
use super::{Outcome, screen, verdict};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_report::{self as report, ReportedCompensation};
use trueaxis_tables::compile::{self, Proof, Refusal, Size, Warning};
use trueaxis_tables::policy::{PolicyName, of_blob, tolerance_urad};
use trueaxis_tables::schemes;
use trueaxis_tables::uncertainty::{OverTravel, over_travel};
use trueaxis_tables::validate::Runtime;

/// Compare a compensation with the rigid-body model at random positions
///
/// Evaluates the blob with the runtime over the whole travel, with random directions of travel, tool lengths and
/// temperatures. Exits with 1 if the tolerance is not met where no error motion holds its end value, or if the
/// tables deviate from the kinematic correction of an axis by more than its own size.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis verify machine.toml errors.toml machine.trax --random 100000 --seed 7 --json"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    #[command(flatten)]
    random: RandomOptions,
    /// Largest permitted difference from the kinematic correction, as in `compile`
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    /// The --zero-at position that `compile` was given
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// The --rotary position that `compile --scheme grid3d` was given (A=0,C=0 if none); the blob passes if it is
    /// right there
    #[arg(long, value_name = "A=0,C=0")]
    rotary: Option<String>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// The answer for programs.
#[derive(Serialize)]
struct VerifyAnswer<'a> {
    file: &'a Path,
    machine: &'a str,
    zero_at: Option<&'a str>,
    #[serde(flatten)]
    policy: PolicyName,
    tolerance_um: f64,
    tolerance_urad: f64,
    meets_tolerance: bool,
    refusals: &'a [Refusal],
    warnings: &'a [Warning],
    #[serde(flatten)]
    size: Size,
    #[serde(flatten)]
    verification: &'a Proof,
    /// 95 % interval of the error that uncertain parameters leave.
    uncertainty: Option<&'a OverTravel>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        blob: path,
        tolerance,
        ..
    } = arguments;
    let (machine, errors) = files.read()?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    compile::belongs(&machine, &errors, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
    let zero_at = arguments.zero_at.as_deref();
    let zero_at = zero_at
        .map(|text| position_argument::zero_position(text, &machine))
        .transpose()?;
    let held = arguments.held(&machine)?;
    let policy = runtime.compensation().policy();
    let subtracted = schemes::Options {
        policy: of_blob(policy),
        zero_at,
        ..schemes::Options::default()
    };
    let blame = |error| error_source::compile(error, files, &machine, &errors);
    let zero = subtracted
        .zero(&machine, &errors)
        .map_err(|error| blame(error.into()))?;
    let bar = ProgressBarOnScreen::new();
    let RandomOptions { random, seed } = arguments.random;
    let verification = compile::prove_held(
        &machine,
        &errors,
        &runtime,
        &zero,
        &held,
        random as usize,
        seed,
        &bar,
    )
    .map_err(blame)?;
    drop(bar);
    let uncertainty = over_travel(&runtime.kinematics(&machine, &errors), seed)
        .map_err(|error| blame(error.into()))?;
    let mut refusals = verification.refusals(*tolerance);
    if !held.is_empty() {
        // Elsewhere, deviations are reported but do not fail.
        refusals.retain(Refusal::yields_to_best_effort);
    }
    let warnings = compile::worse(&verification, *tolerance);
    let size = Size::of(&runtime);
    let compensation = ReportedCompensation {
        runtime: &runtime,
        verification: &verification,
        uncertainty: uncertainty.as_ref(),
        zero_at: subtracted.zero_at.as_deref(),
        tolerance_um: *tolerance,
    };
    if arguments.json {
        files::print_json(&VerifyAnswer {
            file: path,
            machine: &machine.name,
            zero_at: arguments.zero_at.as_deref(),
            policy: policy.into(),
            tolerance_um: *tolerance,
            tolerance_urad: tolerance_urad(of_blob(policy), *tolerance),
            meets_tolerance: verification.meets(*tolerance),
            refusals: &refusals,
            warnings: &warnings,
            size,
            verification: &verification,
            uncertainty: uncertainty.as_ref(),
        })?;
    } else {
        files::print(&arguments.screen(&machine, &errors, compensation, &size)?)?;
    }
    for warning in &warnings {
        eprintln!("warning: {warning}");
    }
    for refusal in &refusals {
        eprintln!("{refusal}");
    }
    Ok(if refusals.is_empty() {
        Outcome::Done
    } else {
        Outcome::CheckFailed
    })
}

impl Arguments {
    /// The positions of the rotary axes for which alone the tables are made.
    fn held(&self, machine: &Machine) -> Result<Vec<(usize, f64)>, BadInput> {
        let rotary = self.rotary.as_deref();
        let rotary = rotary
            .map(|text| position_argument::within_travel("--rotary", text, machine))
            .transpose()?;
        Ok(rotary.map_or(Vec::new(), |rotary| held(machine, rotary)))
    }

    /// The text output.
    fn screen(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        compensation: ReportedCompensation<'_>,
        size: &Size,
    ) -> Result<String, BadInput> {
        let told = report::verdict(machine, errors, Some(compensation), self.random.seed)
            .map_err(|error| super::report::bad(&error))?;
        let verification = compensation.verification;
        let title = format!("{}: {}\n", self.blob.display(), machine.name);
        Ok(title
            + &screen::size(size)
            + &screen::zero(self.zero_at.as_deref())
            + &screen::policy(compensation.runtime.compensation().policy())
            + "\n"
            + &screen::quality(verification, self.tolerance)
            + &screen::uncertainty(compensation.uncertainty)
            + &screen::tool_length(verification)
            + &verdict::lines(&told))
    }
}

/// The indices of the rotary axes and their positions (deg).
fn held(machine: &Machine, position: Vec<f64>) -> Vec<(usize, f64)> {
    let all = position.into_iter().enumerate();
    all.filter(|(i, _)| machine.axes[*i].letter.is_rotary())
        .collect()
}
