//! `trueaxis linuxcnc …`

mod calibrate;
mod check;
pub mod configuration;
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
    what: What,
}

#[derive(Subcommand)]
enum What {
    Start(start::Arguments),
    Setup(setup::Arguments),
    Check(check::Arguments),
    Model(model::Arguments),
    Probe(probe::Arguments),
    Calibrate(Box<calibrate::Arguments>),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        What::Start(arguments) => start::run(arguments),
        What::Setup(arguments) => setup::run(arguments),
        What::Check(arguments) => check::run(arguments),
        What::Model(arguments) => model::run(arguments),
        What::Probe(arguments) => probe::run(arguments),
        What::Calibrate(arguments) => calibrate::run(arguments),
    }
}
