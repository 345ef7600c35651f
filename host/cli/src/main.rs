//! The command `trueaxis`, a thin layer over the libraries.
#![forbid(unsafe_code)]
// The page for browsers calls a part of the commands.
#![cfg_attr(target_family = "wasm", allow(dead_code))]

mod commands;

fn main() -> std::process::ExitCode {
    commands::run()
}
