//! `trueaxis export …`

mod cec;

use super::Outcome;
use super::bad_input::BadInput;
use clap::{Args, Subcommand};

/// Write a compensation as the tables of another controller
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
