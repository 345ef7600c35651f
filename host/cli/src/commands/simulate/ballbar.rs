//! `trueaxis simulate ballbar`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::MachineFiles;
use super::super::number::positive;
use super::super::output;
use super::disturbed::Disturbed;
use super::runs::{output, position};
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_direct::simulate::ballbar::{SimulatedCircle, circle, write};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::{Axis, Machine};

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
            output::prepare(output, &inputs)?;
        }
        let (machine, errors) = self.files.read()?;
        let bench = Bench::new(&machine, &errors, Default::default());
        let plane = self.axes(&machine)?;
        let centre = position(&bench, self.at.as_deref())?;
        for (index, axis) in machine.axes.iter().enumerate() {
            let is_moved = plane.contains(&index);
            within_travel(
                axis,
                centre[index],
                if is_moved { self.radius } else { 0.0 },
            )?;
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

    /// The axes of the plane.
    fn axes(&self, machine: &Machine) -> Result<[usize; 2], BadInput> {
        let linear = |letter: char| {
            let index = machine.index(letter)?;
            (!machine.axes[index].letter.is_rotary()).then_some(index)
        };
        let axes: Vec<Option<usize>> = self.plane.chars().map(linear).collect();
        let plane = &self.plane;
        match axes[..] {
            [Some(a), Some(b)] if a != b => Ok([a, b]),
            _ => Err(BadInput::new(
                format!("--plane: `{plane}` are no two linear axes of the machine"),
                "write --plane XY",
            )),
        }
    }
}

/// Refuses a circle that goes beyond the travel of an axis.
fn within_travel(axis: &Axis, centre: f64, reach: f64) -> Result<(), BadInput> {
    let ([low, high], letter) = (axis.travel, axis.letter);
    let (from, to) = (centre - reach, centre + reach);
    match from < low || to > high {
        false => Ok(()),
        true => Err(BadInput::new(
            format!("the circle needs {letter} from {from} to {to}, its travel is {low} to {high}"),
            "give another centre (--at) or a shorter bar (--radius)",
        )),
    }
}
