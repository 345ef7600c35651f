//! `cargo xtask …`: the developer and CI commands, a table of steps. What a step tests is a program in `lab`, built
//! when it is needed.

mod commands;
mod kept;
mod oldest;
mod steps;
mod test;

use commands::COMMANDS;
use programs::Failure;
use std::io::{self, Write};
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut code = ExitCode::SUCCESS;
    let ended = programs::main(|words| {
        match words {
            ["help" | "--help" | "-h"] | [] => {
                // Whoever reads it may stop before its end.
                let _ = writeln!(io::stdout(), "{}", commands::usage());
            }
            [name, arguments @ ..] => {
                let command = COMMANDS.iter().find(|command| command.name() == *name);
                let command = command.ok_or_else(|| unknown(words))?;
                code = command.run(arguments)?;
            }
        }
        Ok(())
    });
    if ended == ExitCode::SUCCESS {
        code
    } else {
        ended
    }
}

fn unknown(words: &[&str]) -> Failure {
    let usage = commands::usage();
    Failure::Arguments(format!("unknown command `{}`\n\n{usage}", words.join(" ")))
}
