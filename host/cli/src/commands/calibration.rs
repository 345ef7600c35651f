//! A calibration of a machine, with its files: what the library decides, carried out and shown.
//!
//! The machine is moved by LinuxCNC or by its own controller; its corrections come from LinuxCNC's component or from a
//! board. [`Site`] is any of these.

mod on_site;
mod site;

pub use site::{Corrects, Errand, Moves, Site};

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use super::identify::no_model;
use super::number::positive;
use super::output::{self, quoted};
use super::plan;
use super::probings::said;
use super::qualify;
use super::touch_options::TouchOptions;
use clap::Args;
use on_site::OnSite;
use std::path::{Path, PathBuf};
use trueaxis_identify::Model;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{self, Probings};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_probing::plan::{Criterion, PlannedRows, Probe, Setup, Task};
use trueaxis_probing::qualify::ProbePriors;
use trueaxis_probing::spheres::{LogContents, read_log, to_probings};
use trueaxis_study::calibration::{
    Calibration, CalibrationEnd, CalibrationPlan, CalibrationPlanError, CalibrationStep, Unchanged,
    usual_model,
};

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
        output::make_folder(&folder, "--folder")?;
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
        output::print(&format!("{}: calibration in {folder}\n", self.machine.name))?;
        if options.from <= CalibrationStep::Plan {
            self.plan()?;
        } else {
            output::print(&format!(
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
                output::print(&format!("{place} is in use, and switched on\n"))?;
                return Ok(Outcome::Done);
            }
            CalibrationEnd::Unchanged(why) => why,
        };
        match &why {
            Unchanged::NotProbed => return Ok(Outcome::CheckFailed),
            Unchanged::MightHarm(benefit) => output::print(&format!(
                "\nover the travel the identified errors do {:.1} µm at the tip (rms), and about {:.1} µm would remain, \
                 because so much is not known of them\n",
                benefit.before_um, benefit.after_um
            ))?,
            _ => {}
        }
        output::print(&format!("nothing is loaded: {why}\n"))?;
        Ok(Outcome::CheckFailed)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn text(&self, name: &str) -> String {
        self.file(name).display().to_string()
    }

    /// A file of the folder, in a command.
    fn word(&self, name: &str) -> String {
        quoted(self.text(name))
    }

    /// Shows the command that would do by itself what comes next with the machine file.
    fn show(&self, command: &str, words: &str) -> Result<(), BadInput> {
        let machine = quoted(self.options.machine.display());
        output::print(&format!("\n$ trueaxis {command} {machine} {words}\n"))
    }

    /// Plans, and writes what is to be probed.
    fn plan(&self) -> Result<(), BadInput> {
        let (options, machine) = (self.options, &self.machine);
        self.show("plan", &self.words_of_plan())?;
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
            output::write(&self.file(name), csv.as_bytes())
        };
        let plan = &rows.planned.judgement.plan;
        write("plan.csv", plan)?;
        plan::show(&setup, &rows.planned, minutes(plan.rows.len()))?;
        if let Some(ball) = &rows.qualification {
            write(POSES_FILE, ball)?;
        }
        write("validation.csv", &rows.validation)
    }

    fn words_of_plan(&self) -> String {
        let options = self.options;
        let artefact = quoted(options.artefact.display());
        let mut words = format!("--artefact {artefact} --model {}", quoted(&self.model));
        let given = [
            ("--probings", options.probings.map(|n| n.to_string())),
            ("--minutes", options.minutes.map(|n| n.to_string())),
            ("--indexings", options.indexings.clone()),
        ];
        let given = given
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        for (name, value) in given.chain(options.touching.words()) {
            words += &format!(" {name} {}", quoted(value));
        }
        words + &format!(" -o {} --keep-clear", self.word("plan.csv"))
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
        let (ball, probe) = (self.word("ball.csv"), self.word("probe.toml"));
        self.show(
            "qualify",
            &format!("{ball} --ball-diameter {diameter} -o {probe}"),
        )?;
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
        output::write(&output, found.file.to_toml().as_bytes())?;
        qualify::show(&found, &log, &known, Some(&output))
    }

    /// Shows the command that makes probings of the touches, and makes them.
    fn probings(&self) -> Result<Probings, BadInput> {
        let [touches, plan, made] =
            ["touches.csv", "plan.csv", "probings.csv"].map(|name| self.word(name));
        let probe = self.words_of_probe();
        self.show(
            "probings",
            &format!("{touches} --plan {plan} -o {made}{probe}"),
        )?;
        let found = self.touched("plan.csv", "touches.csv")?;
        let output = self.file("probings.csv");
        let csv = probings::write(&found.probings, &self.machine);
        output::write(&output, csv.as_bytes())?;
        let said = said(&found, false);
        output::print(&format!("{}: {said}", output.display()))?;
        let accept = if self.options.accept_places {
            " --accept-places"
        } else {
            ""
        };
        let words = format!(
            "{made} --model {} --artefact {} -o {}{probe}{accept}",
            quoted(&self.model),
            quoted(self.options.artefact.display()),
            self.word("errors.toml")
        );
        self.show("identify", &words)?;
        self.measured()
    }

    fn words_of_probe(&self) -> String {
        let path = self.qualified().map(|path| quoted(path.display()));
        path.map_or(String::new(), |path| format!(" --probe {path}"))
    }

    /// Keeps a copy of the compensation in use, beside those of earlier trials in this folder: the first is `previous.trax`.
    fn keep_previous(&self, active: &Path) -> Result<(), BadInput> {
        let bytes = files::read_bytes(active)?;
        let path = output::kept_at(&bytes, |number| match number {
            1 => self.file("previous.trax"),
            _ => self.file(&format!("previous-{number}.trax")),
        })?;
        if !path.exists() {
            output::write(&path, &bytes)?;
        }
        output::print(&format!(
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
