//! `trueaxis linuxcnc setup`

use super::configuration;
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use trueaxis_controllers::linuxcnc::{Setup, setup};

/// Write HAL lines that install the component, and a first machine.toml
///
/// Reads the INI file and the HAL files that it names. LinuxCNC reads trueaxis.hal after them; it changes their
/// connections. machine.toml has the travels and what the kinematics define; CHECK marks what you must add. Existing
/// files are kept unless --overwrite is given.
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis linuxcnc setup mill.ini -o .")]
pub struct Arguments {
    /// The INI file of the machine
    #[arg(value_name = "MACHINE.ini")]
    ini: PathBuf,
    /// Folder for trueaxis.hal and machine.toml
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Name of the machine (default: [EMC]MACHINE)
    #[arg(long)]
    name: Option<String>,
    /// Path of the compensation as written in HAL, from the folder of the INI file
    #[arg(long, value_name = "FILE.trax", default_value = "machine.trax")]
    file: String,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Answer {
    files: [PathBuf; 2],
    joints: String,
    /// Number of lines that the user must complete.
    to_check: usize,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments { ini, output, .. } = arguments;
    let configuration = configuration::read(ini)?;
    if arguments.file.is_empty() || arguments.file.contains(char::is_whitespace) {
        return Err(BadInput::new(
            format!(
                "--file: `{}` has spaces, which HAL takes for separate words",
                arguments.file
            ),
            "give it a path without spaces",
        ));
    }
    if configuration.hal.load("trueaxis").is_some() {
        return Err(BadInput::new(
            format!(
                "{}: its HAL files load the component trueaxis already",
                ini.display()
            ),
            "remove HALFILE = trueaxis.hal from the INI file first: this command connects to the configuration as it is without it",
        ));
    }
    let named = configuration
        .ini
        .get("EMC", "MACHINE")
        .map(|e| e.value.clone());
    let name = arguments
        .name
        .clone()
        .or(named)
        .filter(|name| !name.is_empty());
    let name = name.unwrap_or_else(|| "machine".to_owned());
    let end = (0..=64).rev().find(|end| name.is_char_boundary(*end));
    let name = name.get(..end.unwrap_or(0)).unwrap_or(&name);
    let Setup { hal, machine } = setup(&configuration, name, &arguments.file);
    let files = ["trueaxis.hal", "machine.toml"].map(|name| output.join(name));
    for file in &files {
        files::prepare(file, &[ini])?;
        if !arguments.overwrite && file.symlink_metadata().is_ok() {
            return Err(BadInput::new(
                format!("{} already exists: nothing was written", file.display()),
                "give -o another folder, or --overwrite",
            ));
        }
    }
    // Ignores the explanation of the mark in the head and any name that contains it.
    let marks = |text: &str| {
        text.lines()
            .filter(|l| l.contains("CHECK") && l.contains('#'))
            .count()
    };
    let to_check = marks(&hal) + marks(&machine) - 1;
    for (file, text) in files.iter().zip([hal, machine]) {
        files::write(file, text.as_bytes())?;
    }
    let letters = configuration.module.letters.clone();
    if arguments.json {
        return files::print_json(&Answer {
            files,
            joints: letters,
            to_check,
        })
        .map(|()| Outcome::Done);
    }
    let [hal, machine] = files.map(|f| f.display().to_string());
    files::print(&format!(
        "{hal}: joints {letters}\n{machine}: to be completed where it says CHECK ({to_check} in both files)\n\
         next: trueaxis compile {machine} errors.toml -o {file}\n\
         then below [HAL] of {ini}, behind the other HALFILE lines: HALFILE = trueaxis.hal\n",
        file = arguments.file,
        ini = ini.display(),
    ))?;
    Ok(Outcome::Done)
}
