//! What `xtask` and the laboratories in `lab` need of this computer: processes, packages of the distribution, files,
//! numbers in files, and the command `trueaxis`.

pub mod csv;
pub mod files;
pub mod packages;
pub mod process;
pub mod python;
pub mod trueaxis;

use std::process::ExitCode;

/// Version of this workspace.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Why a program did not succeed.
#[derive(Debug, PartialEq)]
pub enum Failure {
    /// Wrong arguments: what they may be.
    Arguments(String),
    /// What could not be done, or does not hold.
    Cause(String),
}

impl Failure {
    /// Wrong arguments, with what they may be.
    pub fn arguments(usage: impl Into<String>) -> Self {
        Self::Arguments(usage.into())
    }
}

impl From<String> for Failure {
    fn from(cause: String) -> Self {
        Self::Cause(cause)
    }
}

/// Runs a program with its arguments; prints why it fails, with exit code 2 for wrong arguments.
pub fn main(run: impl FnOnce(&[&str]) -> Result<(), Failure>) -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (message, code) = match run(&words) {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Arguments(message)) => (message, ExitCode::from(2)),
        Err(Failure::Cause(message)) => (message, ExitCode::FAILURE),
    };
    eprintln!("xtask: {message}");
    code
}

/// Refuses all arguments.
///
/// # Errors
/// If there are any.
pub fn none(words: &[&str]) -> Result<(), Failure> {
    match words {
        [] => Ok(()),
        _ => Err(Failure::arguments(format!(
            "no arguments, not `{}`",
            words.join(" ")
        ))),
    }
}

/// Refuses arguments that are not among these names.
///
/// # Errors
/// The first one that is not.
pub fn known(words: &[&str], names: &[&str]) -> Result<(), Failure> {
    match words.iter().find(|word| !names.contains(word)) {
        None => Ok(()),
        Some(word) => Err(Failure::arguments(format!(
            "there is no `{word}`: {}",
            names.join(", ")
        ))),
    }
}
