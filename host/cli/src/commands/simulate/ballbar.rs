//! `trueaxis simulate ballbar`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::{self, MachineFiles};
use super::super::number::positive;
use super::disturbed::Disturbed;
use super::runs::{output, position};
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_measure::simulate::ballbar::{SimulatedCircle, circle, write};
use trueaxis_model::explain::Bench;

/// Simulate a circular test (ISO 230-4) with a ball-bar, in both directions
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis simulate ballbar machine.toml errors.toml --plane XY --at X=250,Y=150,Z=-40 --radius 100 -o circle.csv\n\n\
Writes angle (degrees, from the first axis towards the second) and radial deviation (µm) counter-clockwise\n\
and clockwise. The bar is set up in the centre. How fast it moves is not simulated."
)]
pub struct Ballbar {
    #[command(flatten)]
    files: MachineFiles,
    /// The two axes that move
    #[arg(long, value_name = "XY")]
    plane: String,
    /// Axis positions at the centre [default: zero, or as near to it as the axes can reach]
    #[arg(long, value_name = "X=250,Y=150", allow_hyphen_values = true)]
    at: Option<String>,
    /// Length of the bar
    #[arg(long, value_name = "mm", default_value_t = 100.0, value_parser = positive)]
    radius: f64,
    /// Number of readings in each direction
    #[arg(long, default_value_t = 360, value_parser = clap::value_parser!(u32).range(4..=100_000))]
    readings: u32,
    #[command(flatten)]
    disturbed: Disturbed,
    /// Where to write the readings (CSV; default: standard output)
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

impl Ballbar {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        let inputs: [&Path; 2] = [&self.files.machine, &self.files.errors];
        if let Some(output) = &self.output {
            files::prepare(output, &inputs)?;
        }
        let (machine, errors) = self.files.read()?;
        let bench = Bench::new(&machine, &errors, Default::default());
        let linear = |letter: char| {
            let index = machine.index(letter)?;
            (!machine.axes[index].letter.is_rotary()).then_some(index)
        };
        let axes: Vec<Option<usize>> = self.plane.chars().map(linear).collect();
        let plane = match axes[..] {
            [Some(a), Some(b)] if a != b => [a, b],
            _ => {
                return Err(BadInput::new(
                    format!(
                        "--plane: `{}` are no two linear axes of the machine",
                        self.plane
                    ),
                    "write --plane XY",
                ));
            }
        };
        let centre = position(&bench, self.at.as_deref())?;
        for (index, axis) in machine.axes.iter().enumerate() {
            let reach = if plane.contains(&index) {
                self.radius
            } else {
                0.0
            };
            let [low, high] = axis.travel;
            if centre[index] - reach < low || centre[index] + reach > high {
                return Err(BadInput::new(
                    format!(
                        "the circle needs {} from {} to {}, its travel is {low} to {high}",
                        axis.letter,
                        centre[index] - reach,
                        centre[index] + reach
                    ),
                    "give another centre (--at) or a shorter bar (--radius)",
                ));
            }
        }
        let test = SimulatedCircle {
            plane,
            centre: machine.to_kinematic(&centre),
            radius: self.radius,
            count: self.readings,
        };
        let disturbed = self.disturbed.of_readings(1e-3);
        let all = circle(&bench, &test, &disturbed);
        output(self.output.as_deref(), &write(&machine, &test, &all))
    }
}
