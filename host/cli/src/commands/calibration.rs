//! A calibration of a machine, with its files: what the library decides, carried out and shown.
//!
//! The machine is moved by LinuxCNC or by its own controller; its corrections come from LinuxCNC's component or from a
//! board. [`Site`] is any of these.

mod site;

pub use site::{Corrects, Errand, Moves, Site};

use super::Outcome;
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
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_measure::calibration::{
    CalibratedMachine, Calibration, CalibrationEnd, CalibrationPlan, CalibrationPlanError,
    CalibrationRefusal, CalibrationStep, ProbedRows, Question, Unchanged, Validated, usual_model,
};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::probings::{self, Probings};
use trueaxis_measure::identify::Model;
use trueaxis_measure::plan::{Criterion, PlannedRows, Probe, Setup, Task};
use trueaxis_measure::qualify::ProbePriors;
use trueaxis_measure::spheres::{LogContents, read_log, to_probings};
use trueaxis_measure::study::StudyOutcome;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

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

/// Rotary positions at which the probe is qualified.
const POSES_FILE: &str = "poses.csv";

/// A calibration, with its files.
pub struct CalibrationFiles<'a> {
    options: &'a CalibrationOptions,
    machine: Machine,
    artefact: Artefact,
    model: Model,
    folder: PathBuf,
}

/// The machine at a site, and the files of its calibration.
struct OnSite<'a, 's> {
    files: &'a CalibrationFiles<'a>,
    site: &'a mut Site<'s>,
}

impl<'a> CalibrationFiles<'a> {
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
        let model = match &options.model {
            Some(given) => given.parse(),
            None => usual_model(&machine, &artefact),
        };
        Ok(Self {
            model: model.map_err(no_model)?,
            options,
            machine,
            artefact,
            folder,
        })
    }

    /// Does what the steps say, at a site.
    pub fn run(&self, site: &mut Site<'_>) -> Result<Outcome, BadInput> {
        let options = self.options;
        let folder = self.folder.display();
        files::print(&format!("{}: calibration in {folder}\n", self.machine.name))?;
        if options.from <= CalibrationStep::Plan {
            self.plan()?;
        } else {
            files::print(&format!(
                "begins with the files of the earlier steps; {} changes only if the new compensation is kept\n",
                site.place()
            ))?;
        }
        let calibration = Calibration {
            machine: &self.machine,
            model: self.model.clone(),
            accept_places: options.accept_places,
        };
        let place = site.place();
        let mut machine = OnSite { files: self, site };
        let why = match calibration.run(options.from, &mut machine)? {
            CalibrationEnd::InUse => {
                files::print(&format!("{place} is in use, and switched on\n"))?;
                return Ok(Outcome::Done);
            }
            CalibrationEnd::Unchanged(why) => why,
        };
        match &why {
            Unchanged::NotProbed => return Ok(Outcome::CheckFailed),
            Unchanged::MightHarm(benefit) => files::print(&format!(
                "\nover the travel the identified errors do {:.1} µm at the tip (rms), and about {:.1} µm would remain, \
                 because so much is not known of them\n",
                benefit.before_um, benefit.after_um
            ))?,
            _ => {}
        }
        files::print(&format!("nothing is loaded: {why}\n"))?;
        Ok(Outcome::CheckFailed)
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

    /// Plans, and writes what is to be probed.
    fn plan(&self) -> Result<(), BadInput> {
        let (options, machine) = (self.options, &self.machine);
        self.show(&self.words_of_plan())?;
        let setup = Setup {
            balls: plan::known_balls(&self.artefact, &options.artefact)?,
            ..self.setup()?
        };
        let minutes = |rows: usize| rows as f64 * plan::SECONDS / 60.0;
        let fitting = options.minutes.map(|given| (given / minutes(1)) as usize);
        let task = Task {
            setup: &setup,
            model: &self.model,
            degree: 1,
            assumed: &ErrorModel::perfect(machine),
            rows: PlannedRows::Best {
                indexings: options.indexings.as_deref(),
                probings: fitting.or(options.probings),
                criterion: Criterion::default(),
            },
        };
        let ball = options.qualify.as_deref();
        let rows = CalibrationPlan::of(&task, options.validate.into(), ball);
        let rows = rows.map_err(|error| match error {
            CalibrationPlanError::Plan(error) => plan::refused(&error),
            other => BadInput::new(other.to_string(), other.remedy()),
        })?;
        let write = |name: &str, rows: &Probings| {
            let csv = probings::write_plan(rows, machine);
            files::write(&self.file(name), csv.as_bytes())
        };
        let plan = &rows.planned.judgement.plan;
        write("plan.csv", plan)?;
        plan::show(&setup, &rows.planned, minutes(plan.rows.len()))?;
        if let Some(ball) = &rows.qualification {
            write(POSES_FILE, ball)?;
        }
        write("validation.csv", &rows.validation)
    }

    fn words_of_plan(&self) -> Vec<String> {
        let options = self.options;
        let path = |path: &Path| path.display().to_string();
        let mut words = vec!["plan".to_owned(), path(&options.machine)];
        let mut add = |name: &str, value: String| words.extend([name.to_owned(), value]);
        add("--artefact", path(&options.artefact));
        add("--model", self.model.to_string());
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
        words
    }

    /// The file of the qualified probe, if there is one.
    fn qualified(&self) -> Option<PathBuf> {
        let options = self.options;
        let own = options.qualify.as_ref().map(|_| self.file("probe.toml"));
        options.probe.clone().or(own)
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

    /// Shows the command that makes probings of the touches, and makes them.
    fn probings(&self) -> Result<Probings, BadInput> {
        let mut words: Vec<String> = [
            "probings",
            &self.options.machine.display().to_string(),
            &self.text("touches.csv"),
            "--plan",
            &self.text("plan.csv"),
            "-o",
            &self.text("probings.csv"),
        ]
        .map(str::to_owned)
        .into();
        words.extend(self.words_of_probe());
        self.show(&words)?;
        let found = self.touched("plan.csv", "touches.csv")?;
        let output = self.file("probings.csv");
        let csv = probings::write(&found.probings, &self.machine);
        files::write(&output, csv.as_bytes())?;
        let said = said(&found, false);
        files::print(&format!("{}: {said}", output.display()))?;
        self.show(&self.words_of_identify())?;
        self.measured()
    }

    fn words_of_identify(&self) -> Vec<String> {
        let options = self.options;
        let mut words: Vec<String> = [
            "identify",
            &options.machine.display().to_string(),
            &self.text("probings.csv"),
            "--model",
            &self.model.to_string(),
            "--artefact",
            &options.artefact.display().to_string(),
            "-o",
            &self.text("errors.toml"),
        ]
        .map(str::to_owned)
        .into();
        words.extend(self.words_of_probe());
        if options.accept_places {
            words.push("--accept-places".to_owned());
        }
        words
    }

    fn words_of_probe(&self) -> Vec<String> {
        let path = self.qualified().map(|path| path.display().to_string());
        path.map_or(Vec::new(), |path| vec!["--probe".to_owned(), path])
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

    /// Probings from a log of the touches of a plan.
    fn touched(&self, plan: &str, log: &str) -> Result<LogContents, BadInput> {
        let plan = files::read_plan(&self.file(plan), &self.machine)?;
        let text = Text::read(&self.file(log))?;
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

    fn measured(&self) -> Result<Probings, BadInput> {
        let text = Text::read(&self.file("probings.csv"))?;
        probings::read(&text.text, &self.machine, true).map_err(|e| text.bad(e))
    }

    /// The artefact with the tip as the probe was qualified.
    fn probed_artefact(&self) -> Result<Artefact, BadInput> {
        let mut artefact = self.artefact.clone();
        if let Some(path) = self.qualified() {
            files::read_probe(&path, &self.machine)?.known(&mut artefact.stylus);
        }
        Ok(artefact)
    }
}

impl CalibratedMachine for OnSite<'_, '_> {
    type Error = BadInput;

    fn refused(&self, refusal: CalibrationRefusal) -> BadInput {
        let files = self.files;
        match refusal {
            CalibrationRefusal::Study(refusal) => BadInput::new(
                format!("{}: {refusal}", files.text("probings.csv")),
                refusal.remedy(),
            ),
            CalibrationRefusal::Errors(error) => BadInput::new(
                format!("{}: {error}", files.text("errors.toml")),
                "identify the errors again: --from identify",
            ),
        }
    }

    fn probe(&mut self) -> Result<bool, BadInput> {
        let (files, site) = (self.files, &mut *self.site);
        let before = files.errand("validation.csv", "before.csv")?;
        let plan = files.errand("plan.csv", "touches.csv")?;
        let qualifies = files.options.qualify.is_some();
        let ball = qualifies.then(|| files.errand(POSES_FILE, "ball.csv"));
        let ball = ball.transpose()?;
        let all: Vec<&Errand<'_>> = ball.iter().chain([&before, &plan]).collect();
        let yes = files.options.yes;
        if !site.is_ready(&all, yes)? {
            return Ok(false);
        }
        if let Some(ball) = &ball {
            site.touch(ball)?;
            files.qualify()?;
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

    fn artefact(&mut self) -> Result<Artefact, BadInput> {
        self.files.probed_artefact()
    }

    fn probed(&mut self, rows: ProbedRows) -> Result<Probings, BadInput> {
        let files = self.files;
        match rows {
            ProbedRows::Plan if files.options.from <= CalibrationStep::Identify => files.probings(),
            ProbedRows::Plan => files.measured(),
            ProbedRows::Before => Ok(files.touched("validation.csv", "before.csv")?.probings),
            ProbedRows::After => Ok(files.touched("validation.csv", "after.csv")?.probings),
        }
    }

    fn identified(&mut self, found: &StudyOutcome<'_>) -> Result<(), BadInput> {
        let errors = identify::write(found, &self.files.file("errors.toml"))?;
        identify::show(found, &errors, false)?;
        identify::warn(found);
        Ok(())
    }

    fn errors(&mut self) -> Result<ErrorModel, BadInput> {
        files::read_known_errors(&self.files.file("errors.toml"), &self.files.machine)
    }

    fn agrees(&mut self, question: Question<'_>) -> Result<bool, BadInput> {
        let (files, yes) = (self.files, self.files.options.yes);
        match question {
            Question::Unmeasured(parameters) => {
                let names = Model::Named(parameters.to_vec());
                files::print(&format!(
                    "\nnot measured: {names}. A machine that has them is worse than any limit that is printed here\n"
                ))?;
                let accepts = files.options.accept_missing;
                Ok(accepts || !yes && asked("May it go on without them?")?)
            }
            Question::Load => {
                let blob = files.file("machine.trax");
                files::print("\n")?;
                let question = format!("May {} be loaded and switched on?", blob.display());
                Ok(yes || asked(&question)?)
            }
            Question::Validate => {
                let question = "May it be validated by probing with the corrections on?";
                let is_taken = files.options.from <= CalibrationStep::Probe;
                let agrees = (yes || asked(question)?) && (is_taken || self.site.take_over(yes)?);
                if !agrees {
                    files::print("you did not want it probed\n")?;
                }
                Ok(agrees)
            }
        }
    }

    fn compile(&mut self) -> Result<bool, BadInput> {
        let files = self.files;
        let target = self.site.target(&files.file("board.toml"))?;
        let words = [
            "compile",
            &files.options.machine.display().to_string(),
            &files.text("errors.toml"),
            "--target",
            &target,
            "-o",
            &files.text("machine.trax"),
        ];
        files.show(&words.map(str::to_owned))?;
        let inputs = MachineFiles {
            machine: files.options.machine.clone(),
            errors: files.file("errors.toml"),
        };
        let blob = files.file("machine.trax");
        let compiled = compile::usual(&inputs, blob, target::read(&target)?)?;
        compiled.show()?;
        Ok(compiled.made.is_right())
    }

    fn load(&mut self) -> Result<(), BadInput> {
        if let Some(active) = self.site.file().filter(|active| active.exists()) {
            self.files.keep_previous(active)?;
        }
        self.site.load(&self.files.file("machine.trax"))?;
        self.site.switch(true)
    }

    fn probe_again(&mut self) -> Result<(), BadInput> {
        let errand = self.files.errand("validation.csv", "after.csv")?;
        // An older one was made with another compensation, and would count as this one's.
        removed(&errand.log)?;
        self.site.touch(&errand)
    }

    fn validated(&mut self, found: &Validated) -> Result<(), BadInput> {
        let files = self.files;
        let json = files::json(&found.validation)?;
        files::write(&files.file("validation.json"), json.as_bytes())?;
        files::print(&table(found, &files.text("errors.toml")))
    }

    fn keep(&mut self) -> Result<(), BadInput> {
        self.site.keep()
    }

    fn undo(&mut self) -> Result<(), BadInput> {
        self.site.undo()
    }
}

/// The figures of a validation.
fn table(found: &Validated, errors: &str) -> String {
    let validation = &found.validation;
    let predicted = match validation.unseen.is_empty() {
        true => "predicted, at most",
        false => "predicted from the measured errors",
    };
    let (before, after) = (validation.before, validation.after);
    let mut text = format!(
        "\nvalidation at {} other positions    rms (µm)   largest\n  \
         before                           {:>9.2} {:>9.2}\n  \
         after                            {:>9.2} {:>9.2}\n  \
         {predicted:<32} {:>9.2}\n",
        validation.probings,
        before.rms_um,
        before.largest_um,
        after.rms_um,
        after.largest_um,
        validation.expected_um
    );
    if !validation.unseen.is_empty() {
        text += &format!(
            "not measured, and not in the prediction: {}; {errors} says what would show each\n",
            validation.unseen.join(", ")
        );
    }
    if let Some(why) = found.objection() {
        text += &format!("{why}\n");
    }
    text
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
