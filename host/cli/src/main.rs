//! The command `trueaxis`, a thin layer over the libraries.
#![forbid(unsafe_code)]

mod commands;

fn main() -> std::process::ExitCode {
    commands::run()
}
