//! `trueaxis correct`

use super::Outcome;
use super::bad_input::BadInput;
use super::error_source;
use super::eval::EvalAlong;
use super::files::{MachineFiles, Text};
use super::policy::PolicyArguments;
use clap::Args;
use trueaxis_model::formats::csv;
use trueaxis_model::motion;
use trueaxis_model::positions::ColumnInput;

/// Compute the exact kinematic correction at positions, without tables
///
/// Rows are taken as a motion in their order, which gives the direction of travel, with the reversal threshold of the
/// machine file. Corrections are dX,dY,… in the order of the machine's axes. Prints a warning for an axis outside
/// its travel.
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
    along: EvalAlong,
    #[command(flatten)]
    policy: PolicyArguments,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        along,
        policy,
    } = arguments;
    let (machine, errors) = files.read()?;
    let inputs = ColumnInput::of_machine(&machine, &errors.sensors);
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

/// Rounds a correction to 1e-10 mm or deg: finer than the iteration of the kinematic correction, and coarse enough
/// to print the same digits on every system, although mathematical libraries differ by 1e-13.
fn rounded(correction: f64) -> f64 {
    // Adding 0 turns -0 into 0.
    (correction * 1e10).round() / 1e10 + 0.0
}
