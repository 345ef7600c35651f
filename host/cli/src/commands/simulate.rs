//! `trueaxis simulate`

mod ballbar;
#[cfg(not(target_family = "wasm"))]
mod controller;
mod disturbed;
mod observations;
mod runs;
mod touches;

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, MachineFiles};
use super::monte_carlo;
use super::number::{finite, percent, size, three};
use super::output;
use super::quantity::count;
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use trueaxis_identify::formats::probings;
use trueaxis_identify::simulate::{self, Disturbances, SimulateError, compensated, corrections};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::belongs;

/// Simulate measurements of a machine with known errors, or a controller
///
/// Use it to try a plan before measuring, to test an identification against known values, or to try a controller
/// without a board.
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: SimulateCommand,
}

#[derive(Subcommand)]
enum SimulateCommand {
    Probings(SimulatedProbings),
    Observations(observations::SimulatedObservations),
    Touches(touches::Touches),
    Laser(runs::Laser),
    Square(runs::SimulatedSquare),
    Ballbar(ballbar::Ballbar),
    Identifications(monte_carlo::Arguments),
    #[cfg(not(target_family = "wasm"))]
    Controller(controller::ControllerArguments),
}

/// Simulate probings: axis positions with the stylus on the balls
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate probings machine.toml errors.toml --artefact artefact.toml --plan plan.csv --noise 1 -o probings.csv\n  \
trueaxis simulate probings machine.toml errors.toml --artefact artefact.toml --plan plan.csv --active machine.trax -o after.csv\n\n\
The plan has a header and a line for each probing, without linear axes; S indexes the spindle, A_dir is\n\
the direction from which an axis arrived:\n  ball,A,C\n  1,15,60\n  1,30,180"
)]
struct SimulatedProbings {
    #[command(flatten)]
    files: MachineFiles,
    /// Positions of the balls (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: PathBuf,
    /// Which ball is probed at which rotary positions (CSV)
    #[arg(long, value_name = "FILE.csv")]
    plan: PathBuf,
    /// Where to write the probings (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Standard deviation of each coordinate of a probing
    #[arg(long, value_name = "µm", default_value_t = 0.0, value_parser = size)]
    noise: f64,
    /// Drift of the workpiece along x, y and z from the first to the last probing
    #[arg(
        long,
        value_name = "µm,µm,µm",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = finite
    )]
    drift: Vec<f64>,
    /// Time constant with which the drift ends, as a part of the whole time (default: linear drift)
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0, value_parser = size, requires = "drift", hide_default_value = true)]
    drift_lag: f64,
    /// Percentage of probings that are outliers
    #[arg(long, value_name = "%", default_value_t = 0.0, value_parser = percent)]
    outliers: f64,
    /// Size of an outlier
    #[arg(long, value_name = "µm", default_value_t = 100.0, value_parser = size)]
    outlier: f64,
    /// The compensation that is on while probing; the probings then show the remaining errors
    #[arg(long, value_name = "FILE.trax")]
    active: Option<PathBuf>,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn not_simulated(plan: &Path, error: &SimulateError) -> BadInput {
    BadInput::new(
        format!("{}: {error}", plan.display()),
        "correct the plan, or where the balls are in the artefact",
    )
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        SimulateCommand::Probings(probings) => probings.run(),
        SimulateCommand::Observations(observations) => observations.run(),
        SimulateCommand::Touches(touches) => touches.run(),
        SimulateCommand::Laser(laser) => laser.run(),
        SimulateCommand::Square(square) => square.run(),
        SimulateCommand::Ballbar(ballbar) => ballbar.run(),
        SimulateCommand::Identifications(arguments) => monte_carlo::run(arguments),
        #[cfg(not(target_family = "wasm"))]
        SimulateCommand::Controller(controller) => controller.run(),
    }
}

impl SimulatedProbings {
    fn run(&self) -> Result<Outcome, BadInput> {
        let mut inputs: Vec<&Path> = vec![
            &self.files.machine,
            &self.files.errors,
            &self.artefact,
            &self.plan,
        ];
        inputs.extend(self.active.as_deref());
        if let Some(output) = &self.output {
            output::prepare(output, &inputs)?;
        }
        let drift = three(&self.drift, "--drift", "µm")?;
        let (machine, errors) = self.files.read()?;
        let artefact = files::read_artefact(&self.artefact, &machine)?;
        let plan = files::read_plan(&self.plan, &machine)?;
        let disturbances = self.disturbances(drift);
        let kinematics = Kinematics::new(&machine, &errors);
        let measured = match &self.active {
            None => simulate::probings(&kinematics, &artefact, &plan, &disturbances),
            Some(path) => {
                let blob = files::read_blob(path)?;
                let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
                belongs(&machine, &errors, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
                let added = |rows: &[_]| Ok(corrections(&machine, &runtime, rows));
                compensated(&kinematics, &artefact, &plan, &disturbances, added)
            }
        };
        let measured = measured.map_err(|error| not_simulated(&self.plan, &error))?;
        let csv = probings::write(&measured, &machine);
        let balls = count(measured.balls.len(), "ball");
        let said = format!("{} probings of {balls}", measured.rows.len());
        output::write_or_print(self.output.as_deref(), &csv, &said)?;
        Ok(Outcome::Done)
    }

    /// What disturbs the probings, with a drift in µm, in the units of the model.
    fn disturbances(&self, drift: [f64; 3]) -> Disturbances {
        Disturbances {
            noise: self.noise * 1e-3,
            drift: drift.map(|v| v * 1e-3),
            drift_lag: self.drift_lag,
            outliers: self.outliers * 1e-2,
            outlier: self.outlier * 1e-3,
            seed: self.seed,
        }
    }
}
