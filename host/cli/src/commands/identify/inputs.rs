//! The files of measurements of `trueaxis identify`, each recognised by its header.

use super::super::bad_input::BadInput;
use super::super::files::{self, Text};
use super::Arguments;
use clap::ValueEnum;
use std::path::PathBuf;
use trueaxis_measure::direct::{MeasuredRuns, Measurement};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::kind::{FileKind, kind};
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::{self, Probings};
use trueaxis_measure::formats::runs;
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
        let files = FilesByKind::read(arguments, machine, artefact)?;
        let observations = files::read_observations(&files.observed, machine)?;
        files.are_sufficient(arguments)?;
        Ok(Self {
            probings: joined(files.probed, arguments.same),
            observations,
            runs: files.runs,
        })
    }
}

/// The files of measurements, by what they hold.
struct FilesByKind<'a> {
    probed: Vec<(&'a PathBuf, Probings)>,
    runs: Vec<Measurement>,
    /// Readings of instruments, not read yet.
    observed: Vec<PathBuf>,
}

impl<'a> FilesByKind<'a> {
    fn read(
        arguments: &'a Arguments,
        machine: &Machine,
        artefact: &Artefact,
    ) -> Result<Self, BadInput> {
        let mut probed = Vec::new();
        let mut runs = Vec::new();
        let mut observed = Vec::new();
        for path in &arguments.files {
            let text = Text::read(path)?;
            match kind(&text.text).map_err(|e| text.bad(e))? {
                FileKind::Probings => {
                    let rows = probings::read(&text.text, machine, true);
                    let rows = rows.map_err(|e| text.bad(e))?;
                    probings::have_known_balls(&text.text, &rows, artefact)
                        .map_err(|e| text.bad(e))?;
                    probed.push((path, rows));
                }
                FileKind::Runs => {
                    match runs::read(&text.text, machine).map_err(|e| text.bad(e))? {
                        // What a square shows, other instruments show too.
                        MeasuredRuns::Square(_) => observed.push(path.clone()),
                        measured => runs.push(Measurement {
                            name: text.name,
                            measured,
                        }),
                    }
                }
                FileKind::Ballbar | FileKind::Observations => observed.push(path.clone()),
            }
        }
        observed.extend(arguments.observations.iter().cloned());
        Ok(Self {
            probed,
            runs,
            observed,
        })
    }

    /// Refuses files that do not go together, or do not show how the axes stand to each other.
    fn are_sufficient(&self, arguments: &Arguments) -> Result<(), BadInput> {
        let has_readings = !(self.runs.is_empty() && self.observed.is_empty());
        if arguments.active.is_some() && has_readings {
            return Err(BadInput::new(
                "--active undoes a compensation in probings only, and there are readings of instruments",
                "identify probings alone, or read instruments with the compensation off",
            ));
        }
        if let ([(first, _), (second, _), ..], None) = (&self.probed[..], arguments.same) {
            return Err(BadInput::new(
                format!(
                    "{} and {} are both probings",
                    first.display(),
                    second.display()
                ),
                "say what stayed between them: --same stylus if only the balls were moved, --same balls if nothing was moved. If the stylus was changed, identify each file by itself, because one place of the stylus is found for all files",
            ));
        }
        if self.probed.is_empty() && self.observed.is_empty() {
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
}

/// The rows of all files, each of which is a run, or has runs of its own. Balls of a further file have its name, if they are
/// its own.
fn joined(files: Vec<(&PathBuf, Probings)>, same: Option<Same>) -> Probings {
    let is_alone = files.len() == 1;
    let stem = |path: &PathBuf| path.file_stem().unwrap_or_default().to_owned();
    let stems: Vec<_> = files.iter().map(|(path, _)| stem(path)).collect();
    let mut all = Probings::default();
    // The largest number of a run so far.
    let mut runs = 0.0_f64;
    for (number, (path, file)) in files.into_iter().enumerate() {
        let is_own = number > 0 && same != Some(Same::Balls);
        // Files in different folders may have one name.
        let of_file = match stems.iter().filter(|one| **one == stem(path)).count() {
            1 => stem(path).to_string_lossy().into_owned(),
            _ => format!("file {}, {}", number + 1, path.display()),
        };
        let name = |ball: &String| match is_own {
            true => format!("{ball} of {of_file}"),
            false => ball.clone(),
        };
        let before = runs;
        let names: Vec<String> = file.balls.iter().map(name).collect();
        for mut row in file.rows {
            let name = &names[row.ball];
            let known = all.balls.iter().position(|ball| ball == name);
            row.ball = known.unwrap_or(all.balls.len());
            if known.is_none() {
                all.balls.push(name.clone());
            }
            if !is_alone {
                let run = before + row.run.unwrap_or(1.0);
                runs = runs.max(run);
                row.run = Some(run);
            }
            all.rows.push(row);
        }
    }
    all
}
