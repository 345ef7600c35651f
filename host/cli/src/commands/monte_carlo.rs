//! `trueaxis simulate identifications`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, MachineFiles};
use super::identify::no_model;
use super::number::positive;
use super::output;
use super::progress::ProgressBarOnScreen;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use trueaxis_identify::{Model, MonteCarloOutcome, Normalised, Trial, TrialError, monte_carlo};
use trueaxis_model::validate::is_partly_calibrated;
use trueaxis_tables::compile::Progress;

/// Repeat an identification of simulated probings and compare with the truth
///
/// Each repetition has other noise, and lengths of bars and stylus that are off within their uncertainty. Shows how
/// far parameters are off, in units of the standard uncertainty that the identification states, and how often the
/// remaining volumetric error is inside its 95 % interval.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate identifications machine.toml errors.toml --artefact artefact.toml --plan plan.csv --model 10 --seeds 1000"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// Positions of the balls (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: PathBuf,
    /// Which ball is probed at which rotary positions (CSV)
    #[arg(long, value_name = "FILE.csv")]
    plan: PathBuf,
    /// Parameters to identify
    #[arg(long, default_value = "auto", value_name = "10|12|13|81|84|auto|NAMES")]
    model: String,
    /// Standard deviation of each coordinate of a probing
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    noise: f64,
    /// Number of repetitions
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    seeds: u32,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct MonteCarloAnswer<'a> {
    machine: &'a str,
    identifications: usize,
    noise_um: f64,
    found_noise_um: f64,
    parameters: Vec<ParameterScatter>,
    positions: usize,
    tips_inside: f64,
    directions_inside: f64,
    least_inside: f64,
}

/// The error of a parameter, divided by its stated standard uncertainty.
#[derive(Serialize)]
struct ParameterScatter {
    parameter: String,
    standard_uncertainty: f64,
    mean: f64,
    standard_deviation: f64,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine, errors) = arguments.files.read()?;
    if is_partly_calibrated(&machine, &errors) {
        eprintln!(
            "warning: error motions of this machine keep their end values in a part of the travel; the identified ones do not, and are wrong there"
        );
    }
    let artefact = files::read_artefact(&arguments.artefact, &machine)?;
    let plan = files::read_plan(&arguments.plan, &machine)?;
    let model: Model = arguments.model.parse().map_err(no_model)?;
    let trial = Trial {
        machine: &machine,
        errors: &errors,
        artefact: &artefact,
        plan: &plan,
        model: &model,
        noise: arguments.noise * 1e-3,
    };
    let bar = ProgressBarOnScreen::new();
    bar.stage("identifying", arguments.seeds as usize);
    let step = || bar.step();
    let found = monte_carlo(&trial, arguments.seeds as usize, &step)
        .map_err(|error| arguments.failed(error))?;
    drop(bar);
    output::print_answer(
        arguments.json,
        &MonteCarloAnswer::new(arguments, &machine.name, &found),
        || screen(arguments, &machine.name, &found),
    )?;
    Ok(Outcome::Done)
}

impl Arguments {
    fn failed(&self, error: TrialError) -> BadInput {
        let message = format!("{}: {error}", self.plan.display());
        match error {
            TrialError::Model(error) => no_model(error),
            TrialError::Identify(error) => BadInput::new(message, error.remedy()),
            TrialError::Simulate(_) => BadInput::new(
                message,
                "correct the plan, or where the balls are in the artefact",
            ),
            TrialError::Far { .. } => BadInput::new(message, "give less --noise"),
        }
    }
}

fn part(inside: usize, of: usize) -> f64 {
    inside as f64 / of as f64
}

impl<'a> MonteCarloAnswer<'a> {
    fn new(arguments: &Arguments, machine: &'a str, found: &MonteCarloOutcome) -> Self {
        let one = |p: &Normalised| ParameterScatter {
            parameter: p.parameter.to_string(),
            standard_uncertainty: p.uncertainty,
            mean: p.mean,
            standard_deviation: p.deviation,
        };
        Self {
            machine,
            identifications: found.seeds,
            noise_um: arguments.noise,
            found_noise_um: found.noise * 1e3,
            parameters: found.parameters.iter().map(one).collect(),
            positions: found.positions,
            tips_inside: part(found.tips_inside, found.positions),
            directions_inside: part(found.directions_inside, found.positions),
            least_inside: found.least_inside,
        }
    }
}

fn screen(arguments: &Arguments, machine: &str, found: &MonteCarloOutcome) -> String {
    let mut text = format!(
        "{machine}: {} identifications of {} parameters, {} µm of noise; {:.3} µm were found\n\n",
        found.seeds,
        found.parameters.len(),
        arguments.noise,
        found.noise * 1e3
    );
    text += "errors of parameters, in standard uncertainties      mean   standard deviation\n";
    for p in &found.parameters {
        text += &format!(
            "  {:<48}{:>7.2}{:>21.3}\n",
            p.parameter.to_string(),
            p.mean,
            p.deviation
        );
    }
    text += &format!(
        "\ninside the 95 % interval of the volumetric error, of {} positions: tip {:.2} %, direction {:.2} %\n",
        found.positions,
        100.0 * part(found.tips_inside, found.positions),
        100.0 * part(found.directions_inside, found.positions)
    );
    text
}
