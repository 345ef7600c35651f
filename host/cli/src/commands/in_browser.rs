//! The commands that the page for browsers calls.

use super::{
    BadInput, Outcome, compile, explain, export, gcode, generate, identify, inspect, measured,
    report,
};
use clap::Subcommand;

#[derive(Subcommand)]
pub enum Command {
    Compile(compile::Arguments),
    Inspect(inspect::Arguments),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Identify(identify::Arguments),
    Measured(measured::Arguments),
    Gcode(gcode::Arguments),
    Generate(generate::Arguments),
    Export(export::Arguments),
}

impl Command {
    pub fn run(self) -> Result<Outcome, BadInput> {
        match self {
            Self::Compile(arguments) => compile::run(&arguments),
            Self::Inspect(arguments) => inspect::run(&arguments),
            Self::Report(arguments) => report::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Identify(arguments) => identify::run(&arguments),
            Self::Measured(arguments) => measured::run(&arguments),
            Self::Gcode(arguments) => gcode::run(&arguments),
            Self::Generate(arguments) => generate::run(&arguments),
            Self::Export(arguments) => export::run(&arguments),
        }
    }
}
