//! `trueaxis linuxcnc probe`

use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files;
use crate::commands::output;
use crate::commands::probing::{CLEAR, SpeedOptions, Work, asked, started, take_over};
use crate::commands::touch_options::TouchOptions;
use clap::Args;
use std::path::PathBuf;

/// Probe a measurement plan on the machine, touch by touch
///
/// Drives the LinuxCNC that runs on this computer line by line, and confirms and logs every touch before the next move.
/// Each ball is touched twice, fast and slowly. A feed override of 0 holds it, and stop ends it. A log that was
/// stopped early is continued where it ends.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis linuxcnc probe machine.toml --artefact artefact.toml --plan plan.csv \\\n    \
--ball-diameter 20 --stylus-diameter 6 -o touches.csv\n\n\
The machine must be on, with the stylus in the spindle and clear of everything. It is homed with --home. It asks before\n\
homing, before switching kinematics, and before the first touch. Moves are in\n\
machine coordinates and change no work offset. If LinuxCNC uses kinematics for the tool centre point, they are\n\
switched to identity for the time. Next: trueaxis probings machine.toml touches.csv --plan plan.csv"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Positions of the balls (artefact.toml)
    #[arg(long, value_name = "FILE")]
    artefact: PathBuf,
    /// The rows to probe (CSV)
    #[arg(long, value_name = "FILE.csv")]
    plan: PathBuf,
    #[command(flatten)]
    touching: TouchOptions,
    #[command(flatten)]
    speeds: SpeedOptions,
    /// Home the joints if they are not
    #[arg(long)]
    home: bool,
    /// Move without asking
    #[arg(long)]
    yes: bool,
    /// The log: continued if it exists
    #[arg(short, long, value_name = "TOUCHES.csv")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { output, plan, .. } = arguments;
    output::prepare(output, &[&arguments.machine, &arguments.artefact, plan])?;
    let machine = files::read_machine(&arguments.machine)?;
    let artefact = files::read_artefact(&arguments.artefact, &machine)?;
    let plan = files::read_plan(plan, &machine)?;
    let work = Work::new(
        &machine,
        &artefact,
        plan,
        &arguments.touching,
        &arguments.speeds,
        output,
    )?;
    let Some(mut session) = started(arguments.home, arguments.yes)? else {
        return Ok(Outcome::CheckFailed);
    };
    output::print(&work.announced())?;
    if !arguments.yes && !asked(CLEAR)? || !take_over(&mut session, arguments.yes)? {
        return Ok(Outcome::CheckFailed);
    }
    let touches = work.probe(&mut session)?;
    output::print(&format!("{}: {touches} touches\n", output.display()))?;
    Ok(Outcome::Done)
}
