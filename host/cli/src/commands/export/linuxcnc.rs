//! `trueaxis export linuxcnc`

use super::left;
use crate::commands::linuxcnc::configuration;
use crate::commands::{Outcome, bad_input::BadInput, files, output};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_linuxcnc::comp_file::{self, CompFile, ExportError, Type};
use trueaxis_model::validate::Runtime;

/// Write corrections that LinuxCNC makes by itself, joint by joint (COMP_FILE)
///
/// A file per joint, of corrections that depend on the position and direction of this joint alone. Squareness,
/// straightness and angles stay: the files are read again, what is left is printed, and more than the tolerance is refused.
/// The component of trueaxis corrects all of it.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis export linuxcnc machine.trax --ini mill.ini -o . --best-effort"
)]
pub struct Arguments {
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// The INI file of the machine: its joints and units
    #[arg(long, value_name = "MACHINE.ini")]
    ini: PathBuf,
    /// Folder for joint0.comp, joint1.comp …
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// COMP_FILE_TYPE: 0 for the positions that are reached, 1 for corrections
    #[arg(long = "type", value_name = "0|1", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=1))]
    kind: u8,
    /// Lines of each file (default: as few as make no difference, at most 256)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=256))]
    lines: Option<u16>,
    #[command(flatten)]
    left: left::Arguments,
}

#[derive(Serialize)]
struct LinuxCncNotes {
    /// Joint and number of lines of each file.
    joints: Vec<[usize; 2]>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { blob: path, .. } = arguments;
    let configuration = configuration::read(&arguments.ini)?;
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let kind = match arguments.kind {
        0 => Type::Positions,
        _ => Type::Corrections,
    };
    let random = arguments.left.random;
    let lines = arguments.lines.map(usize::from);
    let positions = random.random as usize;
    let made = comp_file::export(
        &runtime,
        &configuration,
        kind,
        lines,
        positions,
        random.seed,
    );
    let (made, found) = made.map_err(|error| refused(&error, path))?;
    let texts: Vec<(PathBuf, String)> = (made.iter())
        .map(|file| (arguments.output.join(name(file)), file.text.clone()))
        .collect();
    // A folder that is not there has nothing to be prepared.
    for (to, _) in texts.iter().filter(|_| arguments.output.exists()) {
        output::prepare(to, &[path, &arguments.ini])?;
    }
    let more = LinuxCncNotes {
        joints: (made.iter())
            .map(|file| [file.joint.number, file.lines])
            .collect(),
    };
    let screen = ini_lines(&made, arguments.kind);
    let stays = "COMP_FILE corrects a joint by its own position only; the component corrects the rest (`trueaxis linuxcnc setup`)";
    (arguments.left).write(&runtime, &texts, &found, &screen, stays, &more)
}

fn refused(error: &ExportError, path: &Path) -> BadInput {
    let remedy = match error {
        ExportError::NoJoint(_) => "give the INI file of this machine, or compile for its axes",
        ExportError::Read(..) => {
            "this is a fault of trueaxis: please report it with the compensation"
        }
    };
    BadInput::new(format!("{}: {error}", path.display()), remedy)
}

fn name(file: &CompFile) -> String {
    format!("joint{}.comp", file.joint.number)
}

/// What names the files in the INI file.
fn ini_lines(made: &[CompFile], kind: u8) -> String {
    if made.is_empty() {
        return "no joint has an error of its own\n".to_owned();
    }
    let mut text = "write into the INI file:\n".to_owned();
    for file in made {
        text += &format!(
            "  [JOINT_{}]\n  COMP_FILE = {}\n  COMP_FILE_TYPE = {kind}\n",
            file.joint.number,
            name(file)
        );
    }
    text
}
