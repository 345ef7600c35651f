//! `trueaxis compile`

mod answer;

use super::Outcome;
use super::at;
use super::bad_input::BadInput;
use super::blame;
use super::files::{self, MachineFiles};
use super::policy::PolicyArguments;
use super::progress::Bar;
use super::scheme::SchemeArguments;
use super::target;
use answer::{Answer, Proven};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use trueaxis::SampleFormat;
use trueaxis_host::compile::{self, CompileError, Full, Refusal};
use trueaxis_host::machine::Machine;
use trueaxis_host::policy::{stored, tolerance_urad};
use trueaxis_host::schemes;
use trueaxis_host::target::Target;
use trueaxis_host::uncertainty::over_travel;
use trueaxis_host::validate::Runtime;

/// Turn a machine and its errors into a compensation, and prove what it does
///
/// Evaluates the bytes of FILE.trax with the runtime at random positions over the whole travel,
/// with random directions of travel, and compares with the exact kinematic model; then writes them
/// and reads them back.
///
/// Exits with 1 and writes nothing if the tolerance is not met where no error motion holds its end
/// value, unless --best-effort is given. If that is because the target holds too little, it says
/// so, and which tolerance fits, if one was found. Tables that deviate from the kinematic
/// correction by more than it is large are never written. An older file of the same name stays as
/// it was. The schemes of the source document have as many tables as they have: they are written in
/// any case, and what they miss is a warning.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis compile examples/huron-k2x8/machine.toml examples/huron-k2x8/errors-13.toml -o huron.trax\n\nFor the controller at hand:\n  trueaxis flash --dry-run --port /dev/ttyUSB0 > board.toml\n  trueaxis compile machine.toml errors.toml -o machine.trax --target board.toml"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// The compensation to write
    #[arg(short, long, value_name = "FILE.trax")]
    output: PathBuf,
    #[command(flatten)]
    policy: PolicyArguments,
    #[command(flatten)]
    scheme: SchemeArguments,
    /// Largest difference to the kinematic correction, in µm: at the tip, with the same number of µrad
    /// for the tool's direction, but at least 1; under the other policies of every axis, in µm and µrad
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    /// Points of every table that is not a straight line (default: as the tolerance needs)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65536))]
    points: Option<u32>,
    /// Subtract the correction at this position everywhere, so that the machine's datum stays;
    /// axes left out are at 0
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// The controller it is for: stm32f405 (the reference board), desktop (as much as a blob can
    /// hold), or a file as `trueaxis flash --dry-run` prints it
    #[arg(long, value_name = "NAME|FILE", default_value = "stm32f405")]
    target: String,
    /// How samples are stored (default: as the target prefers)
    #[arg(long, value_enum)]
    samples: Option<Samples>,
    /// Write it even if the tolerance is not met, unless it does harm
    #[arg(long)]
    best_effort: bool,
    /// Accept corrections whose bound exceeds 2 mm or 1°
    #[arg(long)]
    allow_large: bool,
    #[command(flatten)]
    random: Random,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Random positions.
#[derive(Args, Clone, Copy)]
pub struct Random {
    /// Random positions in each region of the verification
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub random: u32,
    /// Seed of the random positions
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum Samples {
    /// 4 bytes each
    F32,
    /// 2 bytes each
    I16,
}

/// A finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("write a number above 0".to_owned()),
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        output,
        tolerance,
        ..
    } = arguments;
    let mut inputs: Vec<&Path> = vec![&files.machine, &files.errors];
    let target_file = Path::new(&arguments.target);
    if target_file.exists() {
        inputs.push(target_file);
    }
    files::prepare(output, &inputs)?;
    let target = target::read(&arguments.target)?;
    let (machine, errors) = files.read()?;
    let options = arguments.options(&machine, target)?;
    let blame = |error| blame::compile(error, files, &machine, &errors);
    let policy = stored(options.tables.policy);
    let bar = Bar::new();
    let answer = Answer {
        file: output,
        machine: &machine.name,
        scheme: options.scheme.name(),
        zero_at: arguments.zero_at.as_deref(),
        policy: policy.into(),
        stored: policy,
        target: &options.tables.target,
        tolerance_um: *tolerance,
        tolerance_urad: tolerance_urad(options.tables.policy, *tolerance),
        meets_tolerance: false,
        written: false,
        proven: None,
        missed: &[],
        refusals: &[],
        shortages: &[],
        smaller: options.scheme.smaller(),
        full: None,
    };
    let built = match compile::build(&machine, &errors, &options, &bar) {
        Ok(built) => built,
        Err(CompileError::NoRoom { shortages, .. }) => {
            drop(bar);
            let answer = Answer {
                shortages: &shortages,
                ..answer
            };
            answer.print(arguments.json)?;
            return Ok(Outcome::CheckFailed);
        }
        Err(error) => return Err(blame(error)),
    };
    let zero = options
        .tables
        .zero(&machine, &errors)
        .map_err(|error| blame(error.into()))?;
    // The bytes are proven before they are written; writing reads them back and compares.
    let runtime = Runtime::load(&built.blob).map_err(CompileError::from)?;
    let proof = compile::prove_held(
        &machine,
        &errors,
        &runtime,
        &zero,
        &options.scheme.held(&machine),
        options.random,
        options.seed,
        &bar,
    )
    .map_err(blame)?;
    let uncertainty = over_travel(&runtime.kinematics(&machine, &errors), options.seed)
        .map_err(|error| blame(error.into()))?;
    let (refusals, missed) = match options.scheme.keeps_tolerance() {
        true => (proof.refusals(*tolerance), Vec::new()),
        false => (Vec::new(), proof.refusals(*tolerance)),
    };
    let accepted = |refusal: &Refusal| arguments.best_effort && refusal.yields_to_best_effort();
    let written = refusals.iter().all(accepted);
    drop(bar);
    if written {
        files::write(output, &built.blob)?;
    }
    let answer = Answer {
        meets_tolerance: proof.meets(*tolerance),
        written,
        proven: Some(Proven::new(&built, &proof, uncertainty, *tolerance)),
        missed: &missed,
        refusals: &refusals,
        full: Full::of(&built, &proof, &options),
        ..answer
    };
    answer.print(arguments.json)?;
    Ok(if refusals.is_empty() {
        Outcome::Done
    } else {
        Outcome::CheckFailed
    })
}

impl Arguments {
    /// What the library is asked.
    fn options(&self, machine: &Machine, target: Target) -> Result<compile::Options, BadInput> {
        let zero_at = self
            .zero_at
            .as_deref()
            .map(|text| at::zero_position(text, machine))
            .transpose()?;
        Ok(compile::Options {
            scheme: self.scheme.scheme(machine)?,
            tables: schemes::Options {
                policy: self.policy.kinematic()?,
                tolerance: self.tolerance * 1e-3,
                points: self.points.map(|n| n as usize),
                format: match self.samples {
                    None => target.samples,
                    Some(Samples::F32) => SampleFormat::F32,
                    Some(Samples::I16) => SampleFormat::I16,
                },
                zero_at,
                target,
            },
            allow_large: self.allow_large,
            random: self.random.random as usize,
            seed: self.random.seed,
        })
    }
}
