//! `trueaxis linuxcnc model`

use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files::MachineFiles;
use crate::commands::output;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_kinematics::{Sensor, Stored};
use trueaxis_model::errors::Thermal;

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
struct LinuxCncModelAnswer<'a> {
    file: &'a Path,
    machine: &'a str,
    axes: &'a str,
    bytes: usize,
    /// The sensor of each temperature pin.
    temperatures: Vec<&'a str>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        files,
        output,
        json,
    } = arguments;
    output::prepare(output, &[&files.machine, &files.errors])?;
    let (machine, errors) = files.read()?;
    let (names, stored) = followed(&errors.sensors);
    let model = Stored::write(&machine.name, &machine, &errors, &stored).ok_or_else(|| {
        BadInput::new(
            format!(
                "{}: too many measured values for a model",
                files.errors.display()
            ),
            "leave out measured values: a file holds four thousand million bytes",
        )
    })?;
    output::write(output, &model)?;
    let axes: String = machine.axes.iter().map(|a| a.letter.char()).collect();
    let answer = LinuxCncModelAnswer {
        file: output,
        machine: &machine.name,
        axes: &axes,
        bytes: model.len(),
        temperatures: names.clone(),
    };
    output::print_answer(*json, &answer, || {
        format!(
            "{}: {} with axes {axes}, {} bytes{}\n",
            output.display(),
            machine.name,
            model.len(),
            pins(&names)
        )
    })?;
    Ok(Outcome::Done)
}

/// The names of temperatures, and the sensors that follow them.
fn followed(sensors: &[Thermal]) -> (Vec<&str>, Vec<Sensor>) {
    let mut names: Vec<&str> = Vec::new();
    for sensor in sensors {
        if !names.contains(&sensor.sensor.as_str()) {
            names.push(&sensor.sensor);
        }
    }
    let reading = |sensor: &Thermal| names.iter().position(|name| *name == sensor.sensor);
    let stored = sensors.iter().map(|sensor| Sensor {
        reading: reading(sensor).unwrap_or_default(),
        reference: sensor.reference_celsius,
        lag: sensor.lag,
    });
    let stored = stored.collect();
    (names, stored)
}

/// Which pin has which temperature, in words.
fn pins(names: &[&str]) -> String {
    let pins = names.iter().enumerate();
    pins.map(|(number, name)| format!(", temperature-{number} is {name}"))
        .collect()
}
