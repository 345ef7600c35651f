//! `trueaxis plan`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::identify::no_model;
use super::number::positive;
use super::output;
use super::plan_output::screen;
use super::quantity::count;
use super::touch_options::TouchOptions;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_identify::Model;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{self, Probing, Probings};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_probing::plan::{
    Collision, Criterion, Feeds, NotTouched, PlanError, Planned, PlannedRows, Set, SetPositions,
    Setup, Summary, Task, Unreachable, collision, expected, linuxcnc, positions, steps, table,
};

/// Predict the parameters that a measurement plan will identify, or propose a plan
///
/// Solves the equations of `trueaxis identify` at the positions of a plan: which parameters will be identified,
/// how well each will be known, and what volumetric error will remain over the travel. Without --plan it chooses
/// the most informative probings, beside what the instruments of --observations read, and writes them together with a
/// program.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis plan machine.toml --model 12 --artefact artefact.toml --plan plan.csv\n  \
trueaxis plan machine.toml --model 12 --artefact artefact.toml --minutes 60 --indexings A=-55:55:5,C=0:330:30 \\\n    \
--ball-diameter 20 --stylus-diameter 6 -o plan.csv --program probe.ngc\n  \
trueaxis plan machine.toml --model 12 --observations bar.csv laser.csv\n\n\
The artefact has balls with nominal_mm, and away_from_table where that is not z of the workpiece. A plan has a\n\
header and a line for each probing, without linear axes; S indexes the spindle, A_dir is the direction from\n\
which an axis arrives:\n  ball,A,C\n  1,15,60\n  1,30,180\n\n\
Observations are those of `identify` and need no readings; a length then needs its place_mm:\n  \
# [setup.bar]\n  # place_mm = [0.0, 0.0, 50.0]\n  kind,setup,X,Y,Z,A,C,sigma_um\n  length,bar,150,0,-24,0,0,0.5"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Parameters to identify
    #[arg(long, default_value = "auto", value_name = "10|12|13|81|84|auto|NAMES")]
    model: String,
    /// Polynomial degree for the model `auto`
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(0..=3))]
    degree: u8,
    /// Positions of the balls (artefact.toml)
    #[arg(long, value_name = "FILE", required_unless_present = "observations")]
    artefact: Option<PathBuf>,
    /// What instruments read at which positions, with the uncertainty of each reading (CSV); without --artefact, they
    /// alone are judged
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    observations: Vec<PathBuf>,
    /// Evaluate this plan instead of proposing one (CSV)
    #[arg(long, value_name = "FILE.csv", requires = "artefact")]
    plan: Option<PathBuf>,
    /// Use a position set of the source document instead of proposing one: one ball at 60 rotary positions
    /// (chase-the-ball), every ball at 42 (rumba), or a bar and master balls at 32 with an indexed spindle (samba).
    /// Unreachable positions are left out. For samba, --cone defaults to 90
    #[arg(long, value_enum, requires = "artefact", conflicts_with_all = ["plan", "as_good_as", "minutes", "probings", "indexings"])]
    set: Option<Set>,
    /// Propose the fewest probings after which the volumetric error (with --best-for parameters, also every
    /// parameter) is known at least as well as after this plan (CSV)
    #[arg(long, value_name = "FILE.csv", requires = "artefact", conflicts_with_all = ["plan", "minutes", "probings"])]
    as_good_as: Option<PathBuf>,
    /// Balls that may be used (default: all balls of the artefact)
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        conflicts_with = "plan"
    )]
    balls: Vec<String>,
    /// Positions that rotary axes and spindle may take (default: their travel; the spindle only if parameters could
    /// not be separated from the stylus otherwise)
    #[arg(long, value_name = "A=FROM:TO:STEP,…", conflicts_with = "plan")]
    indexings: Option<String>,
    /// Longest time for probing
    #[arg(long, value_name = "MIN", conflicts_with_all = ["plan", "probings"], value_parser = positive)]
    minutes: Option<f64>,
    /// Largest number of probings (default: as many as unknowns)
    #[arg(long, value_name = "N", conflicts_with = "plan")]
    probings: Option<usize>,
    /// Time of one probing
    #[arg(long, value_name = "S", default_value_t = SECONDS, value_parser = positive)]
    seconds: f64,
    /// What a proposed plan optimizes
    #[arg(long, value_enum, default_value_t = Criterion::Volume, conflicts_with = "plan")]
    best_for: Criterion,
    /// Standard uncertainty of each coordinate of a probing and of each reading, unless the plan states one (of angles:
    /// µrad)
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    noise: f64,
    /// Assumed errors of the machine (errors.toml)
    #[arg(long, value_name = "ERRORS.toml")]
    errors: Option<PathBuf>,
    #[command(flatten)]
    touching: TouchOptions,
    /// Feed rate of touches
    #[arg(long, value_name = "MM/MIN", default_value_t = 60.0, value_parser = positive)]
    feed: f64,
    /// Feed rate near the balls
    #[arg(long, value_name = "MM/MIN", default_value_t = 1000.0, value_parser = positive)]
    approach: f64,
    /// Where to write the proposed plan (CSV)
    #[arg(
        short,
        long,
        value_name = "PLAN.csv",
        requires = "artefact",
        conflicts_with = "plan"
    )]
    output: Option<PathBuf>,
    /// Where to write a program that probes the plan on LinuxCNC
    #[arg(
        long,
        value_name = "FILE.ngc",
        requires = "artefact",
        requires = "ball_diameter",
        requires = "stylus_diameter"
    )]
    program: Option<PathBuf>,
    /// Name of the log of touches in the program
    #[arg(long, value_name = "NAME", default_value = "touches.log", value_parser = log_name)]
    log: String,
    /// Where to write the touches for other controllers (CSV)
    #[arg(
        long,
        value_name = "FILE.csv",
        requires = "artefact",
        requires = "ball_diameter",
        requires = "stylus_diameter"
    )]
    table: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Default of the time of one probing (s).
pub const SECONDS: f64 = 110.0;

/// A name that is valid in a G-code comment.
fn log_name(text: &str) -> Result<String, String> {
    let fits = |c: char| c.is_ascii_graphic() && !"()".contains(c);
    if (1..=200).contains(&text.len()) && text.chars().all(fits) {
        return Ok(text.to_owned());
    }
    Err("give a name without spaces and brackets".to_owned())
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    arguments.prepare()?;
    let machine = files::read_machine(&arguments.machine)?;
    let artefact = arguments.artefact.as_ref();
    let artefact = artefact.map(|path| files::read_artefact(path, &machine));
    let artefact = artefact.transpose()?.unwrap_or_default();
    let errors = match &arguments.errors {
        Some(path) => files::read_errors(path, &machine)?,
        None => ErrorModel::perfect(&machine),
    };
    let observations = arguments.instruments(&machine, &errors)?;
    let setup = arguments.setup(&machine, &artefact, &observations)?;
    let model: Model = arguments.model.parse().map_err(no_model)?;
    let set = arguments.set.map(|set| arguments.positions(&setup, set));
    let set = set.transpose()?;
    let read = |path: &PathBuf| files::read_plan(path, &machine);
    let given = match &set {
        Some(positions) => Some(positions.plan.clone()),
        None if arguments.artefact.is_none() => Some(Probings::default()),
        None => arguments.plan.as_ref().map(read).transpose()?,
    };
    if let (Some(plan), true) = (&given, arguments.touching.qualifies()) {
        // Many touches of a ball qualify the probe; they need not identify anything.
        arguments.write(&setup, plan)?;
        return arguments.qualifying(&setup, plan);
    }
    let other = arguments.as_good_as.as_ref().map(read).transpose()?;
    let task = Task {
        setup: &setup,
        model: &model,
        degree: arguments.degree,
        assumed: &errors,
        rows: arguments.rows(given.as_ref(), other.as_ref()),
    };
    let planned = task.plan().map_err(|error| arguments.refused(&error))?;
    let plan = &planned.judgement.plan;
    arguments.write(&setup, plan)?;
    let minutes = plan.rows.len() as f64 * arguments.seconds / 60.0;
    match arguments.json {
        true => {
            warn(&planned);
            output::print_json(&Summary::new(&setup, &planned, minutes, set.as_ref()))?;
        }
        false => show(&setup, &planned, minutes)?,
    }
    Ok(Outcome::Done)
}

/// Prints what people read.
pub fn show(setup: &Setup<'_>, planned: &Planned, minutes: f64) -> Result<(), BadInput> {
    warn(planned);
    output::print(&screen(setup, planned, minutes))
}

/// Prints notes and the warning.
fn warn(planned: &Planned) {
    for note in &planned.notes {
        eprintln!("note: {note}");
    }
    if let Some(warning) = &planned.warning {
        eprintln!("warning: {warning}");
    }
}

/// Touches that qualify the probe, as JSON.
#[derive(Serialize)]
struct Qualifying<'a> {
    machine: &'a str,
    rows: usize,
    touches: usize,
}

impl Arguments {
    /// Says how the probe is qualified.
    fn qualifying(&self, setup: &Setup<'_>, plan: &Probings) -> Result<Outcome, BadInput> {
        let touches = |row: &Probing| {
            let own = Setup {
                balls: plan.balls.clone(),
                ..setup.clone()
            };
            own.touching(row).map(|touching| touching.touches.len())
        };
        let mut all = 0;
        for row in &plan.rows {
            all += touches(row).map_err(|why| not_reached((row.clone(), why), plan))?;
        }
        let machine = &setup.machine.name;
        let rows = plan.rows.len();
        let answer = Qualifying {
            machine,
            rows,
            touches: all,
        };
        output::print_answer(self.json, &answer, || {
            format!(
                "{machine}: {all} touches at {}, to qualify the probe (trueaxis qualify)\n",
                count(rows, "position")
            )
        })?;
        Ok(Outcome::Done)
    }

    fn prepare(&self) -> Result<(), BadInput> {
        let inputs = [
            Some(&self.machine),
            self.artefact.as_ref(),
            self.plan.as_ref(),
            self.as_good_as.as_ref(),
            self.errors.as_ref(),
        ];
        let inputs = inputs.into_iter().flatten().chain(&self.observations);
        let inputs: Vec<&Path> = inputs.map(PathBuf::as_path).collect();
        let outputs = [&self.output, &self.program, &self.table];
        let outputs: Vec<&Path> = outputs
            .into_iter()
            .flatten()
            .map(PathBuf::as_path)
            .collect();
        for (i, output) in outputs.iter().enumerate() {
            if outputs[..i].contains(output) {
                return Err(BadInput::new(
                    format!("{} would be written twice", output.display()),
                    "give -o, --program and --table different names",
                ));
            }
            output::prepare(output, &inputs)?;
        }
        Ok(())
    }

    /// The balls to probe, all of which are known.
    fn chosen_balls(&self, known: &[String]) -> Result<Vec<String>, BadInput> {
        let place = self.artefact.as_deref().unwrap_or(Path::new(""));
        let balls = match (self.balls.is_empty(), self.set) {
            (true, Some(Set::ChaseTheBall)) => known.iter().take(1).cloned().collect(),
            (true, _) => known.to_vec(),
            (false, _) => self.balls.clone(),
        };
        if let Some(ball) = balls.iter().find(|b| !known.contains(b)) {
            return Err(BadInput::new(
                format!(
                    "{}: ball `{ball}` is not there, or has no nominal_mm",
                    place.display()
                ),
                "write [[ball]] with name and nominal_mm for every ball that --balls names",
            ));
        }
        if let Some(ball) = (1..balls.len()).find(|i| balls[..*i].contains(&balls[*i])) {
            return Err(BadInput::new(
                format!("--balls names {} twice", balls[ball]),
                "name every ball once",
            ));
        }
        Ok(balls)
    }

    fn setup<'a>(
        &self,
        machine: &'a Machine,
        artefact: &'a Artefact,
        observations: &'a Observations,
    ) -> Result<Setup<'a>, BadInput> {
        let known = match &self.artefact {
            Some(path) => known_balls(artefact, path)?,
            None => Vec::new(),
        };
        let balls = self.chosen_balls(&known)?;
        Ok(Setup {
            machine,
            artefact,
            balls,
            probe: match self.set.and_then(Set::cone) {
                Some(cone) => self.touching.probe_within(cone)?,
                None => self.touching.probe()?,
            },
            sigma: self.noise * 1e-3,
            observations: Some(observations),
        })
    }

    /// What the instruments will read.
    fn instruments(
        &self,
        machine: &Machine,
        assumed: &ErrorModel,
    ) -> Result<Observations, BadInput> {
        let plan = files::read_instruments(&self.observations, machine)?;
        expected(machine, &plan, assumed, self.noise * 1e-3).map_err(|error| {
            let names: Vec<String> = (self.observations.iter())
                .map(|path| path.display().to_string())
                .collect();
            BadInput::new(
                format!("{}: {error}", names.join(", ")),
                format!(
                    "add # [setup.{}] and # place_mm = [0.0, 0.0, 0.0] with its centre, or the readings of all its lines",
                    error.setup
                ),
            )
        })
    }

    /// A position set, with the positions that were left out.
    fn positions(&self, setup: &Setup<'_>, set: Set) -> Result<SetPositions, BadInput> {
        let found = positions(setup, set);
        let found = found.map_err(|error| BadInput::new(error.to_string(), error.remedy()))?;
        if let Some((ball, _, reason)) = found.left_out.first() {
            let all = found.plan.rows.len() + found.left_out.len();
            eprintln!(
                "note: {} of the {all} probings of {set} are left out, the first of ball {ball}: {reason}",
                found.left_out.len()
            );
        }
        Ok(found)
    }

    /// The rows to probe.
    fn rows<'a>(
        &'a self,
        given: Option<&'a Probings>,
        other: Option<&'a Probings>,
    ) -> PlannedRows<'a> {
        let (indexings, criterion) = (self.indexings.as_deref(), self.best_for);
        match (given, other) {
            (Some(plan), _) => PlannedRows::Given(plan),
            (None, Some(other)) => PlannedRows::AsGoodAs {
                indexings,
                other,
                criterion,
            },
            (None, None) => PlannedRows::Best {
                indexings,
                probings: (self.minutes)
                    .map(|minutes| (minutes * 60.0 / self.seconds) as usize)
                    .or(self.probings),
                criterion,
            },
        }
    }

    /// A refusal, with the option or the file that it is about.
    fn refused(&self, error: &PlanError) -> BadInput {
        let PlanError::Strategy { is_other, .. } = error else {
            return refused(error);
        };
        let plan = match is_other {
            true => &self.as_good_as,
            false => &self.plan,
        };
        let place = match (plan, self.set) {
            (Some(path), _) => path.display().to_string(),
            (None, Some(set)) => set.name().to_owned(),
            (None, None) => match (&self.artefact, self.observations.first(), &self.output) {
                (None, Some(path), _) | (_, _, Some(path)) => path.display().to_string(),
                _ => "the proposed plan".to_owned(),
            },
        };
        BadInput::new(format!("{place}: {error}"), error.remedy())
    }

    fn write(&self, setup: &Setup<'_>, plan: &Probings) -> Result<(), BadInput> {
        // Do everything that can fail first, so that no file is written without the others.
        let not_reached = |why: NotTouched| not_reached(*why, plan);
        let feeds = Feeds {
            touch: self.feed,
            near: self.approach,
        };
        let program = (self.program.as_ref())
            .map(|path| linuxcnc(setup, plan, feeds, &self.log).map(|text| (path, text)));
        let table = self
            .table
            .as_ref()
            .map(|path| table(setup, plan).map(|text| (path, text)));
        let written =
            (self.output.as_ref()).map(|path| (path, probings::write_plan(plan, setup.machine)));
        let program = program.transpose().map_err(not_reached)?;
        let table = table.transpose().map_err(not_reached)?;
        if program.is_some() || table.is_some() {
            let steps = steps(setup, plan).map_err(not_reached)?;
            if let Some(collision) = collision(setup, plan, &steps) {
                return Err(collides(&collision));
            }
        }
        let all = [written, program, table].into_iter().flatten();
        let all: Vec<_> = all.map(|(path, text)| (path.clone(), text)).collect();
        output::write_all(&all)
    }
}

/// Names of the balls whose places are known.
pub fn known_balls(artefact: &Artefact, path: &Path) -> Result<Vec<String>, BadInput> {
    let known = artefact.balls.iter().filter(|ball| ball.nominal.is_some());
    let names: Vec<String> = known.map(|ball| ball.name.clone()).collect();
    if names.is_empty() {
        return Err(BadInput::new(
            format!("{}: there is no ball with nominal_mm", path.display()),
            "write [[ball]] with name and nominal_mm for every ball",
        ));
    }
    Ok(names)
}

/// A move on which two solids would come too close.
pub fn collides(collision: &Collision) -> BadInput {
    BadInput::new(
        collision.to_string(),
        "leave this row out (--indexings), place the balls elsewhere, or correct the solids of machine file and artefact: nothing was written, and nothing has moved",
    )
}

/// A row that cannot be touched.
pub fn not_reached((row, reason): (Probing, Unreachable), plan: &Probings) -> BadInput {
    BadInput::new(
        format!(
            "line {} of the plan: ball {} cannot be touched: {reason}",
            row.line, plan.balls[row.ball]
        ),
        "leave this row out, or allow it: --cone, --clearance, --keep-apart, the balls' away_from_table, the range of the axis",
    )
}

/// Why there is no plan.
pub fn refused(error: &PlanError) -> BadInput {
    match error {
        PlanError::Model(error) => no_model(error.clone()),
        error => BadInput::new(error.to_string(), error.remedy()),
    }
}
