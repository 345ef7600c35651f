//! `trueaxis calibrate`

use super::Outcome;
use super::bad_input::BadInput;
use super::calibration::{CalibrationFiles, CalibrationOptions, Corrects, Moves, Site};
use clap::Args;
use std::path::PathBuf;

/// Calibrate a machine whose corrections come from a board, and whose controller probes by itself
///
/// Writes what is to be probed, as a table and as a program, and waits for the logs of the touches in the same folder. What
/// follows is what `trueaxis linuxcnc calibrate` does: identify, compile, load into the board, probe again with the
/// corrections on, and keep the compensation only if the machine is better than before, and as good as was predicted.
/// Otherwise, and if you press Ctrl-C, what the board did before is back.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis calibrate machine.toml --artefact artefact.toml --port /dev/ttyUSB0 --folder calibration \\\n    \
--ball-diameter 20 --stylus-diameter 6 --minutes 30\n\n\
The logs are those that `trueaxis probings` reads: a header with the axes, and a line for each touch. Write each under\n\
another name and rename it when it is whole, or append to it: it is read when it has all touches."
)]
pub struct Arguments {
    #[command(flatten)]
    options: CalibrationOptions,
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT of the board
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Folder for the files of all steps
    #[arg(long, value_name = "DIR")]
    folder: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let calibration = CalibrationFiles::new(&arguments.options, arguments.folder.clone())?;
    let corrects = Corrects::board(&arguments.port)?;
    calibration.run(&mut Site::new(Moves::ByItself, corrects))
}
