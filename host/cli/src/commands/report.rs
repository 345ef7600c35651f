//! `trueaxis report`

use super::Outcome;
use super::bad_input::BadInput;
use super::date;
use super::error_source;
use super::files::{self, MachineFiles, Text};
use super::number::positive;
use super::output;
use super::position_argument;
use super::progress::ProgressBarOnScreen;
use super::random::RandomOptions;
use clap::Args;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use trueaxis::AlignedBlob;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{of_blob, stored, tolerance_urad};
use trueaxis_model::validate::Runtime;
use trueaxis_report::certificate::{self, CalibrationRecord, Certificate};
use trueaxis_report::{
    self as report, Document, Identification, PageModel, ReportError, ReportFigures,
    ReportedCompensation,
};
use trueaxis_study::validation::Validation;
use trueaxis_tables::compile::{self, VerifyOutcome, VerifyRequest};
use trueaxis_tables::schemes;

/// Write a page with a machine's errors and a compensation's effect
///
/// The page is one file that needs no network: a verdict in words, an interactive model of the machine and its
/// errors, the error budget, error motions, simulated tests, tables. It can be printed. The same input and date give
/// the same bytes.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis report machine.toml errors.toml machine.trax -o report.html --date 2026-11-23\n  \
trueaxis report machine.toml errors.toml --json > now.json\n  \
trueaxis report machine.toml errors.toml machine.trax --calibration-report -o calibration.html \\\n    \
--calibration calibration.toml --identification found.json --validation validation.json"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: Option<PathBuf>,
    /// The page to write
    #[arg(
        short,
        long,
        value_name = "FILE.html",
        required_unless_present_any = ["json", "pictures"]
    )]
    output: Option<PathBuf>,
    /// Write the error budget and the circular tests into this folder, as SVG files
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// How the errors were found: output of `identify --json`
    #[arg(long, value_name = "FILE.json")]
    identification: Option<PathBuf>,
    /// What was measured without and with the compensation: validation.json of `linuxcnc calibrate` (default: the one
    /// beside ERRORS and FILE.trax, if these are in one folder)
    #[arg(long, value_name = "FILE.json")]
    validation: Option<PathBuf>,
    /// An older report of the machine, as printed by --json: shows what has changed since
    #[arg(long, value_name = "OLD.json")]
    compare: Option<PathBuf>,
    /// Write a calibration report to hand over instead of the page: four A4 pages at most
    #[arg(long, conflicts_with_all = ["pictures", "compare"])]
    calibration_report: bool,
    /// Operator, instruments, temperatures, limits and stated uncertainties for --calibration-report (calibration.toml)
    #[arg(long, value_name = "FILE.toml", requires = "calibration_report")]
    calibration: Option<PathBuf>,
    /// Date to print on the page, in any format (default: today, or SOURCE_DATE_EPOCH)
    #[arg(long, value_name = "TEXT")]
    date: Option<String>,
    #[command(flatten)]
    random: RandomOptions,
    /// Largest permitted difference from the kinematic correction, as in `compile`
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    /// The --zero-at position that `compile` was given
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// Print all figures as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    arguments.prepare()?;
    let (machine, errors) = arguments.files.read()?;
    let mut given = Given::read(arguments, &machine)?;
    let (bytes, zero_at) = (given.bytes.take(), given.zero_at.take());
    let runtime = match (&bytes, &arguments.blob) {
        (Some(bytes), Some(path)) => Some(load(bytes, path)?),
        _ => None,
    };
    let belongs = |runtime| compile::belongs(&machine, &errors, runtime);
    let mismatch = runtime.as_ref().and_then(|runtime| belongs(runtime).err());
    let runtime = runtime.filter(|_| mismatch.is_none());
    let verified = |runtime| arguments.verified(&machine, &errors, runtime, &zero_at);
    let verified = runtime.as_ref().map(verified).transpose()?;
    let compensation = runtime.as_ref().zip(verified.as_ref());
    let compensation = compensation.map(|(runtime, verified)| ReportedCompensation {
        runtime,
        verification: &verified.verification,
        uncertainty: verified.uncertainty.as_ref(),
        zero_at: zero_at.as_deref(),
        tolerance_um: arguments.tolerance,
    });
    let report = arguments.figures(&machine, &errors, compensation, &mut given, &mismatch)?;
    let conforms = if arguments.calibration_report {
        let calibration = std::mem::take(&mut given.calibration);
        let certificate =
            certificate::certificate(&machine, &errors, compensation, &report, calibration);
        let certificate = certificate.map_err(|error| bad(&error))?;
        arguments.certify(&report, &certificate)?;
        certificate.conforms()
    } else {
        let model = arguments.model(&machine, &errors, compensation)?;
        arguments.write(&report, &model)?;
        true
    };
    Ok(match conforms && mismatch.is_none() {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

/// What is reported beside machine and errors.
struct Given {
    document: Document,
    identification: Option<Identification>,
    validation: Option<Validation>,
    old: Option<ReportFigures>,
    bytes: Option<AlignedBlob>,
    calibration: CalibrationRecord,
    zero_at: Option<Vec<f64>>,
}

impl Given {
    fn read(arguments: &Arguments, machine: &Machine) -> Result<Self, BadInput> {
        let validated = arguments.validated();
        let mut document = Document {
            date: Some(date::given_or_today(arguments.date.as_deref())?),
            reference_position: arguments.zero_at.clone(),
            tolerance_um: arguments.tolerance,
            seed: arguments.random.seed,
            ..Document::of(machine)
        };
        for (role, path) in [
            ("machine", Some(&arguments.files.machine)),
            ("errors", Some(&arguments.files.errors)),
            ("compensation", arguments.blob.as_ref()),
            ("identification", arguments.identification.as_ref()),
            ("validation", validated.as_ref()),
            ("calibration", arguments.calibration.as_ref()),
        ] {
            if let Some(path) = path {
                document.files.push(files::described(role, path)?);
            }
        }
        let calibration = arguments.calibration.as_deref().map(|path| {
            let text = Text::read(path)?;
            CalibrationRecord::from_toml(&text.text, machine).map_err(|error| text.bad(error))
        });
        let bytes = arguments.blob.as_deref().map(files::read_blob);
        Ok(Self {
            identification: (arguments.identification.as_deref())
                .map(|path| read_json(path, "what `trueaxis identify --json` prints"))
                .transpose()?,
            validation: (validated.as_deref())
                .map(|path| read_json(path, "a validation.json of `trueaxis linuxcnc calibrate`"))
                .transpose()?,
            old: arguments.compare.as_deref().map(read_old).transpose()?,
            bytes: bytes.transpose()?,
            calibration: calibration.transpose()?.unwrap_or_default(),
            zero_at: position_argument::zero_position(arguments.zero_at.as_deref(), machine)?,
            document,
        })
    }
}

/// Writes the page of a report.
pub fn write_page(path: &Path, report: &ReportFigures, model: &PageModel) -> Result<(), BadInput> {
    output::write(path, made(report::page(report, model))?.as_bytes())
}

/// A page, or why it cannot be made.
fn made(page: Result<String, impl std::fmt::Display>) -> Result<String, BadInput> {
    page.map_err(|error| {
        BadInput::new(
            format!("the page cannot be made: {error}"),
            "this is a mistake of trueaxis: please report it; --json writes the figures",
        )
    })
}

fn load<'a>(bytes: &'a AlignedBlob, path: &Path) -> Result<Runtime<'a>, BadInput> {
    Runtime::load(bytes).map_err(|error| BadInput::in_blob(error, path))
}

/// Reads the JSON output of another run.
fn read_json<T: DeserializeOwned>(path: &Path, what: &str) -> Result<T, BadInput> {
    let text = Text::read(path)?;
    serde_json::from_str(&text.text).map_err(|error| {
        BadInput::new(
            format!("{}: this is not {what}: {error}", text.name),
            format!("give the file in which you have kept {what}"),
        )
    })
}

/// Reads an older report.
fn read_old(path: &Path) -> Result<ReportFigures, BadInput> {
    let old: ReportFigures = read_json(path, "what `trueaxis report --json` prints")?;
    if old.format != report::FORMAT {
        return Err(BadInput::new(
            format!(
                "{}: this report has the format {}, this version writes {}",
                path.display(),
                old.format,
                report::FORMAT
            ),
            "make the older report once more from its files, with this version",
        ));
    }
    Ok(old)
}

impl Arguments {
    /// Refuses an output that cannot be written, or that is an input.
    fn prepare(&self) -> Result<(), BadInput> {
        let validated = self.validated();
        let others = [
            &self.blob,
            &self.identification,
            &self.compare,
            &self.calibration,
            &validated,
        ];
        let mut inputs: Vec<&Path> = vec![&self.files.machine, &self.files.errors];
        inputs.extend(others.into_iter().filter_map(|path| path.as_deref()));
        match &self.output {
            Some(output) => output::prepare(output, &inputs),
            None => Ok(()),
        }
    }

    /// All figures, with the remarks about what was left out.
    fn figures(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        compensation: Option<ReportedCompensation<'_>>,
        given: &mut Given,
        mismatch: &Option<compile::Mismatch>,
    ) -> Result<ReportFigures, BadInput> {
        let policy = policy(compensation);
        let document = Document {
            policy: policy.to_string(),
            tolerance_urad: tolerance_urad(of_blob(policy), self.tolerance),
            ..given.document.clone()
        };
        let identification = given.identification.take();
        let mut report = report::report(machine, errors, compensation, identification, document)
            .map_err(|error| bad(&error))?;
        report.validation = given.validation.take();
        if let (Some(path), None) = (&self.identification, &report.identification)
            && self.calibration_report
        {
            let mut remarks = report.remarks.iter();
            let why = remarks.find(|remark| remark.starts_with(report::LEFT_OUT));
            let why = why.map_or(report::LEFT_OUT, String::as_str);
            return Err(BadInput::new(
                format!("{}: {}", path.display(), why.trim_end_matches('.')),
                "give the output of `trueaxis identify --json` that belongs to these errors, or no identification",
            ));
        }
        if let Some(mismatch) = mismatch {
            let remark = format!(
                "The compensation is left out: {mismatch}. The report shows the machine without it."
            );
            eprintln!("warning: {remark}");
            report.remarks.insert(0, remark);
        }
        if let Some(old) = &given.old {
            compare(&mut report, old);
        }
        Ok(report)
    }

    /// Writes and prints the calibration report.
    fn certify(&self, report: &ReportFigures, certificate: &Certificate) -> Result<(), BadInput> {
        if let Some(output) = &self.output {
            let page = report::certificate_page(report, certificate);
            output::write(output, made(page)?.as_bytes())?;
        }
        match self.json {
            true => output::print_json(certificate),
            false => output::print(&certified(report, certificate, self.output.as_deref())),
        }
    }

    /// Writes the page and the pictures, and prints the verdict.
    fn write(&self, report: &ReportFigures, model: &PageModel) -> Result<(), BadInput> {
        if let Some(output) = &self.output {
            write_page(output, report, model)?;
        }
        if let Some(folder) = &self.pictures {
            output::write_pictures(folder, report::pictures(report))?;
        }
        match self.json {
            true => output::print_json(report),
            false => output::print(&said(report, self.output.as_deref())),
        }
    }

    /// The validation that was given, or that is beside both files of a calibration.
    fn validated(&self) -> Option<PathBuf> {
        let beside = |path: &Path| path.with_file_name("validation.json");
        let found = || {
            let found = beside(self.blob.as_ref()?);
            (found == beside(&self.files.errors) && found.is_file()).then_some(found)
        };
        self.validation.clone().or_else(found)
    }

    /// Compares the tables with the exact model, and computes the error that uncertain parameters leave.
    fn verified(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        runtime: &Runtime<'_>,
        zero_at: &Option<Vec<f64>>,
    ) -> Result<VerifyOutcome, BadInput> {
        let request = VerifyRequest {
            tolerance_um: self.tolerance,
            zero_at: zero_at.clone(),
            held: Vec::new(),
            random: self.random.random as usize,
            seed: self.random.seed,
        };
        let bar = ProgressBarOnScreen::new();
        let verified = compile::verify(machine, errors, runtime, &request, &bar);
        verified.map_err(|error| error_source::compile(error, &self.files, machine, errors))
    }

    /// What the page draws.
    fn model(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        compensation: Option<ReportedCompensation<'_>>,
    ) -> Result<PageModel, BadInput> {
        let zero_at = compensation.and_then(|compensation| compensation.zero_at);
        let subtracted = schemes::Options {
            policy: of_blob(policy(compensation)),
            zero_at: zero_at.map(<[f64]>::to_vec),
            ..schemes::Options::default()
        };
        let zero = subtracted.zero(machine, errors);
        let zero = zero
            .map_err(|error| error_source::compile(error.into(), &self.files, machine, errors))?;
        let runtime = compensation.map(|compensation| compensation.runtime);
        Ok(PageModel::relative_to(machine, errors, runtime, &zero))
    }
}

/// The policy of a compensation, or the usual one.
fn policy(compensation: Option<ReportedCompensation<'_>>) -> trueaxis::Policy {
    match compensation {
        Some(compensation) => compensation.runtime.compensation().policy(),
        None => stored(Default::default()),
    }
}

/// Describes why there is no report.
pub fn bad(error: &ReportError) -> BadInput {
    BadInput::new(error.to_string(), error.remedy())
}

/// The text output of a calibration report.
fn certified(report: &ReportFigures, certificate: &Certificate, output: Option<&Path>) -> String {
    let mut text = String::new();
    if let Some(output) = output {
        text += &format!("{}: {}\n", output.display(), report.document.machine);
    }
    text += &certificate.conformity;
    for sentence in &certificate.missing {
        text += &format!("\n  {sentence}");
    }
    text + "\n"
}

/// The text output.
fn said(report: &ReportFigures, output: Option<&Path>) -> String {
    let mut text = String::new();
    if let Some(output) = output {
        text += &format!("{}: {}\n", output.display(), report.document.machine);
    }
    for sentence in &report.verdict {
        text += sentence;
        text.push('\n');
    }
    text
}

/// Compares a report with an older one, if that is of the same machine.
fn compare(report: &mut ReportFigures, old: &ReportFigures) {
    let name = &old.document.machine;
    match *name == report.document.machine {
        true => report.changes = Some(report::changes(old, report)),
        false => report.remarks.push(format!(
            "The older report is of the machine `{name}`: it is not compared."
        )),
    }
}
