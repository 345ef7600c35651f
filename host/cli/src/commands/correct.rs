//! `trueaxis correct`

use super::Outcome;
use super::bad_input::BadInput;
use super::error_source;
use super::eval::Along;
use super::files::{MachineFiles, Text};
use super::policy::PolicyArguments;
use clap::Args;
use trueaxis_model::formats::csv;
use trueaxis_model::motion;
use trueaxis_model::positions::Input;

/// Compute the exact kinematic correction at positions, without tables
///
/// The rows in order are the motion: they give the direction of travel, with the hysteresis of the
/// machine file. Corrections are dX,dY,… in the order of the machine's axes. An axis outside its travel
/// gets a warning.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis correct machine.toml errors.toml --positions path.csv -o corrections.csv\n\n\
Positions: a header with the axis letters in any order, further inputs by name: `tool length` or\n\
`length` (mm) if the machine has length_range_mm, the temperature sensors of the error file by their\n\
name (K from their reference). One position per line, mm and degrees:\n  X,Y,Z,A,C\n  10.5,-20,0,30,90"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    #[command(flatten)]
    along: Along,
    #[command(flatten)]
    policy: PolicyArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        along,
        policy,
    } = arguments;
    let (machine, errors) = files.read()?;
    let sensors = errors.sensors.iter().map(|s| s.sensor.as_str());
    let inputs = Input::of_machine(&machine, sensors);
    let rows = along.read(&inputs, &[&files.machine, &files.errors])?;
    let corrections = motion::correct(&machine, &errors, policy.kinematic()?, &rows).map_err(
        |(row, error)| {
            let place = match Text::read(&along.positions).ok() {
                Some(text) => csv::line_of(&text.text, row),
                None => None,
            };
            let line = place.map_or(String::new(), |line| format!(", line {line}"));
            let message = format!("{error} ({}{line})", along.positions.display());
            error_source::not_converged(&message, files, &machine, &errors)
        },
    )?;
    let corrections: Vec<Vec<f64>> = corrections
        .iter()
        .map(|row| row.iter().copied().map(rounded).collect())
        .collect();
    let letters: Vec<char> = machine.axes.iter().map(|a| a.letter.char()).collect();
    let outside = motion::outside_machine(&machine, &rows);
    along.write(policy.stored()?, &letters, &corrections, &outside)
}

/// A correction to 1e-10 mm or deg: finer than the kinematic correction is iterated, and coarse
/// enough for the same digits on every system, whose mathematical libraries differ by 1e-13.
fn rounded(correction: f64) -> f64 {
    // Adding 0 makes -0 to 0.
    (correction * 1e10).round() / 1e10 + 0.0
}
