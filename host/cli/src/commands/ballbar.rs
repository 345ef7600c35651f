//! `trueaxis ballbar`

mod analyse;
mod answer;
mod path;
mod simulate;

use super::Outcome;
use super::bad_input::BadInput;
use super::number::positive;
use super::position_argument;
use clap::{Args, Subcommand};
use trueaxis_direct::ballbar::{BallBar, Hemisphere, PathPoint};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;

/// Test a machine with a ball-bar: write the path, predict or analyse readings
///
/// The path is a hemisphere (five half meridians, each travelled both ways, and the equator between them, as in the
/// source document) or circles (ISO 230-4).
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: BallbarCommand,
}

#[derive(Subcommand)]
enum BallbarCommand {
    Path(path::BallBarPath),
    Simulate(simulate::Simulate),
    Analyse(analyse::Analyse),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        BallbarCommand::Path(path) => path.run(),
        BallbarCommand::Simulate(simulate) => simulate.run(),
        BallbarCommand::Analyse(analyse) => analyse.run(),
    }
}

/// The path and its centre.
#[derive(Args)]
struct SimulatedTest {
    /// Centre of the path: machine positions of the axes; axes left out are at 0
    #[arg(long, value_name = "X=0,Y=0,Z=-200", allow_hyphen_values = true)]
    at: String,
    /// Length of the bar
    #[arg(long, value_name = "mm", default_value_t = 150.0, value_parser = positive)]
    radius: f64,
    /// Number of half meridians, evenly spaced over half a turn
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=180))]
    meridians: u32,
    /// Steps per half meridian: 1800 means 0.1 degrees each
    #[arg(long, default_value_t = 1800, value_parser = clap::value_parser!(u32).range(2..=36_000))]
    steps: u32,
}

impl SimulatedTest {
    fn path(&self) -> Result<Vec<PathPoint>, BadInput> {
        let hemisphere = Hemisphere {
            radius: self.radius,
            meridians: self.meridians,
            steps: self.steps,
        };
        hemisphere.path().map_err(|error| {
            BadInput::new(
                error.to_string(),
                "make --steps an even multiple of --meridians: 1800 for 5, 1800 for 6, 1400 for 7",
            )
        })
    }

    /// Sets up the bar and checks that the axes reach the whole path.
    fn bar<'b>(&self, bench: &'b Bench<'b>, path: &[PathPoint]) -> Result<BallBar<'b>, BadInput> {
        let machine: &Machine = bench.machine;
        let centre = position_argument::position("--at", &self.at, machine)?;
        let axes = BallBar::axes(machine).ok_or_else(|| {
            BadInput::new(
                format!("{} has no three axes X, Y and Z", machine.name),
                "the path of a hemisphere is written for axes of these names",
            )
        })?;
        let bar = BallBar::new(bench, axes, centre);
        bar.reaches(path).map_err(|error| {
            BadInput::new(
                error.to_string(),
                "give another centre (--at) or a shorter bar (--radius)",
            )
        })?;
        Ok(bar)
    }
}
