//! The commands. Each reads files, calls the library, writes files and prints a summary.

mod bad_input;
mod ballbar;
mod calibrate;
mod calibration;
mod cec;
mod compile;
mod completions;
mod control;
mod correct;
mod date;
mod error_source;
mod eval;
mod explain;
mod export;
mod files;
mod flash;
mod gcode;
mod generate;
#[cfg(not(target_family = "wasm"))]
mod groups;
mod hal;
mod identify;
mod import;
#[cfg(target_family = "wasm")]
mod in_browser;
mod inspect;
mod iso230_2;
mod iso230_3;
mod iso230_7;
mod linuxcnc;
mod measured;
#[cfg(target_family = "wasm")]
mod model;
mod monitor;
mod monte_carlo;
#[cfg(not(target_family = "wasm"))]
mod new;
mod number;
mod offered;
mod output;
mod plan;
mod plan_output;
mod policy;
mod port;
mod pose;
mod position_argument;
mod probing;
mod probings;
#[cfg_attr(target_family = "wasm", path = "progress_in_browser.rs")]
mod progress;
mod qualify;
mod quantity;
mod random;
#[cfg(all(test, not(target_family = "wasm")))]
mod reference_tests;
mod replace;
mod report;
mod scheme;
mod schemes;
mod screen;
mod simulate;
mod skew;
mod target;
mod touch_options;
mod unidentifiable;
mod verdict;
mod verify;
mod version;

use bad_input::BadInput;
use clap::Parser;
#[cfg(target_family = "wasm")]
use in_browser::Command;
use std::process::ExitCode;

/// Compensates the geometric errors of machine tools with tables in their controllers.
///
/// Files: machine.toml describes the machine, errors.toml its error parameters (mm, rad), a .trax
/// file holds a compensation. Positions and corrections are in mm and degrees.
///
/// Exit codes: 0 success, 1 a check failed, 2 bad input.
#[derive(Parser)]
#[command(name = "trueaxis", version, long_version = version::all())]
#[cfg_attr(not(target_family = "wasm"), command(help_template = groups::help_template()))]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[cfg(not(target_family = "wasm"))]
#[derive(clap::Subcommand)]
enum Command {
    New(new::Arguments),
    Pose(pose::Arguments),
    Explain(explain::Arguments),
    Plan(Box<plan::Arguments>),
    Probings(probings::Arguments),
    Qualify(qualify::Arguments),
    Identify(identify::Arguments),
    Measured(measured::Arguments),
    Skew(skew::Arguments),
    Compile(compile::Arguments),
    Verify(verify::Arguments),
    Report(report::Arguments),
    Inspect(inspect::Arguments),
    Eval(eval::Arguments),
    Correct(correct::Arguments),
    Schemes(schemes::Arguments),
    Generate(generate::Arguments),
    Linuxcnc(linuxcnc::Arguments),
    Gcode(gcode::Arguments),
    Export(export::Arguments),
    Import(import::Arguments),
    Flash(flash::Arguments),
    Control(control::Arguments),
    Monitor(monitor::Arguments),
    Calibrate(Box<calibrate::Arguments>),
    Ballbar(ballbar::Arguments),
    #[command(name = "iso230-2")]
    Iso2302(iso230_2::Arguments),
    #[command(name = "iso230-3")]
    Iso2303(iso230_3::Arguments),
    #[command(name = "iso230-7")]
    Iso2307(iso230_7::Arguments),
    Simulate(simulate::Arguments),
    Completions(completions::Arguments),
    Man(completions::Pages),
}

/// The result of a command whose input was valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Exit code 0.
    Done,
    /// Exit code 1.
    CheckFailed,
}

/// Parses the arguments, runs the command and prints errors.
pub fn run() -> ExitCode {
    match Cli::parse().command.run() {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(bad) => {
            bad.show();
            ExitCode::from(2)
        }
    }
}

#[cfg(not(target_family = "wasm"))]
impl Command {
    fn run(self) -> Result<Outcome, BadInput> {
        match self {
            Self::New(arguments) => new::run(&arguments),
            Self::Compile(arguments) => compile::run(&arguments),
            Self::Verify(arguments) => verify::run(&arguments),
            Self::Inspect(arguments) => inspect::run(&arguments),
            Self::Report(arguments) => report::run(&arguments),
            Self::Eval(arguments) => eval::run(&arguments),
            Self::Schemes(arguments) => schemes::run(&arguments),
            Self::Correct(arguments) => correct::run(&arguments),
            Self::Pose(arguments) => pose::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Identify(arguments) => identify::run(&arguments),
            Self::Plan(arguments) => plan::run(&arguments),
            Self::Probings(arguments) => probings::run(&arguments),
            Self::Qualify(arguments) => qualify::run(&arguments),
            Self::Measured(arguments) => measured::run(&arguments),
            Self::Iso2302(arguments) => iso230_2::run(&arguments),
            Self::Iso2303(arguments) => iso230_3::run(&arguments),
            Self::Iso2307(arguments) => iso230_7::run(&arguments),
            Self::Ballbar(arguments) => ballbar::run(&arguments),
            Self::Simulate(arguments) => simulate::run(&arguments),
            Self::Gcode(arguments) => gcode::run(&arguments),
            Self::Generate(arguments) => generate::run(&arguments),
            Self::Calibrate(arguments) => calibrate::run(&arguments),
            Self::Flash(arguments) => flash::run(&arguments),
            Self::Monitor(arguments) => monitor::run(&arguments),
            Self::Control(arguments) => control::run(&arguments),
            Self::Linuxcnc(arguments) => linuxcnc::run(&arguments),
            Self::Skew(arguments) => skew::run(&arguments),
            Self::Export(arguments) => export::run(&arguments),
            Self::Import(arguments) => import::run(&arguments),
            Self::Completions(arguments) => completions::run(&arguments),
            Self::Man(arguments) => completions::man(&arguments),
        }
    }
}
