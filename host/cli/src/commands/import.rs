//! `trueaxis import …`

mod cec;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};

/// Read the tables of another controller as a compensation
#[derive(Args)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Cec(cec::Arguments),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    match &arguments.what {
        What::Cec(arguments) => cec::run(arguments),
    }
}
