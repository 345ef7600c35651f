//! `trueaxis completions` and `trueaxis man`

use super::bad_input::BadInput;
use super::{Cli, Outcome, output};
use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;
use std::path::{Path, PathBuf};

/// Print a completion script for a shell
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis completions bash > ~/.local/share/bash-completion/completions/trueaxis"
)]
pub struct Arguments {
    /// The shell
    shell: Shell,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let mut script = Vec::new();
    let mut command = Cli::command();
    clap_complete::generate(arguments.shell, &mut command, "trueaxis", &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// Write manual pages: one for each command, nested ones included
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis man ~/.local/share/man/man1")]
pub struct Pages {
    /// An existing folder
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

pub fn man(arguments: &Pages) -> Result<Outcome, BadInput> {
    let folder = &arguments.folder;
    if !folder.is_dir() {
        return Err(BadInput::new(
            format!("{}: there is no such folder", folder.display()),
            "make the folder, or give one that exists",
        ));
    }
    let mut command = Cli::command();
    command.build();
    let count = write_pages(&command, folder)?;
    output::print(&format!("{count} pages in {}\n", folder.display()))?;
    Ok(Outcome::Done)
}

/// Writes the pages of a command and of all commands below it; returns their number.
fn write_pages(command: &Command, folder: &Path) -> Result<usize, BadInput> {
    let page = clap_mangen::Man::new(command.clone());
    let (file, mut text) = (page.get_filename(), Vec::new());
    page.render(&mut text).map_err(|error| {
        BadInput::new(format!("{file}: {error}"), "give a folder on another disk")
    })?;
    output::write(&folder.join(file), &text)?;
    let mut count = 1;
    for inner in command.get_subcommands() {
        if inner.get_name() != "help" {
            count += write_pages(inner, folder)?;
        }
    }
    Ok(count)
}
