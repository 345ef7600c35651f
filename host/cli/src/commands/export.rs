//! `trueaxis export …`

mod cec;
mod skew;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};
use trueaxis_controllers::skew::Firmware;

/// Write a compensation as the tables of another controller
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Cec(cec::Arguments),
    /// Write the squareness of a three-axis machine for Klipper (SET_SKEW)
    ///
    /// Klipper corrects nothing but squareness: what is left is printed, and more than the tolerance is refused.
    #[command(
        after_help = "Example:\n  trueaxis export klipper machine.trax -o skew.cfg --best-effort"
    )]
    Klipper(skew::Arguments),
    /// Write the squareness of a three-axis machine for Marlin (M852)
    ///
    /// Marlin corrects nothing but squareness: what is left is printed, and more than the tolerance is refused.
    #[command(
        after_help = "Example:\n  trueaxis export marlin machine.trax -o skew.gcode --best-effort"
    )]
    Marlin(skew::Arguments),
    /// Write the squareness of a three-axis machine for RepRapFirmware (M556)
    ///
    /// RepRapFirmware corrects nothing but squareness: what is left is printed, and more than the tolerance is refused.
    #[command(
        name = "reprapfirmware",
        after_help = "Example:\n  trueaxis export reprapfirmware machine.trax -o skew.g --best-effort"
    )]
    RepRapFirmware(skew::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        What::Cec(arguments) => cec::run(arguments),
        What::Klipper(arguments) => skew::run(Firmware::Klipper, arguments),
        What::Marlin(arguments) => skew::run(Firmware::Marlin, arguments),
        What::RepRapFirmware(arguments) => skew::run(Firmware::RepRapFirmware, arguments),
    }
}
