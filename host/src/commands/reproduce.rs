//! `trueaxis reproduce`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::progress::Bar;
use clap::Args;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use trueaxis_host::reproduce::{Fixed, Reproduced, page, reproduce};

/// Recompute the figures of the source document, each beside the document's and beside the scheme `exact`
///
/// Machines, parameters and strategies of the document are part of the program, so that this works anywhere. Prints
/// the page of the manual.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis reproduce -o docs/src\n\nExits with 1 if, with --check, something that is fixed from outside does not hold."
)]
pub struct Arguments {
    /// Folder to write to: reproduced.md, reproduced.json, and pictures/ (default: the page to standard output)
    #[arg(short, long, value_name = "DIR", conflicts_with_all = ["json", "check"])]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print what is fixed from outside and arithmetic on the document's figures, and whether they hold
    #[arg(long, conflicts_with = "json")]
    check: bool,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    if let Some(folder) = &arguments.output {
        prepare(folder)?;
    }
    let bar = Bar::new();
    let found = reproduce(&bar);
    drop(bar);
    let found = found.map_err(|error| {
        BadInput::new(
            error.to_string(),
            "nothing comes from outside here: this is an error of the program",
        )
    })?;
    if let Some(folder) = &arguments.output {
        write(folder, &found)?;
    } else if arguments.check {
        files::print(&checked(&found))?;
    } else if arguments.json {
        files::print_json(&found)?;
    } else {
        files::print(&page(&found))?;
    }
    let holds = found.fixed().chain(found.arithmetic()).all(|one| one.holds);
    Ok(match holds || !arguments.check {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

fn checked(found: &Reproduced) -> String {
    let mut text = String::new();
    let mut add = |one: &Fixed| {
        let holds = if one.holds { "holds" } else { "FAILS" };
        let _ = writeln!(text, "{holds}  {}: {}", one.statement, one.found);
    };
    found.fixed().for_each(&mut add);
    found.arithmetic().for_each(|one| {
        let statement = format!("arithmetic: {}", one.statement);
        add(&Fixed {
            statement,
            ..one.clone()
        });
    });
    text
}

const PICTURES: &str = "pictures";

/// Makes the folder, before anything is computed.
fn prepare(folder: &Path) -> Result<(), BadInput> {
    std::fs::create_dir_all(folder.join(PICTURES)).map_err(|error| {
        BadInput::new(
            format!("{} cannot be made: {error}", folder.display()),
            "give a folder that can be written to",
        )
    })?;
    for name in ["reproduced.md", "reproduced.json"] {
        files::prepare(&folder.join(name), &[])?;
    }
    Ok(())
}

fn write(folder: &Path, found: &Reproduced) -> Result<(), BadInput> {
    let json = serde_json::to_string_pretty(found).map_err(|error| {
        BadInput::new(
            error.to_string(),
            "nothing comes from outside here: this is an error of the program",
        )
    })?;
    files::write(&folder.join("reproduced.md"), page(found).as_bytes())?;
    files::write(&folder.join("reproduced.json"), json.as_bytes())?;
    let mut pictures = 0;
    for picture in found.chapters.iter().flat_map(|chapter| &chapter.pictures) {
        let path = folder.join(PICTURES).join(format!("{}.svg", picture.name));
        files::write(&path, picture.svg().as_bytes())?;
        pictures += 1;
    }
    files::print(&format!(
        "{}: reproduced.md, reproduced.json, {pictures} pictures\n",
        folder.display()
    ))
}
