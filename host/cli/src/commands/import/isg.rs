//! `trueaxis import isg`

use crate::commands::files::Text;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use std::path::PathBuf;
use trueaxis_export::isg::{self, IsgParameters};

/// Read error parameters for ISG and Beckhoff (TF5280): their CSV, or the exchange format of Etalon (Vendor)
///
/// Tables become measured error motions, locations of rotary axes parameters, and squareness the slope of straightness.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis import isg measured.txt --machine machine.toml -o errors.toml"
)]
pub struct Arguments {
    /// The parameters; which format it is shows in the file
    #[arg(value_name = "FILE")]
    parameters: PathBuf,
    /// Machine description
    #[arg(long, value_name = "machine.toml")]
    machine: PathBuf,
    /// Where to write the errors
    #[arg(short, long, value_name = "ERRORS.toml")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        parameters: path,
        output,
        ..
    } = arguments;
    output::prepare(output, &[path, &arguments.machine])?;
    let machine = files::read_machine(&arguments.machine)?;
    let text = Text::read(path)?;
    let parameters = match isg::is_etalon(&text.text) {
        true => IsgParameters::read_etalon(&text.text),
        false => IsgParameters::read_csv(&text.text),
    };
    let errors = parameters.and_then(|parameters| isg::imported(&parameters, &machine));
    let (errors, notes) = errors.map_err(|error| text.bad(error))?;
    output::write(output, errors.as_bytes())?;
    let count = errors.matches("[tabulated.").count();
    let notes: String = notes.iter().map(|note| format!("{note}\n")).collect();
    let shown = output.display();
    output::print(&format!("{shown}: {count} error motions\n{notes}"))?;
    Ok(Outcome::Done)
}
