//! `trueaxis import klipper-twist`

use super::height_map::probe_offset;
use crate::commands::export::refused;
use crate::commands::files::Text;
use crate::commands::number::finite;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use std::path::PathBuf;
use trueaxis_export::klipper::kinematics;
use trueaxis_export::klipper::twist::{self, NozzleProbe, TwistErrors};
use trueaxis_model::errors::ErrorModel;

/// Read the twist that Klipper has measured (axis_twist_compensation) as roll of X and Y
///
/// A probe beside the nozzle goes up and down as the axis rolls. The table becomes EAX or EBY as measured motions, relative
/// to their mean; straightness and pitch count as none.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis import klipper-twist printer.cfg --machine machine.toml --probe 0,25 -o errors.toml"
)]
pub struct Arguments {
    /// printer.cfg, or a file with its section [axis_twist_compensation]
    #[arg(value_name = "FILE")]
    table: PathBuf,
    /// Machine description
    #[arg(long, value_name = "machine.toml")]
    machine: PathBuf,
    /// x_offset and y_offset of the probe (default: those in FILE)
    #[arg(long, value_name = "X,Y", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    probe: Vec<f64>,
    /// Where to write the errors
    #[arg(short, long, value_name = "ERRORS.toml")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { table, output, .. } = arguments;
    output::prepare(output, &[table, &arguments.machine])?;
    let machine = files::read_machine(&arguments.machine)?;
    let text = Text::read(table)?;
    kinematics::check(&text.text).map_err(|error| text.bad(error))?;
    let tables = twist::read(&text.text).map_err(|error| text.bad(error))?;
    let perfect = ErrorModel::perfect(&machine);
    let offset = probe_offset(&text, &arguments.probe)?.ok_or_else(|| {
        BadInput::new(
            format!("{}: it does not say where the probe is", text.name),
            "give --probe X,Y: x_offset and y_offset of the probe",
        )
    })?;
    let found = NozzleProbe::new(&machine, &perfect, offset, 0.0)
        .and_then(|probe| TwistErrors::of(&probe, &tables));
    let found = found.map_err(|error| refused(&error, table))?;
    output::write(output, found.text.as_bytes())?;
    let motions = match found.motions[..] {
        [] => "the tables are zero".to_owned(),
        _ => found.motions.join(", "),
    };
    let left_out = found.left_out.iter().map(|why| format!("left out {why}\n"));
    let left_out: String = left_out.collect();
    output::print(&format!("{}: {motions}\n{left_out}", output.display()))?;
    Ok(Outcome::Done)
}
