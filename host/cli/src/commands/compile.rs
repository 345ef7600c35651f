//! `trueaxis compile`

mod answer;
mod wanted;

pub use wanted::usual;

use super::Outcome;
use super::bad_input::BadInput;
use super::date;
use super::error_source;
use super::files::{self, MachineFiles};
use super::number::positive;
use super::offered;
use super::output;
use super::policy::PolicyArguments;
use super::position_argument;
use super::progress::ProgressBarOnScreen;
use super::random::RandomOptions;
use super::scheme::SchemeArguments;
use super::target;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use trueaxis::SampleFormat;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{stored, tolerance_urad};
use trueaxis_model::validate::Runtime;
use trueaxis_report::{self as report, Document, PageModel};
use trueaxis_tables::compile::{self, CompileError};
use trueaxis_tables::made::{Made, Whole};
use trueaxis_tables::schemes::{self, Scheme};
use trueaxis_tables::target::Target;
use wanted::WantedFile;

/// Turn a machine and its errors into a compensation, and verify it
///
/// Evaluates the bytes of FILE.trax with the runtime at random positions over the whole travel, with random
/// directions of travel, and compares the result with the exact kinematic model. Then writes the file and reads it
/// back.
///
/// Exits with 1 and writes nothing if the tolerance is not met where no error motion holds its end value.
/// --best-effort then writes the candidate that deviates least. The message says if the target's capacity is the
/// cause, and which coarser tolerance (0.1, 0.2, 0.5, 1, 2, 5 or 10 µm) is met, if any. An older file of the same
/// name is left untouched.
///
/// Tables of `exact` that deviate from the kinematic correction by more than its own size are never written. Schemes of
/// the source document have a fixed number of tables: they are written in any case, and what they miss is only a
/// warning.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis compile examples/huron-k2x8/machine.toml examples/huron-k2x8/errors-13.toml -o huron.trax\n\nA scheme of the source document, where the rotary axes are at 0:\n  trueaxis compile machine.toml errors.toml -o grid.trax --scheme grid3d --policy position\n\nFor the controller at hand:\n  trueaxis flash --dry-run --port /dev/ttyUSB0 > board.toml\n  trueaxis compile machine.toml errors.toml -o machine.trax --target board.toml"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// Compensation file to write
    #[arg(short, long, value_name = "FILE.trax")]
    output: PathBuf,
    #[command(flatten)]
    policy: PolicyArguments,
    #[command(flatten)]
    scheme: SchemeArguments,
    /// Largest difference from the kinematic correction, in µm: at the tip in µm, and the same number of µrad for
    /// the tool direction, but at least 1; under the other policies, on every axis in µm and µrad (default: the
    /// finest of 0.05, 0.1, 0.2, 0.5 and 1 that fits into the target)
    #[arg(long, value_name = "µm", value_parser = positive)]
    tolerance: Option<f64>,
    /// Points of every table that is not a straight line (default: as many as the tolerance needs)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65536))]
    points: Option<u32>,
    /// Subtract the correction at this position everywhere, to keep the machine's datum; axes left out are at 0
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// The controller that will run it: stm32f405 (the reference board), desktop (the limits of the blob format), or
    /// a file printed by `trueaxis flash --dry-run`
    #[arg(long, value_name = "NAME|FILE", default_value = "stm32f405", value_parser = offered::targets(), hide_possible_values = true)]
    target: String,
    /// How samples are stored (default: what the target prefers)
    #[arg(long, value_enum)]
    samples: Option<SampleStorage>,
    /// Write the file even if the tolerance is not met, unless the tables would do harm
    #[arg(long)]
    best_effort: bool,
    /// Accept corrections whose bound exceeds 2 mm or 1°
    #[arg(long)]
    allow_large: bool,
    /// Also write a page with the errors and the effect of the tables, as `trueaxis report` does
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Date to print on the page, in any format (default: today, or SOURCE_DATE_EPOCH)
    #[arg(long, value_name = "TEXT", requires = "report")]
    date: Option<String>,
    #[command(flatten)]
    random: RandomOptions,
    /// Print every figure: other regions, the ideal correction, the worst positions, bounds of every axis
    #[arg(short, long)]
    verbose: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum SampleStorage {
    /// 4 bytes each
    F32,
    /// 2 bytes each
    I16,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let files = &arguments.files;
    let (wanted, machine, errors) = arguments.prepared()?;
    let bar = ProgressBarOnScreen::new();
    let made = (wanted.iter())
        .map(|one| one.make(files, &machine, &errors, &bar))
        .collect::<Result<Vec<Made>, BadInput>>()?;
    drop(bar);
    // Write either all files or none.
    let written = made
        .iter()
        .all(|one| one.may_be_written(arguments.best_effort));
    let (mut answers, mut verdicts) = (Vec::new(), Vec::new());
    for (wanted, made) in wanted.iter().zip(&made) {
        if written {
            wanted.write(made)?;
        }
        answers.push(wanted.answer(&machine, made, written));
        verdicts.push(match arguments.json {
            true => String::new(),
            false => wanted.verdict(&machine, &errors, made)?,
        });
    }
    answer::print(&answers, &verdicts, arguments.json)?;
    // The report takes longer than the rest of many compensations.
    for (wanted, made) in wanted.iter().zip(&made) {
        if let (true, Made::Verified(made)) = (written, made) {
            arguments.report(&machine, &errors, wanted, made)?;
        }
    }
    Ok(match made.iter().all(Made::is_right) {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

impl Arguments {
    /// What to make of which machine; refuses outputs that cannot be written, or that are inputs.
    fn prepared(&self) -> Result<(Vec<WantedFile>, Machine, ErrorModel), BadInput> {
        let mut inputs: Vec<&Path> = vec![&self.files.machine, &self.files.errors];
        let target_file = Path::new(&self.target);
        if target_file.exists() {
            inputs.push(target_file);
        }
        if output::is_screen(&self.output) {
            return Err(BadInput::new(
                "-o -: a compensation is not text, and does not go to the screen",
                "give -o the name of a file",
            ));
        }
        output::prepare(&self.output, &inputs)?;
        let target = target::read(&self.target)?;
        let (machine, errors) = self.files.read()?;
        let wanted = self.wanted(&machine, target)?;
        for one in &wanted {
            output::prepare(&one.output, &inputs)?;
        }
        if let Some(page) = &self.report {
            output::prepare(page, &inputs)?;
            if wanted.len() > 1 || *page == self.output {
                return Err(BadInput::new(
                    "--report is for one compensation, and a file of its own",
                    "compile one position of the rotary axes at a time, or run `trueaxis report` for each file",
                ));
            }
        }
        Ok((wanted, machine, errors))
    }

    /// The files to make: one, or one for each position of the rotary axes.
    fn wanted(&self, machine: &Machine, target: Target) -> Result<Vec<WantedFile>, BadInput> {
        let schemes = self.scheme.schemes(machine)?;
        let is_one = schemes.len() == 1;
        let wanted = schemes.into_iter().map(|(scheme, place)| {
            Ok(WantedFile {
                output: match is_one {
                    true => self.output.clone(),
                    false => beside(&self.output, &place),
                },
                options: self.options(machine, target.clone(), scheme)?,
                asked: self.tolerance,
                zero_at: self.zero_at.clone(),
                is_verbose: self.verbose,
            })
        });
        wanted.collect()
    }

    /// Writes the page if `--report` was given.
    fn report(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        wanted: &WantedFile,
        made: &Whole,
    ) -> Result<(), BadInput> {
        let Some(page) = &self.report else {
            return Ok(());
        };
        let runtime = Runtime::load(&made.best.built.blob)
            .map_err(|e| BadInput::in_blob(e, &wanted.output))?;
        let tables = &wanted.options.tables;
        let mut document = Document {
            date: Some(date::given_or_today(self.date.as_deref())?),
            reference_position: self.zero_at.clone(),
            policy: stored(tables.policy).to_string(),
            tolerance_um: made.best.tolerance,
            tolerance_urad: tolerance_urad(tables.policy, made.best.tolerance),
            seed: self.random.seed,
            ..Document::of(machine)
        };
        for (role, path) in [
            ("machine", &self.files.machine),
            ("errors", &self.files.errors),
            ("compensation", &wanted.output),
        ] {
            document.files.push(files::described(role, path)?);
        }
        let compensation = wanted.compensation(&runtime, made);
        let found = report::report(machine, errors, Some(compensation), None, document);
        let found = found.map_err(|error| super::report::bad(&error))?;
        let blame =
            |error: CompileError| error_source::compile(error, &self.files, machine, errors);
        let zero = tables.zero(machine, errors);
        let zero = zero.map_err(|error| blame(error.into()))?;
        let model = PageModel::relative_to(machine, errors, Some(&runtime), &zero);
        super::report::write_page(page, &found, &model)
    }

    /// Options for the library.
    fn options(
        &self,
        machine: &Machine,
        target: Target,
        scheme: Scheme,
    ) -> Result<compile::Options, BadInput> {
        if let (Scheme::Grid3d(_), Some(_)) = (&scheme, self.points) {
            return Err(BadInput::new(
                "--points is given, but --scheme grid3d has no tables",
                "leave out --points, or say how many nodes there may be with --max-nodes",
            ));
        }
        let zero_at = position_argument::zero_position(self.zero_at.as_deref(), machine)?;
        Ok(compile::Options {
            scheme,
            tables: schemes::Options {
                policy: self.policy.kinematic()?,
                tolerance: self.tolerance.unwrap_or(compile::FINEST) * 1e-3,
                points: self.points.map(|n| n as usize),
                format: match self.samples {
                    None => target.samples,
                    Some(SampleStorage::F32) => SampleFormat::F32,
                    Some(SampleStorage::I16) => SampleFormat::I16,
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

/// Name of one of several files: FILE-A0-C90.trax.
fn beside(output: &Path, place: &str) -> PathBuf {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let extension = output.extension().unwrap_or_default().to_string_lossy();
    let dot = if extension.is_empty() { "" } else { "." };
    output.with_file_name(format!("{stem}-{place}{dot}{extension}"))
}
