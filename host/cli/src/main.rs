//! The command `trueaxis`: a thin layer over the library.
#![forbid(unsafe_code)]

mod commands;

fn main() -> std::process::ExitCode {
    commands::run()
}
