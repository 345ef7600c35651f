//! `trueaxis identify`

mod answer;
mod compensability;
mod inputs;
mod kept;
mod listed;
mod observed;
mod screen;
mod thermal;

use super::Outcome;
use super::bad_input::BadInput;
use super::date;
use super::files;
use super::verdict;
use clap::Args;
use inputs::{Inputs, Same};
use kept::WithTables;
use std::path::{Path, PathBuf};
use trueaxis_measure::direct::{DirectResult, Measurement};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::{
    Compensated, HeldOut, Honesty, Identified, IdentifyError, Lacking, Level, Model, ModelError,
    NotKnown, Options, Problem, Published, Stated, Suspicion, Warmed, automatic, compensability,
    contradicted, drifting, error_file, held_out, honesty, identify, lacking, lacks, misplaced,
    published, snoop, stated, unseen_senses, without,
};
use trueaxis_measure::plan::{Remedy, would_show};
use trueaxis_model::errors::covariance;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_report::{self as report, Document, Identification, Model as ReportModel};
use trueaxis_tables::compile::belongs;
use trueaxis_tables::validate::{Command, Runtime};

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
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let inputs = [
        Some(&arguments.machine),
        arguments.artefact.as_ref(),
        arguments.probe.as_ref(),
        arguments.update.as_ref(),
        arguments.active.as_ref(),
        arguments.before.as_ref(),
        arguments.temperatures.as_ref(),
    ];
    let inputs = inputs.into_iter().flatten();
    let inputs: Vec<&Path> = inputs
        .chain(arguments.measured())
        .map(PathBuf::as_path)
        .collect();
    let covariances = arguments.output.as_deref().map(beside);
    let outputs = arguments.output.iter().chain(&covariances);
    for output in outputs.chain(&arguments.report) {
        files::prepare(output, &inputs)?;
    }
    let machine = files::read_machine(&arguments.machine)?;
    let mut artefact = match &arguments.artefact {
        Some(path) => files::read_artefact(path, &machine)?,
        None => Artefact::default(),
    };
    if let Some(path) = &arguments.probe {
        files::read_probe(path, &machine)?.known(&mut artefact.stylus);
    }
    let Inputs {
        probings: mut measured,
        mut observations,
        runs,
    } = Inputs::read(arguments, &machine, &artefact)?;
    for rows in &arguments.without {
        let probed = without(&machine, &measured, rows);
        let observed = observations.without(&machine, rows);
        let is_nothing = observed.is_none();
        observations = observed.unwrap_or(observations);
        measured = match probed {
            Ok(left) => left,
            Err(_) if !is_nothing => measured,
            Err(reason) => {
                return Err(BadInput::new(
                    format!("--without: {reason}"),
                    "name rows as \"line 17\", \"ball 3\", \"C = 90\", \"S = 180\", \"setup bar\" or \"bar.csv line 12\"",
                ));
            }
        };
    }
    let known_before = match &arguments.update {
        Some(path) => files::to_update(files::read_errors(path, &machine)?, path, "identify")?,
        None => ErrorModel::perfect(&machine),
    };
    let before = match &arguments.before {
        Some(path) => Some(comparable(path, &machine)?),
        None => None,
    };
    if let Some(path) = &arguments.active {
        undo(&mut measured, path, &machine, &known_before)?;
    }
    let model: Model = arguments.model.parse().map_err(no_model)?;
    let options = Options {
        robust: arguments.robust,
        ..Options::default()
    };
    let find = |base: &ErrorModel, observations: &mut Observations| {
        let problem = |parameters: &[Parameter], observations: &Observations| {
            Problem::new(&machine, &measured, &artefact, parameters, base).with(observations)
        };
        if model != Model::Auto {
            let parameters = model.parameters(&machine, 0, &[]).map_err(no_model)?;
            kept::are_apart(&machine, &model, &parameters, base)?;
            let find = |observations: &Observations| {
                identify(&problem(&parameters, observations), options)
                    .map_err(|e| arguments.not_identified(&e))
            };
            let identified = find(observations)?;
            let steady = problem(&parameters, observations);
            observations.drift = drifting(&steady, &identified);
            let identified = match observations.drift.is_empty() {
                true => identified,
                false => find(observations)?,
            };
            return Ok((identified, None));
        }
        let chosen = automatic(&machine, &measured, &artefact, observations, base, options);
        let chosen = chosen.map_err(|error| arguments.not_identified(&error))?;
        observations.drift.clone_from(&chosen.drift);
        Ok((chosen.identified.clone(), Some(chosen)))
    };
    let with_tables = kept::with_tables(&machine, &runs, &known_before, |base| {
        observations.drift.clear();
        find(base, &mut observations)
    })?;
    let WithTables {
        base,
        identified,
        besides: chosen,
        kept,
    } = with_tables;
    let (identified, warmed) = match &arguments.temperatures {
        None => (identified, None),
        Some(path) => {
            let looked_for = identified.looked_for;
            let problem = || Problem::new(&machine, &measured, &artefact, &looked_for, &base);
            let find = |observations: &Observations| {
                let problem = problem().with(observations);
                identify(&problem, options).map_err(|e| arguments.not_identified(&e))
            };
            // What moves with temperature is not taken for drift with time.
            observations.drift.clear();
            let cold = find(&observations)?;
            let candidates =
                thermal::candidates(arguments.thermal.as_deref(), &machine, &looked_for)?;
            let steady = problem().with(&observations);
            let warmed = thermal::warmed(&steady, &cold, path, &candidates)?;
            if warmed.model.terms.is_empty() {
                (cold, Some(warmed))
            } else {
                observations.thermal = Some(warmed.model.clone());
                (find(&observations)?, Some(warmed))
            }
        }
    };
    let looked_for = &identified.looked_for;
    let problem = Problem::new(&machine, &measured, &artefact, looked_for, &base);
    let problem = problem.with(&observations);
    let places = stated(&problem, &identified);
    if !arguments.accept_places
        && let Some(mistake) = misplaced(&problem, &places)
    {
        let reason = format!("{}: {}", arguments.names(), mistake.what);
        return Err(BadInput::new(reason, mistake.remedy));
    }
    let suspicions = snoop(&problem, &identified);
    let suspicions: Vec<(Suspicion, String)> = (suspicions.into_iter())
        .map(|suspicion| {
            let sentence = suspicion.sentence(&problem);
            (suspicion, sentence)
        })
        .collect();
    let compared = before.map(|before| compensability(&problem, &identified, &before));
    if let (Some(compared), Some(path)) = (&compared, &arguments.before)
        && compared.parameters.is_empty()
    {
        return Err(BadInput::new(
            format!("{}: none of its parameters is looked for", path.display()),
            "give --before what identify wrote with the same --model before the compensation was on",
        ));
    }
    let honesty = honesty(&problem, &measured, &identified);
    let lacking = lacking(&problem, &identified);
    let seen: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
    let held_out = held_out(
        &machine,
        &measured,
        &artefact,
        &observations,
        &seen,
        &base,
        options,
    );
    let found = Found {
        machine: &machine,
        measured: &measured,
        observations: &observations,
        identified: &identified,
        warmed,
        levels: chosen.as_ref().map_or(&[], |chosen| &chosen.levels),
        published: chosen
            .as_ref()
            .and_then(|chosen| published(&machine, chosen)),
        compared,
        not_known: NotKnown::of(&problem, &identified, &honesty, held_out.as_ref().ok())
            .map_err(|e| arguments.not_identified(&e))?,
        honesty,
        held_out,
        remedies: would_show(
            &machine,
            &measured,
            &artefact,
            &observations,
            &base,
            &identified,
        ),
        places,
        suspicions,
        kept: kept.as_ref().map(|kept| (&runs[..], kept)),
        lacking,
        missing: problem
            .missing()
            .map_err(|e| arguments.not_identified(&e))?,
        unseen_senses: unseen_senses(&problem),
    };
    let name = covariances
        .as_deref()
        .unwrap_or(Path::new("covariance.csv"));
    let name = name.file_name().unwrap_or_default().to_string_lossy();
    let errors = error_file(
        &machine,
        &measured,
        &observations,
        &identified,
        &found.not_known,
        &name,
    );
    let covariance = covariance::write(&identified.known);
    if let (Some(output), Some(covariances)) = (&arguments.output, &covariances) {
        // If the second file cannot be written, the first one is rejected next to the older covariances.
        files::write(covariances, covariance.as_bytes())?;
        files::write(output, errors.as_bytes())?;
    }
    let read = |_: &str| Ok(covariance.clone());
    let model = ErrorModel::with_files(&errors, &machine, &read);
    let model = model.map_err(|error| BadInput::new(error.message, error.remedy))?;
    if let Some(page) = &arguments.report {
        arguments.report(page, &found, &model)?;
    }
    if arguments.json {
        files::print_json(&answer::Answer::new(&found))?;
    } else {
        let told = report::verdict(&machine, &model, None, SEED);
        let told = told.map_err(|error| super::report::bad(&error))?;
        files::print(&(screen::screen(&found) + &verdict::lines(&told)))?;
    }
    for warning in found.warnings(&artefact) {
        eprintln!("warning: {warning}");
    }
    if found.is_doubtful() {
        return Ok(Outcome::CheckFailed);
    }
    Ok(Outcome::Done)
}

/// All results.
struct Found<'a> {
    machine: &'a Machine,
    measured: &'a Probings,
    observations: &'a Observations,
    identified: &'a Identified,
    /// What temperatures explain.
    warmed: Option<Warmed>,
    levels: &'a [Level],
    /// Comparison of the chosen model with the published one.
    published: Option<Published>,
    /// Comparison with the errors before the compensation that was on.
    compared: Option<Compensated>,
    honesty: Honesty,
    held_out: Result<HeldOut, IdentifyError>,
    /// Measurements that would identify the missing parameters.
    remedies: Vec<Remedy>,
    /// Balls and stylus, found and as stated.
    places: Vec<Stated>,
    /// Rows that do not fit the others, with a sentence about each.
    suspicions: Vec<(Suspicion, String)>,
    /// Location errors that the model cannot compensate for.
    missing: Vec<Parameter>,
    /// What the measurements do not show.
    not_known: NotKnown,
    /// Runs, and the motions that are kept as tables.
    kept: Option<(&'a [Measurement], &'a DirectResult)>,
    /// The motion that the model lacks, if one explains the residuals.
    lacking: Option<Lacking>,
    /// Axes that may count the other way for all that the probings show.
    unseen_senses: Option<String>,
}

/// A result is doubtful if a larger part of the rows is suspicious.
const SUSPECTED: f64 = 0.1;

impl Found<'_> {
    /// True if a row of the file is suspicious.
    fn is_suspected(&self, row: usize) -> bool {
        let mut suspicions = self.suspicions.iter();
        suspicions.any(|(suspicion, _)| suspicion.rows.contains(&row))
    }

    /// True if the parameters should not be trusted: too many rows, or a whole group, do not fit the others.
    fn is_doubtful(&self) -> bool {
        let is_group = self
            .suspicions
            .iter()
            .any(|(suspicion, _)| suspicion.is_group());
        let rows = self.identified.rows.iter().chain(&self.identified.observed);
        let most = SUSPECTED * rows.clone().count() as f64;
        let untrusted = rows.filter(|row| !row.is_trusted);
        let is_contradicted = !contradicted(self.identified).is_empty();
        is_contradicted
            || is_group
            || untrusted.count() as f64 > most
            || self.suspicions.len() as f64 > most
    }

    /// True if a motion that the model lacks is why rows fit badly.
    fn is_explained(&self) -> bool {
        self.lacking.as_ref().is_some_and(|one| one.explains > MOST)
    }

    /// A sentence about a motion that the model lacks.
    fn bends(&self, one: &Lacking) -> String {
        let seen = self.identified.parameters.iter().map(|e| e.parameter);
        let all: Vec<Parameter> = seen.chain(one.parameters.iter().copied()).collect();
        let add: Vec<String> = one.parameters.iter().map(Parameter::to_string).collect();
        let add = add.join(",");
        let how = match all.len() <= NAMES {
            true => format!("give --model {}", Model::Named(all)),
            false => format!("add {add} to the model"),
        };
        format!(
            "the model lacks a motion: {one}, which explains {:.0} % of what is left (squares); {how}, or measure it directly with runs",
            one.explains * 1e2
        )
    }

    /// What to check before trusting the parameters.
    fn warnings(&self, artefact: &Artefact) -> Vec<String> {
        let mut warnings: Vec<String> = (self.suspicions.iter())
            .map(|(_, sentence)| sentence.clone())
            .collect();
        warnings.extend(kept::warnings(self));
        warnings.extend(self.lacking.as_ref().map(|one| self.bends(one)));
        if !self.missing.is_empty() {
            let looked_for = &self.identified.looked_for;
            warnings.push(lacks(self.machine, looked_for, &self.missing));
        }
        let rows = &self.measured.rows;
        let untrusted: Vec<String> = (rows.iter().zip(&self.identified.rows).enumerate())
            .filter(|(number, (_, found))| !found.is_trusted && !self.is_suspected(*number))
            .map(|(_, (row, _))| row.line.to_string())
            .collect();
        if !untrusted.is_empty() && !self.is_explained() {
            warnings.push(format!(
                "{} of {} rows fit badly (lines {}): look at their readings, leave them out (--without), or let them count less (--robust)",
                untrusted.len(),
                rows.len(),
                untrusted.join(", ")
            ));
        }
        warnings.extend(observed::warnings(self));
        let stylus = self.places.iter().find(|one| one.what == "stylus");
        if let Some(apart) = stylus.and_then(Stated::distance)
            && apart > AS_STATED
            && !self.not_known.hidden.is_empty()
        {
            let hidden = Model::Named(self.not_known.hidden.clone());
            warnings.push(format!(
                "the stylus was found {:.1} µm from its stated place: these probings cannot tell that from {hidden}, errors of the machine that stay when another tool is used; qualify the probe and give --probe, or state the place of the stylus with its uncertainty in the artefact",
                apart * 1e3
            ));
        }
        for (ball, name) in self.measured.balls.iter().enumerate() {
            let mut lines = rows
                .iter()
                .filter(|row| row.ball == ball)
                .map(|row| row.line);
            if let (Some(line), None) = (lines.next(), lines.next()) {
                warnings.push(format!(
                    "line {line}: ball {name} was probed only once, which shows only where it is: probe it at other rotary positions too; if it is a different ball, correct the name"
                ));
            }
        }
        let is_probed = |name: &String| self.measured.balls.contains(name);
        for bar in &artefact.bars {
            for ball in bar.balls.iter().filter(|ball| !is_probed(ball)) {
                warnings.push(format!(
                    "the bar from {} to {} does not count: ball {ball} was not probed under this name",
                    bar.balls[0], bar.balls[1]
                ));
            }
        }
        for bar in self.identified.bars.iter().filter(|bar| bar.is_doubtful()) {
            let others = bar.others.map_or(0.0, |others| others.length);
            warnings.push(format!(
                "the bar from {} to {} is {:.4} mm in the artefact, but the machine and the other bars make it {others:.4} mm: look which is wrong, and leave it out",
                bar.balls[0], bar.balls[1], bar.length
            ));
        }
        warnings.extend(
            self.honesty
                .checks
                .iter()
                .filter_map(|check| check.warning()),
        );
        if let Some(repeats) = self.honesty.repeats.filter(|repeats| repeats.is_less) {
            warnings.push(format!(
                "the residuals are {:.1} times the repeatability: the machine does something that the model lacks; try --model auto, or a model with more parameters",
                repeats.ratio
            ));
        }
        warnings
    }
}

/// A motion explains rows that fit badly if this part of the squared residuals goes with it.
const MOST: f64 = 0.3;
/// Do not print more names than fit on a command line.
const NAMES: usize = 40;

/// A stylus found farther than this (mm) from its stated place may show an error of the machine: it is measured, in the
/// spindle or on a presetter, to a few micrometres.
const AS_STATED: f64 = 5e-3;

/// The covariance file that belongs to an error file.
fn beside(errors: &Path) -> PathBuf {
    errors.with_extension("covariance.csv")
}

/// Reads errors to compare with; refuses more than parameters.
fn comparable(path: &Path, machine: &Machine) -> Result<ErrorModel, BadInput> {
    let errors = files::read_errors(path, machine)?;
    let mut motions = errors.motions.iter().flatten();
    if motions.any(|m| m.table.is_some() || !m.thermal.is_empty())
        || !errors.inter_thermal.is_empty()
    {
        return Err(BadInput::new(
            format!(
                "{}: tables and thermal changes cannot be compared by --before",
                path.display()
            ),
            "identify without --before, and look at the parameters side by side",
        ));
    }
    Ok(errors)
}

pub fn no_model(error: ModelError) -> BadInput {
    BadInput::new(format!("--model: {}", error.reason), error.remedy)
}

/// Seed of the positions at which the machine is evaluated, as in other commands.
const SEED: u64 = 1;

impl Arguments {
    /// Writes the page: the machine with its errors, and how they were found.
    fn report(&self, page: &Path, found: &Found<'_>, errors: &ErrorModel) -> Result<(), BadInput> {
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
        let answer = serde_json::to_value(answer::Answer::new(found));
        let identification = answer.and_then(serde_json::from_value::<Identification>);
        let identification = identification.map_err(|error| {
            BadInput::new(
                format!("what was found cannot be shown: {error}"),
                "leave out --report",
            )
        })?;
        let shown = report::report(machine, errors, None, Some(identification), document);
        let shown = shown.map_err(|error| super::report::bad(&error))?;
        let model = ReportModel::new(machine, errors, None);
        super::report::write_page(page, &shown, &model)
    }

    fn not_identified(&self, error: &IdentifyError) -> BadInput {
        BadInput::new(format!("{}: {error}", self.names()), error.remedy())
    }

    /// The files of measurements.
    fn measured(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().chain(&self.observations)
    }

    /// The same, for messages.
    fn names(&self) -> String {
        let all: Vec<String> = self.measured().map(|p| p.display().to_string()).collect();
        all.join(", ")
    }
}

/// Adds the compensation's corrections to the axis positions.
fn undo(
    measured: &mut Probings,
    path: &Path,
    machine: &Machine,
    base: &ErrorModel,
) -> Result<(), BadInput> {
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    belongs(machine, base, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
    for row in &mut measured.rows {
        let command = Command::coming(machine, &row.position, &row.direction);
        for (position, correction) in row.position.iter_mut().zip(runtime.evaluate(&command)) {
            *position += f64::from(correction);
        }
    }
    Ok(())
}
