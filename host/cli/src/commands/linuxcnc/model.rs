//! `trueaxis linuxcnc model`

use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files::{self, MachineFiles};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_kinematics::Stored;

/// Write the file from which HAL simulates a machine with errors
///
/// The component `trueaxis_model` reads the file and shows on its pins where the tool really is, so that a simulated
/// machine shows what a compensation does.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis linuxcnc model machine.toml errors.toml -o machine.model"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// Where to write the model
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Answer<'a> {
    file: &'a Path,
    machine: &'a str,
    axes: &'a str,
    bytes: usize,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        output,
        json,
    } = arguments;
    files::prepare(output, &[&files.machine, &files.errors])?;
    let (machine, errors) = files.read()?;
    if let Some(lagging) = errors.sensors.iter().find(|s| s.lag > 0.0) {
        return Err(BadInput::new(
            format!(
                "{}: `{}` has a lag, which a model cannot have",
                files.errors.display(),
                lagging.sensor
            ),
            "leave out lag_s: the model has the temperature of its pin at once",
        ));
    }
    let references: Vec<f64> = errors.sensors.iter().map(|s| s.reference_celsius).collect();
    let model = Stored::write(&machine.name, &machine, &errors, &references).ok_or_else(|| {
        BadInput::new(
            format!(
                "{}: too many measured values for a model",
                files.errors.display()
            ),
            "leave out measured values: a file holds four thousand million bytes",
        )
    })?;
    files::write(output, &model)?;
    let axes: String = machine.axes.iter().map(|a| a.letter.char()).collect();
    let answer = Answer {
        file: output,
        machine: &machine.name,
        axes: &axes,
        bytes: model.len(),
    };
    if *json {
        files::print_json(&answer)?;
    } else {
        files::print(&format!(
            "{}: {} with axes {axes}, {} bytes\n",
            output.display(),
            machine.name,
            model.len()
        ))?;
    }
    Ok(Outcome::Done)
}
