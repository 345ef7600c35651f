//! The commands that the page for browsers calls.

use super::export::cec;
use super::{
    BadInput, Outcome, compile, control, explain, flash, gcode, generate, identify, inspect,
    measured, model, monitor, report,
};
use clap::Subcommand;

#[derive(Subcommand)]
pub enum Command {
    Compile(compile::Arguments),
    Inspect(inspect::Arguments),
    Report(report::Arguments),
    Explain(explain::Arguments),
    Model(model::Arguments),
    Identify(identify::Arguments),
    Measured(measured::Arguments),
    Gcode(gcode::Arguments),
    Generate(generate::Arguments),
    /// Write a compensation as the tables of another controller
    #[command(subcommand)]
    Export(Export),
    Flash(flash::Arguments),
    Monitor(monitor::Arguments),
    Control(control::Arguments),
}

#[derive(Subcommand)]
pub enum Export {
    Cec(cec::Arguments),
}

impl Command {
    pub fn run(self) -> Result<Outcome, BadInput> {
        match self {
            Self::Compile(arguments) => compile::run(&arguments),
            Self::Inspect(arguments) => inspect::run(&arguments),
            Self::Report(arguments) => report::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Model(arguments) => model::run(&arguments),
            Self::Identify(arguments) => identify::run(&arguments),
            Self::Measured(arguments) => measured::run(&arguments),
            Self::Gcode(arguments) => gcode::run(&arguments),
            Self::Generate(arguments) => generate::run(&arguments),
            Self::Export(Export::Cec(arguments)) => cec::run(&arguments),
            Self::Flash(arguments) => flash::run(&arguments),
            Self::Monitor(arguments) => monitor::run(&arguments),
            Self::Control(arguments) => control::run(&arguments),
        }
    }
}
