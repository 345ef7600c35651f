//! `trueaxis verify`

use super::bad_input::BadInput;
use super::error_source;
use super::files::{self, MachineFiles};
use super::number::positive;
use super::output;
use super::position_argument;
use super::progress::ProgressBarOnScreen;
use super::random::RandomOptions;
use super::{Outcome, screen, verdict};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_report::{self as report, ReportedCompensation};
use trueaxis_tables::compile::{self, Size, VerifyOutcome, VerifyRequest};

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
    zero_at: Option<&'a str>,
    #[serde(flatten)]
    outcome: &'a VerifyOutcome,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { files, blob, .. } = arguments;
    let (machine, errors) = files.read()?;
    let bytes = files::read_blob(blob)?;
    let runtime = Runtime::load(&bytes).map_err(|e| BadInput::in_blob(e, blob))?;
    compile::belongs(&machine, &errors, &runtime).map_err(|e| BadInput::mismatch(&e, blob))?;
    let request = arguments.request(&machine)?;
    let bar = ProgressBarOnScreen::new();
    let outcome = compile::verify(&machine, &errors, &runtime, &request, &bar);
    drop(bar);
    let outcome = outcome.map_err(|e| error_source::compile(e, files, &machine, &errors))?;
    if arguments.json {
        output::print_json(&VerifyAnswer {
            file: blob,
            zero_at: arguments.zero_at.as_deref(),
            outcome: &outcome,
        })?;
    } else {
        let compensation = ReportedCompensation {
            runtime: &runtime,
            verification: &outcome.verification,
            uncertainty: outcome.uncertainty.as_ref(),
            zero_at: request.zero_at.as_deref(),
            tolerance_um: arguments.tolerance,
        };
        output::print(&arguments.screen(&machine, &errors, compensation, &outcome.size)?)?;
    }
    for warning in &outcome.warnings {
        eprintln!("warning: {warning}");
    }
    for refusal in &outcome.refusals {
        eprintln!("{refusal}");
    }
    Ok(match outcome.refusals.is_empty() {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

impl Arguments {
    fn request(&self, machine: &Machine) -> Result<VerifyRequest, BadInput> {
        Ok(VerifyRequest {
            tolerance_um: self.tolerance,
            zero_at: position_argument::zero_position(self.zero_at.as_deref(), machine)?,
            held: self.held(machine)?,
            random: self.random.random as usize,
            seed: self.random.seed,
        })
    }

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
