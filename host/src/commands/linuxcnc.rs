//! `trueaxis linuxcnc …`

mod model;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};

/// Bring a compensation into LinuxCNC, check how it is wired, simulate the machine
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Model(model::Arguments),
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        What::Model(arguments) => model::run(arguments),
    }
}
