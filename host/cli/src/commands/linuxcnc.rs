//! `trueaxis linuxcnc …`

mod calibrate;
mod check;
pub mod configuration;
mod kept_files;
mod model;
mod probe;
mod setup;
mod start;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};

/// Install a compensation in LinuxCNC, check its wiring, probe, simulate the machine
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: LinuxCncCommand,
}

#[derive(Subcommand)]
enum LinuxCncCommand {
    Start(start::Arguments),
    Setup(setup::Arguments),
    Check(check::Arguments),
    Model(model::Arguments),
    Probe(probe::Arguments),
    Calibrate(Box<calibrate::Arguments>),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        LinuxCncCommand::Start(arguments) => start::run(arguments),
        LinuxCncCommand::Setup(arguments) => setup::run(arguments),
        LinuxCncCommand::Check(arguments) => check::run(arguments),
        LinuxCncCommand::Model(arguments) => model::run(arguments),
        LinuxCncCommand::Probe(arguments) => probe::run(arguments),
        LinuxCncCommand::Calibrate(arguments) => calibrate::run(arguments),
    }
}
