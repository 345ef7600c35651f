//! `trueaxis identify`

mod compensability;
mod inputs;
mod listed;
mod observed;
mod screen;
mod thermal;

use super::Outcome;
use super::bad_input::BadInput;
use super::date;
use super::files::{self, Text};
use super::output;
use super::verdict;
use clap::Args;
use inputs::{MeasuredInputs, Same};
use std::path::{Path, PathBuf};
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::temperatures::{self, Temperatures};
use trueaxis_identify::{Model, ModelError};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_report::{self as report, Document, PageModel as ReportModel};
use trueaxis_study::{
    Identification, RefusedInput, Study, StudyOutcome, StudyRefusal, StudyRequest,
};
use trueaxis_tables::compile::belongs;

/// Identify error parameters and their uncertainties from probings of balls and from instruments
///
/// Takes files of every kind: probings of balls, runs of a laser or straightedge, ball-bars, other readings. Each is
/// recognised by its header. Parameters, balls, stylus and the set-ups of instruments are found together. The error motions
/// that runs show are kept as tables. A parameter that nothing shows gets no value; a sentence says why. The resulting
/// error file can be passed to `trueaxis compile` as it is.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis identify machine.toml probings.csv --model 12 -o errors.toml\n  \
trueaxis identify machine.toml after.csv --model 12 --before errors.toml\n  \
trueaxis identify machine.toml x.csv y.csv z.csv circle-xy.csv circle-yz.csv circle-zx.csv -o errors.toml\n  \
trueaxis identify machine.toml probings.csv bar.csv -o errors.toml\n  \
trueaxis identify machine.toml drift.csv --temperatures log.csv -o errors.toml\n\n\
Probings: a header, then one probing per line, mm and degrees. Besides ball and axes, columns may be S (spindle\n\
angle), run, time_s, sigma_um (standard uncertainty of a coordinate), temperature_C, and A_dir … (1 or -1:\n\
direction from which an axis arrived):\n  ball,X,Y,Z,A,C\n  1,70.012,20.004,111.497,0,0\n\n\
Runs are the files of `measured`, ball-bars those of `ballbar`. Other observations: lengths, points, displacements and\n\
angles, with the uncertainty of each:\n  kind,setup,X,Y,Z,A,C,length_mm,sigma_um\n  length,bar,120,0,-50,0,0,150.0021,0.5\n\n\
Models: 10, 12 and 13 (locations, scales, backlash, spindle; X, Y, Z and two rotary axes), 81 and\n\
84 (the coefficients published for two machines), auto (what the probings can identify), or names: EA0Z,EXX1,ECCb"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Probings, runs, ball-bars and other readings (CSV)
    #[arg(value_name = "FILE.csv", required_unless_present = "observations")]
    files: Vec<PathBuf>,
    /// Readings of instruments (CSV), of which runs are fitted by parameters of the model instead of being kept as tables
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    observations: Vec<PathBuf>,
    /// What stayed where it was between several files of probings: the stylus alone, or the balls as well
    #[arg(long, value_enum, value_name = "WHAT")]
    same: Option<Same>,
    /// Temperatures over time (CSV: time_s, NAME_C …, or the file of measurements if it has these columns): find which of
    /// them parameters change with, and with which lags
    #[arg(long, value_name = "LOG.csv")]
    temperatures: Option<PathBuf>,
    /// Parameters that may change with temperature (default: all that are looked for)
    #[arg(long, value_name = "NAMES", requires = "temperatures")]
    thermal: Option<String>,
    /// Parameters to identify
    #[arg(long, default_value = "auto", value_name = "10|12|13|81|84|auto|NAMES")]
    model: String,
    /// What is known about balls, bars and stylus (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: Option<PathBuf>,
    /// The probe, qualified: where its tip is, with uncertainties (probe.toml)
    #[arg(long, value_name = "PROBE.toml")]
    probe: Option<PathBuf>,
    /// Where to write the parameters (errors.toml); their covariances go to ERRORS.covariance.csv beside it
    #[arg(short, long, value_name = "ERRORS.toml")]
    output: Option<PathBuf>,
    /// Reduce the weight of rows that fit badly
    #[arg(long)]
    robust: bool,
    /// Leave out rows: "line 17", "ball 3", "C = 90", "S = 180", "setup bar", "bar.csv line 12" (repeatable)
    #[arg(long, value_name = "ROWS")]
    without: Vec<String>,
    /// Continue even if balls or stylus are more than 5 mm from their stated positions
    #[arg(long)]
    accept_places: bool,
    /// Keep the values in this error file for parameters that are not identified
    #[arg(long, value_name = "OLD.toml")]
    update: Option<PathBuf>,
    /// The compensation that was on while probing; its effect is undone
    #[arg(long, value_name = "FILE.trax")]
    active: Option<PathBuf>,
    /// Errors before the compensation that was on while probing: print how much of each it removes
    #[arg(long, value_name = "ERRORS.toml", conflicts_with = "active")]
    before: Option<PathBuf>,
    /// Also write a page with the errors and how they were found, as `trueaxis report` does
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Date to print on the page, in any format (default: today, or SOURCE_DATE_EPOCH)
    #[arg(long, value_name = "TEXT", requires = "report")]
    date: Option<String>,
    /// Print every figure: balls and stylus, residuals by ball and direction, all models that were tried
    #[arg(short, long)]
    verbose: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    arguments.prepare()?;
    let given = IdentifyInputs::read(arguments)?;
    let blob = arguments.active.as_ref().map(|path| files::read_blob(path));
    let blob = blob.transpose()?;
    let active = arguments.active.as_ref().zip(blob.as_ref());
    let active = active.map(|(path, blob)| given.active(blob, path));
    let active = active.transpose()?;
    let request = StudyRequest {
        active: active.as_ref(),
        ..arguments.request(&given)?
    };
    let found = given.study().identify(&request);
    let found = found.map_err(|refusal| arguments.refused(&refusal))?;
    let model = match &arguments.output {
        Some(output) => write(&found, output)?,
        None => errors(&found)?,
    };
    if let Some(page) = &arguments.report {
        arguments.report(page, &found, &model)?;
    }
    match arguments.json {
        true => output::print_json(&found)?,
        false => show(&found, &model, arguments.verbose)?,
    }
    Ok(warn(&found))
}

/// What the files say.
struct IdentifyInputs {
    machine: Machine,
    artefact: Artefact,
    inputs: MeasuredInputs,
    /// Errors that were known before.
    base: ErrorModel,
    before: Option<ErrorModel>,
    temperatures: Option<Temperatures>,
}

impl IdentifyInputs {
    fn read(arguments: &Arguments) -> Result<Self, BadInput> {
        let machine = files::read_machine(&arguments.machine)?;
        let mut artefact = match &arguments.artefact {
            Some(path) => files::read_artefact(path, &machine)?,
            None => Artefact::default(),
        };
        if let Some(path) = &arguments.probe {
            files::read_probe(path, &machine)?.known(&mut artefact.stylus);
        }
        let inputs = MeasuredInputs::read(arguments, &machine, &artefact)?;
        let base = match &arguments.update {
            Some(path) => files::to_update(files::read_errors(path, &machine)?, path, "identify")?,
            None => ErrorModel::perfect(&machine),
        };
        let before = arguments.before.as_deref();
        let before = before.map(|path| files::read_errors(path, &machine));
        let temperatures = arguments.temperatures.as_deref().map(|path| {
            let text = Text::read(path)?;
            temperatures::read(&text.text).map_err(|e| text.bad(e))
        });
        Ok(Self {
            before: before.transpose()?,
            temperatures: temperatures.transpose()?,
            machine,
            artefact,
            inputs,
            base,
        })
    }

    fn study(&self) -> Study<'_> {
        Study {
            machine: &self.machine,
            probings: &self.inputs.probings,
            artefact: &self.artefact,
            observations: &self.inputs.observations,
            runs: &self.inputs.runs,
            base: &self.base,
        }
    }

    /// The compensation that was on.
    fn active<'b>(&self, blob: &'b [u8], path: &Path) -> Result<Runtime<'b>, BadInput> {
        let runtime = Runtime::load(blob).map_err(|e| BadInput::in_blob(e, path))?;
        belongs(&self.machine, &self.base, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
        Ok(runtime)
    }
}

/// Writes the errors and their covariances.
pub fn write(found: &StudyOutcome<'_>, output: &Path) -> Result<ErrorModel, BadInput> {
    let model = errors(found)?;
    let covariances = beside(output);
    let name = covariances.file_name().unwrap_or_default();
    files::is_renewed(&covariances);
    let text = found.error_file(&name.to_string_lossy());
    let both = [
        (output.to_owned(), text),
        (covariances, found.covariances()),
    ];
    output::write_all(&both)?;
    Ok(model)
}

fn errors(found: &StudyOutcome<'_>) -> Result<ErrorModel, BadInput> {
    found
        .errors()
        .map_err(|error| BadInput::new(error.message, error.remedy))
}

/// Prints what people read.
pub fn show(
    found: &StudyOutcome<'_>,
    model: &ErrorModel,
    is_verbose: bool,
) -> Result<(), BadInput> {
    let told = report::verdict(found.machine, model, None, SEED);
    let told = told.map_err(|error| super::report::bad(&error))?;
    let verdict = match is_verbose {
        true => verdict::lines(&told),
        false => verdict::sentences(&told),
    };
    output::print(&(screen::screen(found, is_verbose) + &verdict))
}

/// Prints what to check; the check fails if the parameters should not be trusted.
pub fn warn(found: &StudyOutcome<'_>) -> Outcome {
    for warning in found.warnings() {
        eprintln!("warning: {warning}");
    }
    match found.is_doubtful() {
        true => Outcome::CheckFailed,
        false => Outcome::Done,
    }
}

/// The covariance file that belongs to an error file.
fn beside(errors: &Path) -> PathBuf {
    errors.with_extension("covariance.csv")
}

pub fn no_model(error: ModelError) -> BadInput {
    BadInput::new(format!("--model: {}", error.reason), error.remedy)
}

/// Seed of the positions at which the machine is evaluated, as in other commands.
const SEED: u64 = 1;

impl Arguments {
    /// Refuses outputs that cannot be written, or that are inputs.
    fn prepare(&self) -> Result<(), BadInput> {
        let inputs = [
            Some(&self.machine),
            self.artefact.as_ref(),
            self.probe.as_ref(),
            self.update.as_ref(),
            self.active.as_ref(),
            self.before.as_ref(),
            self.temperatures.as_ref(),
        ];
        let inputs = inputs.into_iter().flatten();
        let inputs: Vec<&Path> = inputs
            .chain(self.measured())
            .map(PathBuf::as_path)
            .collect();
        if self.output.as_deref().is_some_and(output::is_screen) {
            return Err(BadInput::new(
                "-o -: errors and their covariances are two files, and do not go to the screen",
                "give -o the name of a file",
            ));
        }
        let covariances = self.output.as_deref().map(beside);
        let outputs = self.output.iter().chain(&covariances);
        for output in outputs.chain(&self.report) {
            output::prepare(output, &inputs)?;
        }
        Ok(())
    }

    fn request<'a>(&self, given: &'a IdentifyInputs) -> Result<StudyRequest<'a>, BadInput> {
        let thermal = self.thermal.as_deref().map(str::parse).transpose();
        Ok(StudyRequest {
            robust: self.robust,
            without: self.without.clone(),
            accept_places: self.accept_places,
            active: None,
            temperatures: given.temperatures.as_ref(),
            thermal: thermal.map_err(|error| self.refused(&StudyRefusal::Thermal(error)))?,
            before: given.before.as_ref(),
            model: self.model.parse::<Model>().map_err(no_model)?,
        })
    }

    /// A refusal, with the option or the files that it is about.
    fn refused(&self, refusal: &StudyRefusal) -> BadInput {
        let path = |path: Option<&PathBuf>| path.map_or(String::new(), |p| p.display().to_string());
        let about = match refusal.about() {
            RefusedInput::Measurements => self.names(),
            RefusedInput::Model => "--model".to_owned(),
            RefusedInput::Thermal => "--thermal".to_owned(),
            RefusedInput::Temperatures => path(self.temperatures.as_ref()),
            RefusedInput::Without => "--without".to_owned(),
            RefusedInput::Before => path(self.before.as_ref()),
            RefusedInput::Runs => return BadInput::new(refusal.to_string(), refusal.remedy()),
        };
        BadInput::new(format!("{about}: {refusal}"), refusal.remedy())
    }

    /// Writes the page: the machine with its errors, and how they were found.
    fn report(
        &self,
        page: &Path,
        found: &StudyOutcome<'_>,
        errors: &ErrorModel,
    ) -> Result<(), BadInput> {
        let machine = found.machine;
        let inputs = [
            ("machine", Some(&self.machine)),
            ("errors", self.output.as_ref()),
            ("artefact", self.artefact.as_ref()),
            ("probe", self.probe.as_ref()),
            ("temperatures", self.temperatures.as_ref()),
        ];
        let observed = self.measured().map(|path| ("measurements", Some(path)));
        let inputs = inputs.into_iter().chain(observed);
        let mut document = Document {
            date: Some(date::given_or_today(self.date.as_deref())?),
            ..Document::of(machine)
        };
        for (role, path) in inputs {
            if let Some(path) = path {
                document.files.push(files::described(role, path)?);
            }
        }
        let identification = Some(Identification::of(found));
        let shown = report::report(machine, errors, None, identification, document);
        let shown = shown.map_err(|error| super::report::bad(&error))?;
        let model = ReportModel::new(machine, errors, None);
        super::report::write_page(page, &shown, &model)
    }

    /// The files of measurements.
    fn measured(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().chain(&self.observations)
    }

    /// The files of measurements, for messages.
    fn names(&self) -> String {
        let all: Vec<String> = self.measured().map(|p| p.display().to_string()).collect();
        all.join(", ")
    }
}
