//! A calibration: plan, probe, identify, compile, load, and verify it by probing again.
//!
//! The machine is moved by LinuxCNC or by its own controller; its corrections come from LinuxCNC's component or from a
//! board. [`Site`] is any of these.

mod site;

pub use site::{Corrects, Errand, Moves, Site};

use super::Outcome;
use super::Outcome::CheckFailed;
use super::bad_input::BadInput;
use super::compile;
use super::files::{self, MachineFiles, Text};
use super::identify::{self, no_model};
use super::number::positive;
use super::plan;
use super::probing::asked;
use super::probings::said;
use super::qualify;
use super::target;
use super::touch_options::TouchOptions;
use clap::{Args, ValueEnum};
use nalgebra::Vector3;
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use trueaxis_controllers::trial::{TrialSite, on_trial};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::{self, Probing, Probings};
use trueaxis_measure::formats::validation::{Gain, Scatter, Validation};
use trueaxis_measure::identify::{Model, Stated, scatters};
use trueaxis_measure::plan::{Criterion, PlannedRows, Probe, Setup, Task, validation};
use trueaxis_measure::qualify::ProbePriors;
use trueaxis_measure::spheres::{LogContents, read_log, to_probings};
use trueaxis_measure::study::{self, Study, StudyRequest};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_tables::uncertainty::{benefit, over_travel};
use trueaxis_tables::validate::DrawError;

/// What every calibration takes.
#[derive(Args)]
pub struct CalibrationOptions {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Positions of the balls (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: PathBuf,
    /// Parameters to identify (default: 12, with the scale of X if the artefact has a bar)
    #[arg(long, value_name = "10|12|13|81|84|auto|NAMES")]
    model: Option<String>,
    /// Number of probings (default: as many as `trueaxis plan` proposes)
    #[arg(long, value_name = "N")]
    probings: Option<usize>,
    /// Longest time for probing
    #[arg(long, value_name = "MIN", conflicts_with = "probings", value_parser = positive)]
    minutes: Option<f64>,
    /// Positions that rotary axes may take (default: their travel)
    #[arg(long, value_name = "A=FROM:TO:STEP,…")]
    indexings: Option<String>,
    /// Number of probings that validate the result, at other positions; they are probed twice
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(3..))]
    validate: u16,
    /// The probe, qualified (probe.toml)
    #[arg(long, value_name = "PROBE.toml")]
    probe: Option<PathBuf>,
    /// Qualify the probe first, on this ball at up to three of its rotary positions
    #[arg(long, value_name = "BALL", conflicts_with = "probe")]
    qualify: Option<String>,
    #[command(flatten)]
    pub touching: TouchOptions,
    /// Begin with this step, with the files of the steps before it in --folder
    #[arg(long, value_enum, default_value_t = CalibrationStep::Plan)]
    from: CalibrationStep,
    /// Go on although some errors of the machine are not measured, or no length is known to scale them: the printed limits
    /// do not include these errors
    #[arg(long)]
    accept_missing: bool,
    /// Accept balls and stylus where they are found, even if that is far from where they are stated
    #[arg(long)]
    accept_places: bool,
    /// Do everything without asking (otherwise it asks before homing, switching kinematics, probing, loading)
    #[arg(long)]
    pub yes: bool,
}

/// The steps, in order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum CalibrationStep {
    /// Choose what to probe
    Plan,
    /// Probe; a log that was stopped early is continued
    Probe,
    /// Identify the error parameters
    Identify,
    /// Turn them into a compensation
    Compile,
    /// Load it into LinuxCNC, and validate it
    Load,
}

/// Errors that the model lacks are larger over the travel than what is left of them where the parameters were fitted: by
/// up to this factor on simulated machines with straightness, backlash and run-out (`cargo xtask linuxcnc
/// calibrate-outside`).
const OVER_TRAVEL: f64 = 2.0;
/// Rotary positions at which the probe is qualified, at most, and their file.
const POSES: usize = 3;
const POSES_FILE: &str = "poses.csv";
/// Part of the coverage interval that what is measured may reach: the scatter of a root mean square of ten rows is a
/// quarter of it (2σ, 20 degrees of freedom).
const SCATTER: f64 = 1.3;

/// The parameters to identify: those of models 12 and 13 together, every location error and scale, the place of the
/// spindle and the backlash of rotary axes. Without a length standard, the scale of X cannot be told from that of the
/// balls' places.
fn model(given: Option<&str>, machine: &Machine, artefact: &Artefact) -> Result<String, BadInput> {
    if let Some(given) = given {
        return Ok(given.to_owned());
    }
    let mut names: Vec<String> = Vec::new();
    for model in [Model::Twelve, Model::Thirteen] {
        let parameters = model.parameters(machine, 0, &[]).map_err(no_model)?;
        let own = parameters.iter().map(ToString::to_string);
        let own = own.filter(|name| name != "EXX1" || !artefact.bars.is_empty());
        names.extend(own.filter(|name| !names.contains(name)).collect::<Vec<_>>());
    }
    Ok(names.join(","))
}

/// A stylus found farther (mm) than this from its stated place is another one, or bent: location errors that it takes up
/// are a few times 10 µm.
const OTHER_STYLUS: f64 = 0.25;

/// A calibration, with its files.
pub struct Calibration<'a> {
    options: &'a CalibrationOptions,
    machine: Machine,
    artefact: Artefact,
    /// What is identified, as an option.
    model: String,
    folder: PathBuf,
    /// What identification found, once it has.
    known: OnceCell<CalibrationBasis>,
}

/// What a calibration rests on, of the identification that it loads.
struct CalibrationBasis {
    stylus: Vector3<f64>,
    /// Of a coordinate (mm).
    noise: f64,
    /// Balls and stylus, found and as stated.
    places: Vec<Stated>,
    /// Location errors that the model lacks.
    missing: Vec<Parameter>,
}

impl CalibrationBasis {
    fn of(found: &study::StudyOutcome<'_>) -> Self {
        Self {
            stylus: found.identified.stylus,
            noise: found.identified.noise,
            places: found.places.clone(),
            missing: found.missing.clone(),
        }
    }
}

impl<'a> Calibration<'a> {
    /// In a folder, which is made.
    pub fn new(options: &'a CalibrationOptions, folder: PathBuf) -> Result<Self, BadInput> {
        // Before anything is asked of the machine.
        options.touching.stated()?;
        let machine = files::read_machine(&options.machine)?;
        let artefact = files::read_artefact(&options.artefact, &machine)?;
        if options.from == CalibrationStep::Plan && folder.join("plan.csv").exists() {
            return Err(BadInput::new(
                format!("{}: there is a calibration already", folder.display()),
                "give --from probe, identify, compile or load to continue it, or another --folder",
            ));
        }
        std::fs::create_dir_all(&folder).map_err(|error| {
            BadInput::new(
                format!("{}: cannot be made: {error}", folder.display()),
                "give --folder a name in a folder that you may write to",
            )
        })?;
        Ok(Self {
            model: model(options.model.as_deref(), &machine, &artefact)?,
            options,
            machine,
            artefact,
            folder,
            known: OnceCell::new(),
        })
    }

    /// Does what the steps say, at a site.
    pub fn run(&self, site: &mut Site<'_>) -> Result<Outcome, BadInput> {
        let from = self.options.from;
        files::print(&format!(
            "{}: calibration in {}\n",
            self.machine.name,
            self.folder.display()
        ))?;
        if from <= CalibrationStep::Plan {
            self.plan()?;
        } else {
            files::print(&format!(
                "begins with the files of the earlier steps; {} changes only if the new compensation is kept\n",
                site.place()
            ))?;
        }
        if from <= CalibrationStep::Probe && !self.probe(site)? {
            return Ok(CheckFailed);
        }
        if from <= CalibrationStep::Identify && self.identify()? == CheckFailed {
            return self.stop("the measurements do not fit together: see the warnings above");
        }
        if let Some(why) = self.is_unclear()? {
            return self.stop(&why);
        }
        if from <= CalibrationStep::Compile && self.compile(site)? == CheckFailed {
            return self.stop("the tolerance is not met: see above");
        }
        self.load(site)
    }

    /// Says that nothing has been changed.
    fn stop(&self, why: &str) -> Result<Outcome, BadInput> {
        files::print(&format!("nothing is loaded: {why}\n"))?;
        Ok(CheckFailed)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn text(&self, name: &str) -> String {
        self.file(name).display().to_string()
    }

    /// Shows the command that would do by itself what comes next.
    fn show(&self, words: &[String]) -> Result<(), BadInput> {
        let quoted = |word: &String| match word.contains(char::is_whitespace) {
            true => format!("'{word}'"),
            false => word.clone(),
        };
        let shown: Vec<String> = words.iter().map(quoted).collect();
        files::print(&format!("\n$ trueaxis {}\n", shown.join(" ")))
    }

    fn plan(&self) -> Result<(), BadInput> {
        let options = self.options;
        let path = |path: &Path| path.display().to_string();
        let mut words = vec!["plan".to_owned(), path(&options.machine)];
        let mut add = |name: &str, value: String| words.extend([name.to_owned(), value]);
        add("--artefact", path(&options.artefact));
        add("--model", self.model.clone());
        if let Some(probings) = options.probings {
            add("--probings", probings.to_string());
        }
        if let Some(minutes) = options.minutes {
            add("--minutes", minutes.to_string());
        }
        if let Some(indexings) = &options.indexings {
            add("--indexings", indexings.clone());
        }
        for (name, value) in options.touching.words() {
            add(name, value);
        }
        add("-o", self.text("plan.csv"));
        words.push("--keep-clear".to_owned());
        self.show(&words)?;
        let plan = self.planned()?;
        if let Some(ball) = &options.qualify {
            files::write(
                &self.file(POSES_FILE),
                probings::write_plan(&self.poses(&plan, ball)?, &self.machine).as_bytes(),
            )?;
        }
        let validation = validation(&self.setup()?, &plan, options.validate.into(), 1);
        if validation.rows.is_empty() {
            return Err(BadInput::new(
                "no ball can be probed at other positions to validate the result",
                "allow more: --indexings, --cone, more balls; a machine without rotary axes is calibrated by measuring scales and squareness (trueaxis measured)",
            ));
        }
        files::write(
            &self.file("validation.csv"),
            probings::write_plan(&validation, &self.machine).as_bytes(),
        )
    }

    /// The plan, proposed and written.
    fn planned(&self) -> Result<Probings, BadInput> {
        let (options, machine) = (self.options, &self.machine);
        let setup = Setup {
            balls: plan::known_balls(&self.artefact, &options.artefact)?,
            ..self.setup()?
        };
        let minutes = |rows: usize| rows as f64 * plan::SECONDS / 60.0;
        let fitting = options.minutes.map(|given| (given / minutes(1)) as usize);
        let task = Task {
            setup: &setup,
            model: &self.model.parse().map_err(no_model)?,
            degree: 1,
            assumed: &ErrorModel::perfect(machine),
            rows: PlannedRows::Best {
                indexings: options.indexings.as_deref(),
                probings: fitting.or(options.probings),
                criterion: Criterion::default(),
            },
        };
        let planned = task.plan().map_err(|error| plan::refused(&error))?;
        let plan = &planned.judgement.plan;
        let csv = probings::write_plan(plan, machine);
        files::write(&self.file("plan.csv"), csv.as_bytes())?;
        plan::show(&setup, &planned, minutes(plan.rows.len()))?;
        files::read_plan(&self.file("plan.csv"), machine)
    }

    /// Rows of a ball at rotary positions that are far from each other, on which the probe is qualified.
    fn poses(&self, plan: &Probings, ball: &str) -> Result<Probings, BadInput> {
        let is_rotary = |i: &usize| self.machine.axes[*i].letter.is_rotary();
        let apart = |a: &Probing, b: &Probing| {
            let rotary = (0..self.machine.axes.len()).filter(is_rotary);
            rotary
                .map(|i| (a.position[i] - b.position[i]).abs())
                .sum::<f64>()
        };
        let of = |row: &&Probing| plan.balls[row.ball] == ball && row.spindle == 0.0;
        let rows: Vec<&Probing> = plan.rows.iter().filter(of).collect();
        let mut chosen: Vec<&Probing> = rows.first().copied().into_iter().collect();
        while !chosen.is_empty() && chosen.len() < POSES.min(rows.len()) {
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
        if chosen.is_empty() {
            return Err(BadInput::new(
                format!("--qualify: the plan has no row of ball `{ball}` with the spindle at 0"),
                "name a ball of the artefact that can be probed",
            ));
        }
        Ok(Probings {
            balls: plan.balls.clone(),
            rows: chosen.into_iter().cloned().collect(),
        })
    }

    /// The file of the qualified probe, if there is one.
    fn qualified(&self) -> Option<PathBuf> {
        let own = self
            .options
            .qualify
            .as_ref()
            .map(|_| self.file("probe.toml"));
        self.options.probe.clone().or(own)
    }

    fn setup(&self) -> Result<Setup<'_>, BadInput> {
        Ok(Setup {
            machine: &self.machine,
            artefact: &self.artefact,
            balls: Vec::new(),
            probe: Probe {
                keeps_clear: true,
                ..self.options.touching.five().stated()?
            },
            sigma: 1e-3,
            observations: None,
        })
    }

    /// What is to be probed, into which log.
    fn errand(&self, plan: &str, log: &str) -> Result<Errand<'_>, BadInput> {
        let touching = &self.options.touching;
        Ok(Errand {
            machine: &self.machine,
            artefact: &self.artefact,
            plan: files::read_plan(&self.file(plan), &self.machine)?,
            touching: match plan == POSES_FILE {
                true => touching.qualifying(),
                false => touching.five(),
            },
            file: self.file(plan),
            log: self.file(log),
        })
    }

    /// Probes the rows that validate with the machine as it is found, and those that tell its errors without corrections;
    /// false if the operator does not want it.
    fn probe(&self, site: &mut Site<'_>) -> Result<bool, BadInput> {
        let before = self.errand("validation.csv", "before.csv")?;
        let plan = self.errand("plan.csv", "touches.csv")?;
        let qualifies = self.options.qualify.is_some();
        let ball = qualifies.then(|| self.errand(POSES_FILE, "ball.csv"));
        let ball = ball.transpose()?;
        let all: Vec<&Errand<'_>> = ball.iter().chain([&before, &plan]).collect();
        let yes = self.options.yes;
        if !site.is_ready(&all, yes)? {
            return Ok(false);
        }
        if let Some(ball) = &ball {
            site.touch(ball)?;
            self.qualify()?;
        }
        site.touch(&before)?;
        let question = "May the corrections be switched off, and the plan be probed without them?";
        if !yes && !asked(question)? {
            return Ok(false);
        }
        site.switch(false)?;
        site.touch(&plan)?;
        Ok(true)
    }

    fn qualify(&self) -> Result<(), BadInput> {
        let diameter = self.options.touching.ball_diameter().unwrap_or(0.0);
        let words = [
            "qualify",
            &self.options.machine.display().to_string(),
            &self.text("ball.csv"),
            "--ball-diameter",
            &diameter.to_string(),
            "-o",
            &self.text("probe.toml"),
        ];
        self.show(&words.map(str::to_owned))?;
        let known = ProbePriors {
            radius: diameter / 2.0,
            radius_uncertainty: 0.0,
            place: None,
            tip: self.machine.tip.into(),
            stylus: None,
            orders: qualify::ORDERS_OF_LOBES,
        };
        let (found, log) = qualify::qualified(&self.machine, &known, &self.file("ball.csv"))?;
        let output = self.file("probe.toml");
        files::write(&output, found.file.to_toml().as_bytes())?;
        qualify::show(&found, &log, &known, Some(&output))
    }

    fn identify(&self) -> Result<Outcome, BadInput> {
        let options = self.options;
        let machine = options.machine.display().to_string();
        let probe = self.qualified().map(|path| path.display().to_string());
        let probe: Vec<&str> = match &probe {
            Some(path) => vec!["--probe", path],
            None => Vec::new(),
        };
        let owned = |words: &[&str]| -> Vec<String> {
            words
                .iter()
                .chain(&probe)
                .map(|word| (*word).to_owned())
                .collect()
        };
        let words = [
            "probings",
            &machine,
            &self.text("touches.csv"),
            "--plan",
            &self.text("plan.csv"),
            "-o",
            &self.text("probings.csv"),
        ];
        self.show(&owned(&words))?;
        let found = self.touched("plan.csv", &self.file("touches.csv"))?;
        let output = self.file("probings.csv");
        let csv = probings::write(&found.probings, &self.machine);
        files::write(&output, csv.as_bytes())?;
        let said = said(&found, false);
        files::print(&format!("{}: {said}", output.display()))?;
        let words = [
            "identify",
            &machine,
            &self.text("probings.csv"),
            "--model",
            &self.model,
            "--artefact",
            &options.artefact.display().to_string(),
            "-o",
            &self.text("errors.toml"),
        ];
        let mut words = owned(&words);
        if options.accept_places {
            words.push("--accept-places".to_owned());
        }
        self.show(&words)?;
        self.identified(|found| {
            let errors = identify::write(found, &self.file("errors.toml"))?;
            identify::show(found, &errors, false)?;
            self.known.get_or_init(|| CalibrationBasis::of(found));
            Ok(identify::warn(found))
        })
    }

    /// Why what has been identified must not be loaded: another stylus, or errors that were not measured.
    fn is_unclear(&self) -> Result<Option<String>, BadInput> {
        let options = self.options;
        let errors = self.errors()?;
        let known = self.known()?;
        let stylus = known.places.iter().find(|one| one.what == "stylus");
        let off = stylus.and_then(Stated::distance).unwrap_or(0.0);
        if off > OTHER_STYLUS && !options.accept_places {
            let by = stylus.and_then(|one| Some(one.found - one.stated?));
            let by = by.unwrap_or_default();
            return Ok(Some(format!(
                "the stylus is {off:.3} mm (x {:.3}, y {:.3}, z {:.3}) from where machine file and artefact have it: measure it, and correct tip_mm; if it is right as found, say --accept-places",
                by.x, by.y, by.z
            )));
        }
        let missing = self.missing(&errors)?;
        if missing.is_empty() {
            return Ok(None);
        }
        let names = Model::Named(missing);
        files::print(&format!(
            "\nnot measured: {names}. A machine that has them is worse than any limit that is printed here\n"
        ))?;
        let question = "May it go on without them?";
        if options.accept_missing || !options.yes && asked(question)? {
            return Ok(None);
        }
        Ok(Some(format!(
            "{names} are not measured: qualify the probe (--qualify or --probe), give the artefact a bar, leave out --model, or say --accept-missing; backlash of linear axes needs an indicator"
        )))
    }

    /// Errors that the machine may have and that were not measured.
    fn missing(&self, errors: &ErrorModel) -> Result<Vec<Parameter>, BadInput> {
        let mut missing: Vec<Parameter> = errors.unseen.keys().copied().collect();
        let known = self.known()?.missing.iter().copied();
        let others: Vec<Parameter> = known.filter(|p| !missing.contains(p)).collect();
        missing.extend(others);
        Ok(missing)
    }

    fn compile(&self, site: &Site<'_>) -> Result<Outcome, BadInput> {
        let target = site.target(&self.file("board.toml"))?;
        let words = [
            "compile",
            &self.options.machine.display().to_string(),
            &self.text("errors.toml"),
            "--target",
            &target,
            "-o",
            &self.text("machine.trax"),
        ];
        self.show(&words.map(str::to_owned))?;
        let files = MachineFiles {
            machine: self.options.machine.clone(),
            errors: self.file("errors.toml"),
        };
        let blob = self.file("machine.trax");
        let compiled = compile::usual(&files, blob, target::read(&target)?)?;
        compiled.show()?;
        Ok(match compiled.made.is_right() {
            true => Outcome::Done,
            false => CheckFailed,
        })
    }

    /// Something over the travel with the identified errors.
    fn over_the_travel<T>(
        &self,
        misfits: f64,
        compute: impl FnOnce(&Kinematics<'_>) -> Result<T, DrawError>,
    ) -> Result<T, BadInput> {
        let mut errors = self.errors()?;
        errors.misfit = errors.misfit.map(|misfit| misfits * misfit);
        compute(&Kinematics::new(&self.machine, &errors)).map_err(|error| {
            BadInput::new(
                format!("{}: {error}", self.text("errors.toml")),
                "identify the errors again: --from identify",
            )
        })
    }

    /// Loads the compensation, probes with it, and keeps it if that is right.
    fn load(&self, site: &mut Site<'_>) -> Result<Outcome, BadInput> {
        let benefit = self.over_the_travel(OVER_TRAVEL, |kinematics| benefit(kinematics, SEED))?;
        if !benefit.is_sure() || self.band()? >= benefit.before_um {
            files::print(&format!(
                "\nover the travel the identified errors do {:.1} µm at the tip (rms), and about {:.1} µm would remain, \
                 because so much is not known of them\n",
                benefit.before_um, benefit.after_um
            ))?;
            return self.stop("the compensation might do more harm than good where nothing was probed: probe more rows, balls that are farther apart, or identify fewer parameters (--model)");
        }
        let blob = self.file("machine.trax");
        let question = format!("May {} be loaded and switched on?", blob.display());
        files::print("\n")?;
        if !self.options.yes && !asked(&question)? {
            return self.stop("you did not want it");
        }
        if let Some(active) = site.file().filter(|active| active.exists()) {
            self.keep_previous(active)?;
        }
        let is_kept = on_trial(site, &blob, |site| self.is_right(site))?;
        if is_kept {
            files::print(&format!("{} is in use, and switched on\n", site.place()))?;
            return Ok(Outcome::Done);
        }
        self.stop("the old compensation is back")
    }

    /// Keeps a copy of the compensation in use, beside those of earlier trials in this folder: the first is `previous.trax`.
    fn keep_previous(&self, active: &Path) -> Result<(), BadInput> {
        let bytes = files::read_bytes(active)?;
        let path = files::kept_at(&bytes, |number| match number {
            1 => self.file("previous.trax"),
            _ => self.file(&format!("previous-{number}.trax")),
        })?;
        if !path.exists() {
            files::write(&path, &bytes)?;
        }
        files::print(&format!(
            "{} is now as in {}: it returns unless the new compensation is kept\n",
            active.display(),
            path.display()
        ))
    }

    /// Probes with the compensation on; whether it is to be kept.
    fn is_right(&self, site: &mut Site<'_>) -> Result<bool, BadInput> {
        let yes = self.options.yes;
        let question = "May it be validated by probing with the corrections on?";
        if !yes && !asked(question)?
            || self.options.from > CalibrationStep::Probe && !site.take_over(yes)?
        {
            files::print("you did not want it probed\n")?;
            return Ok(false);
        }
        let errand = self.errand("validation.csv", "after.csv")?;
        let log = &errand.log;
        // An older one was made with another compensation, and would count as this one's.
        removed(log)?;
        site.touch(&errand)?;
        let (validation, gain) = self.validated(log)?;
        let json = files::json(&validation)?;
        files::write(&self.file("validation.json"), json.as_bytes())?;
        let Validation {
            before,
            after,
            expected_um,
            ref unseen,
            ..
        } = validation;
        let predicted = match unseen.is_empty() {
            true => "predicted, at most",
            false => "predicted from the measured errors",
        };
        files::print(&format!(
            "\nvalidation at {} other positions    rms (µm)   largest\n  \
             before                           {:>9.2} {:>9.2}\n  \
             after                            {:>9.2} {:>9.2}\n  \
             {predicted:<32} {:>9.2}\n",
            validation.probings,
            before.rms_um,
            before.largest_um,
            after.rms_um,
            after.largest_um,
            expected_um
        ))?;
        if !unseen.is_empty() {
            files::print(&format!(
                "not measured, and not in the prediction: {}; {} says what would show each\n",
                unseen.join(", "),
                self.text("errors.toml")
            ))?;
        }
        if !validation.is_kept {
            let sure = gain.is_some_and(Gain::is_sure);
            files::print(&match (after.rms_um < before.rms_um, sure, gain) {
                (true, false, Some(gain)) => format!(
                    "the machine is not better with 95 % probability: by {:.2} µm in the mean of the same rows, and by {:.2} or less in one of twenty cases without any change\n",
                    gain.mean * 1e3,
                    (gain.mean - gain.least) * 1e3
                ),
                (true, ..) => "the machine is better, but not as good as predicted\n".to_owned(),
                (false, ..) => "the machine is not better than before\n".to_owned(),
            })?;
        }
        Ok(validation.is_kept)
    }

    /// Probings from a log of the touches of a plan.
    fn touched(&self, plan: &str, log: &Path) -> Result<LogContents, BadInput> {
        let plan = files::read_plan(&self.file(plan), &self.machine)?;
        let text = Text::read(log)?;
        let touched = read_log(&text.text, &self.machine).map_err(|e| text.bad(e))?;
        let perfect = ErrorModel::perfect(&self.machine);
        let probe = self.qualified();
        let probe = probe.map(|path| files::read_probe(&path, &self.machine));
        let lobing = probe
            .transpose()?
            .map(|probe| probe.shape)
            .unwrap_or_default();
        let found = to_probings(&self.machine, &plan, &touched, None, &lobing, &perfect);
        found.map_err(|e| text.bad(e))
    }

    /// Probings that validate.
    fn validating(&self, log: &Path) -> Result<Probings, BadInput> {
        Ok(self.touched("validation.csv", log)?.probings)
    }

    fn errors(&self) -> Result<ErrorModel, BadInput> {
        files::read_known_errors(&self.file("errors.toml"), &self.machine)
    }

    fn measured(&self) -> Result<Probings, BadInput> {
        let text = Text::read(&self.file("probings.csv"))?;
        probings::read(&text.text, &self.machine, true).map_err(|e| text.bad(e))
    }

    /// The artefact with the tip as `identify` took it.
    fn probed_artefact(&self) -> Result<Artefact, BadInput> {
        let mut artefact = self.artefact.clone();
        if let Some(path) = self.qualified() {
            files::read_probe(&path, &self.machine)?.known(&mut artefact.stylus);
        }
        Ok(artefact)
    }

    /// Identifies the errors that the compensation is to correct.
    fn identified<T>(
        &self,
        then: impl FnOnce(&study::StudyOutcome<'_>) -> Result<T, BadInput>,
    ) -> Result<T, BadInput> {
        let study = Study {
            machine: &self.machine,
            probings: &self.measured()?,
            artefact: &self.probed_artefact()?,
            observations: &Observations::default(),
            runs: &[],
            base: &ErrorModel::perfect(&self.machine),
        };
        let request = StudyRequest {
            accept_places: self.options.accept_places,
            ..StudyRequest::of(self.model.parse().map_err(no_model)?)
        };
        let found = study.identify(&request).map_err(|refusal| {
            let file = self.text("probings.csv");
            BadInput::new(format!("{file}: {refusal}"), refusal.remedy())
        })?;
        then(&found)
    }

    /// What identification found, of the files in the folder if that step was done before.
    fn known(&self) -> Result<&CalibrationBasis, BadInput> {
        match self.known.get() {
            Some(known) => Ok(known),
            None => {
                let known = self.identified(|found| Ok(CalibrationBasis::of(found)))?;
                Ok(self.known.get_or_init(|| known))
            }
        }
    }

    /// What is not known of the errors (µm at the tip, 95 %, mean over the travel).
    fn band(&self) -> Result<f64, BadInput> {
        let band = self.over_the_travel(OVER_TRAVEL, |machine| over_travel(machine, SEED))?;
        Ok(band.map_or(0.0, |band| band.travel.translation_um.mean))
    }

    /// Like `band`, where the parameters were fitted.
    fn band_in_zone(&self) -> Result<f64, BadInput> {
        let band = self.over_the_travel(1.0, |machine| over_travel(machine, SEED))?;
        Ok(band.map_or(0.0, |band| {
            band.zone.unwrap_or(band.travel).translation_um.mean
        }))
    }

    /// The judgement, and how much smaller the distances of the same rows have become (mm).
    fn validated(&self, after: &Path) -> Result<(Validation, Option<Gain>), BadInput> {
        let machine = &self.machine;
        let perfect = ErrorModel::perfect(machine);
        let errors = self.errors()?;
        let artefact = self.probed_artefact()?;
        let known = self.known()?;
        let band = self.band()?;
        let distances =
            |probings: &Probings| scatters(machine, probings, &artefact, &perfect, &known.stylus);
        let scatter = |apart: &[f64]| {
            let squares: f64 = apart.iter().map(|mm| mm * mm).sum();
            Scatter {
                rms_um: (squares / apart.len() as f64).sqrt() * 1e3,
                largest_um: apart.iter().copied().fold(0.0, f64::max) * 1e3,
            }
        };
        let before = self.validating(&self.file("before.csv"))?;
        let balls: Vec<usize> = before.rows.iter().map(|row| row.ball).collect();
        let before = distances(&before);
        let after = distances(&self.validating(after)?);
        let gain = Gain::of(&balls, &before, &after);
        let probings = before.len();
        let (before, after) = (scatter(&before), scatter(&after));
        let probing = known.noise * 1e3 * 3.0_f64.sqrt();
        let expected = SCATTER * (libm::hypot(probing, self.band_in_zone()?));
        let is_better = after.rms_um < before.rms_um && gain.is_some_and(Gain::is_sure);
        let validation = Validation {
            probings,
            before,
            after,
            probing_um: probing,
            coverage_um: band,
            expected_um: expected,
            unseen: (self.missing(&errors)?.iter())
                .map(Parameter::to_string)
                .collect(),
            is_kept: is_better && after.rms_um <= expected,
        };
        Ok((validation, gain))
    }
}

/// Removes a file, if there is one.
fn removed(path: &Path) -> Result<(), BadInput> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(BadInput::new(
            format!("{}: cannot be removed: {error}", path.display()),
            "remove it, then start again with --from load",
        )),
        _ => Ok(()),
    }
}

/// Seed of the positions over which benefit and coverage intervals are averaged, as in other commands.
const SEED: u64 = 1;
