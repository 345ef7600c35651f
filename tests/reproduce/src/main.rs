//! `cargo xtask reproduce` writes the pages about the source document's figures.

use std::path::Path;
use std::process::ExitCode;
use std::{env, fs};
use trueaxis_reproduce::{page, reproduce};
use trueaxis_tables::compile::Progress;

const USAGE: &str =
    "usage: reproduce DIR, to which reproduced.md, reproduced.json and pictures/ are written";

fn main() -> ExitCode {
    let mut words = env::args().skip(1);
    let (Some(folder), None) = (words.next(), words.next()) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match write(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{folder}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Shows which chapter is being recomputed.
struct Stages;

impl Progress for Stages {
    fn stage(&self, what: &'static str, _: usize) {
        eprintln!("{what}");
    }

    fn step(&self) {}
}

fn write(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let pictures = folder.join("pictures");
    fs::create_dir_all(&pictures)?;
    let found = reproduce(&Stages)?;
    fs::write(folder.join("reproduced.md"), page(&found))?;
    let json = serde_json::to_string_pretty(&found)?;
    fs::write(folder.join("reproduced.json"), json)?;
    for picture in found.chapters.iter().flat_map(|chapter| &chapter.pictures) {
        fs::write(
            pictures.join(format!("{}.svg", picture.name)),
            picture.svg(),
        )?;
    }
    println!(
        "{}: reproduced.md, reproduced.json, pictures",
        folder.display()
    );
    Ok(())
}
