//! `trueaxis linuxcnc calibrate`

use super::configuration;
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::calibration::{CalibrationFiles, CalibrationOptions, Corrects, Moves, Site};
use crate::commands::probing::{SpeedOptions, bad, started};
use clap::Args;
use std::path::{Path, PathBuf};

/// Calibrate the machine: probe, identify, compile, load, and verify it by probing again
///
/// Drives the LinuxCNC that runs on this computer. Every step is a command that it shows before running it, with files
/// in a folder of its own, so that each can be looked at and repeated. Balls are probed at other positions than those
/// from which the errors were identified, without and with the new compensation; it is kept only if the machine is
/// better than before, and as good as was predicted. Otherwise, and if you press Ctrl-C, the machine stops and the old
/// compensation returns.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis linuxcnc calibrate machine.toml --artefact artefact.toml \\\n    \
--ball-diameter 20 --stylus-diameter 6 --minutes 30\n  \
trueaxis linuxcnc calibrate machine.toml --artefact artefact.toml --folder calibration-2026-05-04-0912 --from identify\n\n\
The machine must be on, with the stylus in the spindle and clear of everything, and the component trueaxis must be\n\
installed (trueaxis linuxcnc setup)."
)]
pub struct Arguments {
    #[command(flatten)]
    options: CalibrationOptions,
    /// The INI file of the machine (default: that of the LinuxCNC that is running)
    #[arg(long, value_name = "MACHINE.ini")]
    ini: Option<PathBuf>,
    /// Load into a board that corrects the machine, instead of into the component: serial device, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    #[command(flatten)]
    speeds: SpeedOptions,
    /// Folder for the files of all steps (default: calibration- with date and time)
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Home the joints if they are not
    #[arg(long)]
    home: bool,
}

/// The component that corrects.
const COMPONENT: &str = "trueaxis";

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        options,
        ini,
        port,
        speeds,
        folder,
        home,
    } = arguments;
    // Before anything is asked of the machine.
    options.touching.stated()?;
    let Some(mut session) = started(*home, options.yes)? else {
        return Ok(Outcome::CheckFailed);
    };
    let state = session.state().map_err(bad)?;
    let corrects = match port {
        Some(port) => Corrects::board(port)?,
        None => {
            let ini = ini.clone().unwrap_or_else(|| state.ini.into());
            Corrects::Component {
                name: COMPONENT,
                path: active(&ini)?,
            }
        }
    };
    let folder = folder.clone();
    let folder = folder.unwrap_or_else(|| PathBuf::from(format!("calibration-{}", state.date)));
    let calibration = CalibrationFiles::new(options, folder)?;
    calibration.run(&mut Site::new(
        Moves::LinuxCnc { session, speeds },
        corrects,
    ))
}

/// Where the component reads its compensation.
fn active(ini: &Path) -> Result<PathBuf, BadInput> {
    let configured = configuration::read(ini)?;
    let file = (configured.hal.load(COMPONENT)).and_then(|command| command.parameter("file"));
    let file = file.ok_or_else(|| {
        BadInput::new(
            format!(
                "{}: its HAL files do not load the component {COMPONENT}",
                ini.display()
            ),
            "install it first: trueaxis linuxcnc setup",
        )
    })?;
    Ok(configuration::folder(ini).join(file))
}
