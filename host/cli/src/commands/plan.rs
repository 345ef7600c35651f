//! `trueaxis plan`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::identify::no_model;
use super::number::positive;
use super::plan_output::{Answer, screen};
use super::quantity::count;
use super::touch_options::Touching;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::{self, Probing, Probings};
use trueaxis_measure::identify::{Model, Problem, effect_over_travel, lacks};
use trueaxis_measure::plan::{
    Allowed, Collision, Criterion, DesignError, Feeds, JudgeError, Judgement, NotTouched,
    Positions, Set, Setup, Unreachable, Wanted, as_good_as, collision, design, expected, judge,
    linuxcnc, needs_spindle, positions, steps, table,
};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// Predict what probings and instruments will identify, or propose what to probe
///
/// Solves the equations of `trueaxis identify` at the positions of a strategy: which parameters will be identified,
/// how well each will be known, and what volumetric error will remain over the travel. Without --strategy it chooses
/// the most informative probings, beside what the instruments of --observations read, and writes them together with a
/// program.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis plan machine.toml --model 12 --artefact artefact.toml --strategy strategy.csv\n  \
trueaxis plan machine.toml --model 12 --artefact artefact.toml --minutes 60 --indexings A=-55:55:5,C=0:330:30 \\\n    \
--ball-diameter 20 --stylus-diameter 6 -o strategy.csv --program probe.ngc\n  \
trueaxis plan machine.toml --model 12 --observations bar.csv laser.csv\n\n\
The artefact has balls with nominal_mm, and away_from_table where that is not z of the workpiece. A strategy has a\n\
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
    /// Evaluate this strategy instead of proposing one (CSV)
    #[arg(long, value_name = "FILE.csv", requires = "artefact")]
    strategy: Option<PathBuf>,
    /// Use a position set of the source document instead of proposing one: one ball at 60 rotary positions
    /// (chase-the-ball), every ball at 42 (rumba), or a bar and master balls at 32 with an indexed spindle (samba).
    /// Unreachable positions are left out. For samba, --cone defaults to 90
    #[arg(long, value_enum, requires = "artefact", conflicts_with_all = ["strategy", "as_good_as", "minutes", "probings", "indexings"])]
    set: Option<Set>,
    /// Propose the fewest probings after which the volumetric error (with --best-for parameters, also every
    /// parameter) is known at least as well as after this strategy (CSV)
    #[arg(long, value_name = "FILE.csv", requires = "artefact", conflicts_with_all = ["strategy", "minutes", "probings"])]
    as_good_as: Option<PathBuf>,
    /// Balls that may be used (default: all balls of the artefact)
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        conflicts_with = "strategy"
    )]
    balls: Vec<String>,
    /// Positions that rotary axes and spindle may take (default: their travel; the spindle only if parameters could
    /// not be separated from the stylus otherwise)
    #[arg(long, value_name = "A=FROM:TO:STEP,…", conflicts_with = "strategy")]
    indexings: Option<String>,
    /// Longest time for probing
    #[arg(long, value_name = "MIN", conflicts_with_all = ["strategy", "probings"], value_parser = positive)]
    minutes: Option<f64>,
    /// Largest number of probings (default: as many as unknowns)
    #[arg(long, value_name = "N", conflicts_with = "strategy")]
    probings: Option<usize>,
    /// Time of one probing
    #[arg(long, value_name = "S", default_value_t = 110.0, value_parser = positive)]
    seconds: f64,
    /// What a proposed strategy optimizes
    #[arg(long, value_enum, default_value_t = Criterion::Volume, conflicts_with = "strategy")]
    best_for: Criterion,
    /// Standard uncertainty of each coordinate of a probing and of each reading, unless the strategy states one (of angles:
    /// µrad)
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    noise: f64,
    /// Assumed errors of the machine (errors.toml)
    #[arg(long, value_name = "ERRORS.toml")]
    errors: Option<PathBuf>,
    #[command(flatten)]
    touching: Touching,
    /// Feed rate of touches
    #[arg(long, value_name = "MM/MIN", default_value_t = 60.0, value_parser = positive)]
    feed: f64,
    /// Feed rate near the balls
    #[arg(long, value_name = "MM/MIN", default_value_t = 1000.0, value_parser = positive)]
    approach: f64,
    /// Where to write the proposed strategy (CSV)
    #[arg(
        short,
        long,
        value_name = "STRATEGY.csv",
        requires = "artefact",
        conflicts_with = "strategy"
    )]
    output: Option<PathBuf>,
    /// Where to write a program that probes the strategy on LinuxCNC
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
    let artefact = match &arguments.artefact {
        Some(path) => files::read_artefact(path, &machine)?,
        None => Artefact::default(),
    };
    let errors = match &arguments.errors {
        Some(path) => files::read_errors(path, &machine)?,
        None => ErrorModel::perfect(&machine),
    };
    let assumed = &errors;
    let observations = arguments.instruments(&machine, assumed)?;
    let setup = arguments.setup(&machine, &artefact, &observations)?;
    let read = |path: &PathBuf| files::read_strategy(path, &machine);
    let model: Model = arguments.model.parse().map_err(no_model)?;
    let set = arguments.set;
    let positions = set
        .map(|set| arguments.positions(&setup, set))
        .transpose()?;
    let given = match &positions {
        Some(positions) => Some(positions.strategy.clone()),
        None if arguments.artefact.is_none() => Some(Probings::default()),
        None => arguments.strategy.as_ref().map(&read).transpose()?,
    };
    if let (Some(strategy), true) = (&given, arguments.touching.qualifies()) {
        // Many touches of a ball qualify the probe; they need not identify anything.
        arguments.write(&setup, strategy)?;
        return arguments.qualifying(&setup, strategy);
    }
    let directions = arguments.directions(&machine, &model, given.as_ref(), &observations)?;
    let parameters =
        (model.parameters(&machine, arguments.degree, &directions)).map_err(no_model)?;
    let not_judged = |path: &Path| {
        let place = path.display().to_string();
        move |error: JudgeError| {
            BadInput::new(
                format!("{place}: {error}"),
                match error {
                    JudgeError::Strategy(_) => {
                        "correct the strategy, or where the balls are in the artefact"
                    }
                    JudgeError::Identify(_) if arguments.artefact.is_none() => {
                        "read more, add probings (--artefact), or give a model with fewer parameters"
                    }
                    JudgeError::Identify(_) => {
                        "probe at more rotary positions, or give a model with fewer parameters"
                    }
                },
            )
        }
    };
    let other = match &arguments.as_good_as {
        Some(path) => {
            let strategy = read(path)?;
            let judged = judge(&setup, &parameters, &strategy, assumed);
            Some(judged.map_err(not_judged(path))?)
        }
        None => None,
    };
    let judgement = match (&arguments.strategy, given) {
        (path, Some(strategy)) => {
            let first = arguments.observations.first().map(PathBuf::as_path);
            let name = match (set, path) {
                (Some(set), _) => Path::new(set.name()),
                (None, Some(path)) => path,
                (None, None) => first.unwrap_or(Path::new("")),
            };
            judge(&setup, &parameters, &strategy, assumed).map_err(not_judged(name))?
        }
        _ => {
            let strategy =
                arguments.propose(&setup, &parameters, &directions, assumed, other.as_ref())?;
            let path = arguments
                .output
                .as_deref()
                .unwrap_or(Path::new("the proposed strategy"));
            judge(&setup, &parameters, &strategy, assumed).map_err(not_judged(path))?
        }
    };
    arguments.write(&setup, &judgement.strategy)?;
    if judgement.strategy.rows.iter().any(|row| row.spindle != 0.0) {
        eprintln!(
            "note: the strategy turns the spindle (M19){}",
            match machine.can_orient {
                true => "",
                false =>
                    ", which the machine file does not say that it can: write can_be_oriented = true under [spindle] if it can",
            }
        );
    }
    let perfect = ErrorModel::perfect(&machine);
    let problem = Problem::new(
        &machine,
        &judgement.strategy,
        &artefact,
        &parameters,
        &perfect,
    )
    .with(&observations);
    let missing = problem.missing().map_err(|error| {
        BadInput::new(
            error.to_string(),
            "correct the strategy, or where the balls are in the artefact",
        )
    })?;
    if !missing.is_empty() {
        eprintln!("warning: {}", lacks(&machine, &parameters, &missing));
    }
    let minutes = judgement.strategy.rows.len() as f64 * arguments.seconds / 60.0;
    if arguments.json {
        let left_out = positions.map(|positions| positions.left_out);
        let answer = Answer::new(&setup, &judgement, other.as_ref(), minutes).lacking(&missing);
        files::print_json(&answer.leaving_out(&left_out.unwrap_or_default()))?;
    } else {
        files::print(&screen(&setup, &judgement, other.as_ref(), minutes))?;
    }
    Ok(Outcome::Done)
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
    fn qualifying(&self, setup: &Setup<'_>, strategy: &Probings) -> Result<Outcome, BadInput> {
        let touches = |row: &Probing| {
            let own = Setup {
                balls: strategy.balls.clone(),
                ..setup.clone()
            };
            own.touching(row).map(|touching| touching.touches.len())
        };
        let mut all = 0;
        for row in &strategy.rows {
            all += touches(row).map_err(|why| not_reached((row.clone(), why), strategy))?;
        }
        let machine = &setup.machine.name;
        let rows = strategy.rows.len();
        match self.json {
            true => files::print_json(&Qualifying {
                machine,
                rows,
                touches: all,
            })?,
            false => files::print(&format!(
                "{machine}: {all} touches at {}, to qualify the probe (trueaxis qualify)\n",
                count(rows, "position")
            ))?,
        }
        Ok(Outcome::Done)
    }

    fn prepare(&self) -> Result<(), BadInput> {
        let inputs = [
            Some(&self.machine),
            self.artefact.as_ref(),
            self.strategy.as_ref(),
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
            files::prepare(output, &inputs)?;
        }
        Ok(())
    }

    fn setup<'a>(
        &self,
        machine: &'a Machine,
        artefact: &'a Artefact,
        observations: &'a Observations,
    ) -> Result<Setup<'a>, BadInput> {
        let place = self.artefact.as_deref().unwrap_or(Path::new("")).display();
        let known: Vec<String> = (artefact.balls.iter())
            .filter(|b| b.nominal.is_some())
            .map(|b| b.name.clone())
            .collect();
        let balls = if self.balls.is_empty() {
            match self.set {
                Some(Set::ChaseTheBall) => known.iter().take(1).cloned().collect(),
                _ => known.clone(),
            }
        } else {
            self.balls.clone()
        };
        if let Some(ball) = balls.iter().find(|b| !known.contains(b)) {
            return Err(BadInput::new(
                format!("{place}: ball `{ball}` is not there, or has no nominal_mm"),
                "write [[ball]] with name and nominal_mm for every ball that --balls names",
            ));
        }
        if let Some(ball) = (1..balls.len()).find(|i| balls[..*i].contains(&balls[*i])) {
            return Err(BadInput::new(
                format!("--balls names {} twice", balls[ball]),
                "name every ball once",
            ));
        }
        if balls.is_empty() && self.artefact.is_some() {
            return Err(BadInput::new(
                format!("{place}: there is no ball with nominal_mm"),
                "write [[ball]] with name and nominal_mm for every ball",
            ));
        }
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
        let strategy = files::read_instruments(&self.observations, machine)?;
        expected(machine, &strategy, assumed, self.noise * 1e-3).map_err(|error| {
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

    /// The axes whose direction of approach will be known: those stated in the strategy, or those whose backlash is
    /// identified.
    fn directions(
        &self,
        machine: &Machine,
        model: &Model,
        given: Option<&Probings>,
        observations: &Observations,
    ) -> Result<Vec<bool>, BadInput> {
        if let Some(strategy) = given {
            let probed = strategy.rows.iter().map(|row| &row.direction);
            let all = probed.chain(observations.rows.iter().map(|row| &row.direction));
            let of = |i: usize| all.clone().any(|direction| direction[i] != 0.0);
            return Ok((0..machine.axes.len()).map(of).collect());
        }
        let none = vec![false; machine.axes.len()];
        if *model == Model::Auto {
            return Ok(none);
        }
        let parameters = model
            .parameters(machine, self.degree, &none)
            .map_err(no_model)?;
        let backlash = |letter: char| {
            let of = |p: &Parameter| p.axis == letter && p.kind == ParameterKind::Backlash;
            parameters.iter().any(of)
        };
        Ok((machine.axes.iter())
            .map(|a| a.letter.is_rotary() && backlash(a.letter.char()))
            .collect())
    }

    /// A position set, with the positions that were left out.
    fn positions(&self, setup: &Setup<'_>, set: Set) -> Result<Positions, BadInput> {
        let found = positions(setup, set);
        let found = found.map_err(|error| BadInput::new(error.to_string(), error.remedy()))?;
        if let Some((ball, _, reason)) = found.left_out.first() {
            let all = found.strategy.rows.len() + found.left_out.len();
            eprintln!(
                "note: {} of the {all} probings of {set} are left out, the first of ball {ball}: {reason}",
                found.left_out.len()
            );
        }
        Ok(found)
    }

    fn propose(
        &self,
        setup: &Setup<'_>,
        parameters: &[Parameter],
        directions: &[bool],
        assumed: &ErrorModel,
        other: Option<&Judgement>,
    ) -> Result<Probings, BadInput> {
        let machine = setup.machine;
        let mut allowed = Allowed::of(machine, directions);
        if let Some(text) = &self.indexings {
            allowed
                .restrict(machine, text)
                .map_err(|e| BadInput::new(format!("--indexings: {e}"), e.remedy))?;
        }
        let is_said = |text: &String| text.split(',').any(|part| part.trim().starts_with("S="));
        if !self.indexings.as_ref().is_some_and(is_said) {
            let needs =
                needs_spindle(setup, &allowed, parameters, assumed).map_err(not_designed)?;
            if machine.can_orient && !needs.is_empty() {
                allowed.index_spindle();
            } else if !needs.is_empty() {
                eprintln!("{}", not_oriented(machine, &needs));
            }
        }
        if let Some(other) = other {
            let criterion = self.best_for;
            let found = as_good_as(setup, &allowed, parameters, assumed, other, criterion);
            let found = found.map_err(not_designed)?;
            if !found.is_whole {
                eprintln!("note: the search was ended: fewer probings may do");
            }
            return found.strategy.ok_or_else(|| {
                BadInput::new(
                    format!(
                        "no measurement plan with {} probings or fewer identifies all parameters as well",
                        other.strategy.rows.len()
                    ),
                    "allow more positions (--indexings, --balls, --cone), or judge the strategy itself with --strategy",
                )
            });
        }
        let minutes = self
            .minutes
            .map(|minutes| (minutes * 60.0 / self.seconds) as usize);
        let wanted = |rank: usize| Wanted {
            probings: minutes.or(self.probings).unwrap_or(rank),
            criterion: self.best_for,
        };
        design(setup, &allowed, parameters, assumed, wanted).map_err(not_designed)
    }

    fn write(&self, setup: &Setup<'_>, strategy: &Probings) -> Result<(), BadInput> {
        // Do everything that can fail first, so that no file is written without the others.
        let not_reached = |why: NotTouched| not_reached(*why, strategy);
        let feeds = Feeds {
            touch: self.feed,
            near: self.approach,
        };
        let program = (self.program.as_ref())
            .map(|path| linuxcnc(setup, strategy, feeds, &self.log).map(|text| (path, text)));
        let table = self
            .table
            .as_ref()
            .map(|path| table(setup, strategy).map(|text| (path, text)));
        let written = (self.output.as_ref())
            .map(|path| (path, probings::write_strategy(strategy, setup.machine)));
        let program = program.transpose().map_err(not_reached)?;
        let table = table.transpose().map_err(not_reached)?;
        if program.is_some() || table.is_some() {
            let steps = steps(setup, strategy).map_err(not_reached)?;
            if let Some(collision) = collision(setup, strategy, &steps) {
                return Err(collides(&collision));
            }
        }
        for (path, text) in [written, program, table].into_iter().flatten() {
            files::write(path, text.as_bytes())?;
        }
        Ok(())
    }
}

/// A move on which two solids would come too close.
pub fn collides(collision: &Collision) -> BadInput {
    BadInput::new(
        collision.to_string(),
        "leave this row out (--indexings), place the balls elsewhere, or correct the solids of machine file and artefact: nothing was written, and nothing has moved",
    )
}

/// A row that cannot be touched.
pub fn not_reached((row, reason): (Probing, Unreachable), strategy: &Probings) -> BadInput {
    BadInput::new(
        format!(
            "line {} of the strategy: ball {} cannot be touched: {reason}",
            row.line, strategy.balls[row.ball]
        ),
        "leave this row out, or allow it: --cone, --clearance, --keep-apart, the balls' away_from_table, the range of the axis",
    )
}

/// What turning the spindle would have identified.
fn not_oriented(machine: &Machine, needs: &[Parameter]) -> String {
    let each = needs.iter().map(|p| {
        if p.kind != ParameterKind::Inter {
            return p.to_string();
        }
        let effect = effect_over_travel(machine, *p);
        match p.is_angular() {
            true => format!(
                "{p} (10 µrad move the tip by up to {:.1} µm over the travel)",
                effect * 1e-2
            ),
            false => format!(
                "{p} (10 µm move the tip by up to {:.1} µm over the travel)",
                effect * 10.0
            ),
        }
    });
    format!(
        "note: the spindle is not turned, for the machine file does not say that it can be oriented; that would show {}. If it can (M19), write can_be_oriented = true under [spindle]; if not, zero the stylus for run-out and state x_mm and y_mm with their standard uncertainties under [stylus] in the artefact",
        each.collect::<Vec<_>>().join(", ")
    )
}

fn not_designed(error: DesignError) -> BadInput {
    let remedy = match &error {
        DesignError::NothingReached { .. } | DesignError::NothingAllowed => {
            "allow more: --indexings, --cone, the balls' nominal_mm and away_from_table, the range of the axis"
                .to_owned()
        }
        DesignError::TooFew { least, .. } => {
            format!("give --probings {least} or more, or more --minutes, or a model with fewer parameters")
        }
        DesignError::TooFewPositions { .. } => {
            "allow more positions (--indexings, --cone), or give a model with fewer parameters".to_owned()
        }
    };
    BadInput::new(error.to_string(), remedy)
}
