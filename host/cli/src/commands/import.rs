//! `trueaxis import …`

mod cec;
mod height_map;
mod isg;
mod points;
mod twist;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};

/// Read the compensation or the measurements of another controller
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: ImportCommand,
}

#[derive(Subcommand)]
enum ImportCommand {
    Cec(cec::Arguments),
    Isg(isg::Arguments),
    /// Read a stored profile of Klipper's bed_mesh as observations
    ///
    /// Each point becomes a displacement along Z for `identify --observations`: if the surface is flat, the machine
    /// causes its heights.
    #[command(
        after_help = "Example:\n  trueaxis import klipper printer.cfg --machine machine.toml -o bed.csv"
    )]
    Klipper(height_map::OfProfile),
    KlipperTwist(twist::Arguments),
    /// Read a height map of RepRapFirmware (heightmap.csv) as observations
    ///
    /// Each point that was probed becomes a displacement along Z for `identify --observations`: if the surface is flat, the
    /// machine causes its heights.
    #[command(
        name = "reprapfirmware",
        after_help = "Example:\n  trueaxis import reprapfirmware heightmap.csv --machine machine.toml -o bed.csv"
    )]
    RepRapFirmware(height_map::Arguments),
    Points(points::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        ImportCommand::Cec(arguments) => cec::run(arguments),
        ImportCommand::Isg(arguments) => isg::run(arguments),
        ImportCommand::Klipper(arguments) => height_map::klipper(arguments),
        ImportCommand::KlipperTwist(arguments) => twist::run(arguments),
        ImportCommand::RepRapFirmware(arguments) => height_map::reprapfirmware(arguments),
        ImportCommand::Points(arguments) => points::run(arguments),
    }
}
