//! `trueaxis export …`

pub mod cec;
mod fanuc;
mod left;
mod linuxcnc;
mod rigid_body;
mod skew;
mod twist;

use super::bad_input::BadInput;
use super::number::positive;
use super::{Outcome, output};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use trueaxis_export::NotExported;
use trueaxis_export::skew::Firmware;

/// Write a compensation as the tables of another controller
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: ExportCommand,
}

#[derive(Subcommand)]
enum ExportCommand {
    Cec(cec::Arguments),
    Fanuc(fanuc::Arguments),
    Heidenhain(rigid_body::Heidenhain),
    Isg(rigid_body::Isg),
    #[command(name = "linuxcnc")]
    LinuxCnc(linuxcnc::Arguments),
    /// Write the squareness of a three-axis machine for Klipper (SET_SKEW)
    ///
    /// With --height-map, also its correction of Z over X and Y as a profile of bed_mesh. Klipper corrects nothing else: what
    /// is left is printed, and more than the tolerance is refused.
    #[command(
        after_help = "Example:\n  trueaxis export klipper machine.trax -o skew.cfg --height-map mesh.cfg --best-effort"
    )]
    Klipper(skew::WithMap),
    KlipperTwist(twist::Arguments),
    /// Write the squareness of a three-axis machine for Marlin (M852)
    ///
    /// Marlin corrects nothing but squareness: what is left is printed, and more than the tolerance is refused.
    #[command(
        after_help = "Example:\n  trueaxis export marlin machine.trax -o skew.gcode --best-effort"
    )]
    Marlin(skew::Arguments),
    /// Write the squareness of a three-axis machine for RepRapFirmware (M556)
    ///
    /// With --height-map, also its correction of Z over X and Y (heightmap.csv). RepRapFirmware corrects nothing else: what
    /// is left is printed, and more than the tolerance is refused.
    #[command(
        name = "reprapfirmware",
        after_help = "Example:\n  trueaxis export reprapfirmware machine.trax -o skew.g --height-map heightmap.csv --best-effort"
    )]
    RepRapFirmware(skew::WithMap),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        ExportCommand::Cec(arguments) => cec::run(arguments),
        ExportCommand::Fanuc(arguments) => fanuc::run(arguments),
        ExportCommand::Heidenhain(arguments) => rigid_body::heidenhain(arguments),
        ExportCommand::Isg(arguments) => rigid_body::isg(arguments),
        ExportCommand::LinuxCnc(arguments) => linuxcnc::run(arguments),
        ExportCommand::Klipper(arguments) => skew::with_map(Firmware::Klipper, arguments),
        ExportCommand::KlipperTwist(arguments) => twist::run(arguments),
        ExportCommand::Marlin(arguments) => skew::run(Firmware::Marlin, arguments),
        ExportCommand::RepRapFirmware(arguments) => {
            skew::with_map(Firmware::RepRapFirmware, arguments)
        }
    }
}

/// Options of every export that may leave something of the errors.
#[derive(Args)]
struct LeftOptions {
    /// Largest permitted error that remains: µm of a linear axis, the tip or a reading; as many µrad of a rotary axis
    #[arg(long, value_name = "µm", default_value_t = 1.0, value_parser = positive)]
    tolerance: f64,
    /// Write even if more is left than the tolerance
    #[arg(long)]
    best_effort: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

impl LeftOptions {
    /// Writes the files if they leave little enough, or all the same.
    fn write(&self, texts: &[(PathBuf, String)], meets: bool) -> Result<ExportVerdict, BadInput> {
        let written = meets || self.best_effort;
        if written {
            let mut folders = texts.iter().filter_map(|(path, _)| path.parent());
            folders.try_for_each(|folder| output::make_folder(folder, "-o"))?;
            output::write_all(texts)?;
        }
        Ok(ExportVerdict { meets, written })
    }
}

/// Shows why there is nothing to write.
pub fn refused(error: &NotExported, path: &Path) -> BadInput {
    BadInput::new(format!("{}: {error}", path.display()), error.remedy)
}

/// Whether files leave little enough of what they are to correct, and whether they are written.
#[derive(Clone, Copy)]
struct ExportVerdict {
    meets: bool,
    written: bool,
}

impl ExportVerdict {
    /// Says what remains, and why, if that is too much.
    fn outcome(self, remains: &str, why: &str) -> Outcome {
        if self.meets {
            return Outcome::Done;
        }
        let fate = match self.written {
            true => "",
            false => ", and nothing is written (--best-effort would)",
        };
        eprintln!("{remains}{fate}: {why}");
        Outcome::CheckFailed
    }
}
