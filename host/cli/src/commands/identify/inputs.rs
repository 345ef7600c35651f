//! The files of measurements of `trueaxis identify`, each recognised by its header.

use super::super::bad_input::BadInput;
use super::super::files::{self, Text};
use super::Arguments;
use clap::ValueEnum;
use std::path::PathBuf;
use trueaxis_direct::formats::runs;
use trueaxis_direct::{MeasuredRuns, Measurement};
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::kind::{FileKind, kind};
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{self, Probings};
use trueaxis_model::machine::Machine;

/// What stayed where it was between files of probings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Same {
    /// The stylus; every file has balls of its own.
    Stylus,
    /// The stylus and the balls: a name is the same ball in every file.
    Balls,
}

/// What was measured.
#[derive(Default)]
pub struct MeasuredInputs {
    pub probings: Probings,
    /// Instruments in the adjustment: ball-bars, squares, other observations, and runs of `--observations`.
    pub observations: Observations,
    /// Runs whose motions are kept as tables.
    pub runs: Vec<Measurement>,
}

impl MeasuredInputs {
    pub fn read(
        arguments: &Arguments,
        machine: &Machine,
        artefact: &Artefact,
    ) -> Result<Self, BadInput> {
        let mut found = Self::default();
        let mut probed: Vec<(&PathBuf, Probings)> = Vec::new();
        let mut observed = Vec::new();
        for path in &arguments.files {
            let text = Text::read(path)?;
            match kind(&text.text).map_err(|e| text.bad(e))? {
                FileKind::Probings => {
                    let rows = probings::read(&text.text, machine, true);
                    let rows = rows.map_err(|e| text.bad(e))?;
                    let known = probings::have_known_balls(&text.text, &rows, artefact);
                    known.map_err(|e| text.bad(e))?;
                    probed.push((path, rows));
                }
                FileKind::Runs => {
                    match runs::read(&text.text, machine).map_err(|e| text.bad(e))? {
                        // What a square shows, other instruments show too.
                        MeasuredRuns::Square(_) => observed.push(path.clone()),
                        measured => found.runs.push(Measurement {
                            name: text.name,
                            measured,
                        }),
                    }
                }
                FileKind::Ballbar | FileKind::Observations => observed.push(path.clone()),
            }
        }
        observed.extend(arguments.observations.iter().cloned());
        found.observations = files::read_observations(&observed, machine)?;
        let has_runs = !found.runs.is_empty();
        are_sufficient(arguments, &probed, &observed, has_runs)?;
        let have_own_balls = arguments.same != Some(Same::Balls);
        found.probings = Probings::joined(named(probed), have_own_balls);
        Ok(found)
    }
}

/// Refuses files that do not go together, or do not show how the axes stand to each other.
fn are_sufficient(
    arguments: &Arguments,
    probed: &[(&PathBuf, Probings)],
    observed: &[PathBuf],
    has_runs: bool,
) -> Result<(), BadInput> {
    let has_readings = has_runs || !observed.is_empty();
    if arguments.active.is_some() && has_readings {
        return Err(BadInput::new(
            "--active undoes a compensation in probings only, and there are readings of instruments",
            "identify probings alone, or read instruments with the compensation off",
        ));
    }
    if let ([(first, _), (second, _), ..], None) = (probed, arguments.same) {
        return Err(BadInput::new(
            format!(
                "{} and {} are both probings",
                first.display(),
                second.display()
            ),
            "say what stayed between them: --same stylus if only the balls were moved, --same balls if nothing was moved. If the stylus was changed, identify each file by itself, because one place of the stylus is found for all files",
        ));
    }
    if probed.is_empty() && observed.is_empty() {
        return Err(BadInput::new(
            format!(
                "{}: runs alone show the motions of each axis, not how the axes stand to each other",
                arguments.names()
            ),
            "add a ball-bar, a square or probings; or write the motions with `trueaxis measured`",
        ));
    }
    Ok(())
}

/// The files with names for their balls; files in different folders may have one name.
fn named(files: Vec<(&PathBuf, Probings)>) -> Vec<(String, Probings)> {
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_owned();
    let stems: Vec<_> = files.iter().map(|(path, _)| stem(path)).collect();
    let named = files.into_iter().enumerate().map(|(number, (path, file))| {
        let own = &stems[number];
        let name = match stems.iter().filter(|one| *one == own).count() {
            1 => own.to_string_lossy().into_owned(),
            _ => format!("file {}, {}", number + 1, path.display()),
        };
        (name, file)
    });
    named.collect()
}
