//! The files of measurements of `trueaxis identify`, each recognised by its header.

use super::super::bad_input::BadInput;
use super::super::files::{self, Text};
use super::Arguments;
use std::path::PathBuf;
use trueaxis_measure::direct::{Measured, Measurement};
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::kind::{FileKind, kind};
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::{self, Probings};
use trueaxis_measure::formats::runs;
use trueaxis_model::machine::Machine;

/// What was measured.
pub struct Inputs {
    pub probings: Probings,
    /// Instruments in the adjustment: ball-bars, squares, other observations, and runs of `--observations`.
    pub observations: Observations,
    /// Runs whose motions are kept as tables.
    pub runs: Vec<Measurement>,
}

impl Inputs {
    pub fn read(
        arguments: &Arguments,
        machine: &Machine,
        artefact: &Artefact,
    ) -> Result<Self, BadInput> {
        let mut probed: Option<(&PathBuf, Probings)> = None;
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
                    if let Some((other, _)) = probed.replace((path, rows)) {
                        return Err(BadInput::new(
                            format!(
                                "{} and {} are both probings",
                                other.display(),
                                path.display()
                            ),
                            "join them into one file with a column `run`; balls that were moved in between get new names",
                        ));
                    }
                }
                FileKind::Runs => {
                    match runs::read(&text.text, machine).map_err(|e| text.bad(e))? {
                        // What a square shows, other instruments show too.
                        Measured::Square(_) => observed.push(path.clone()),
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
        let observations = files::read_observations(&observed, machine)?;
        if arguments.active.is_some() && !(runs.is_empty() && observed.is_empty()) {
            return Err(BadInput::new(
                "--active undoes a compensation in probings only, and there are readings of instruments",
                "identify probings alone, or read instruments with the compensation off",
            ));
        }
        if probed.is_none() && observed.is_empty() {
            return Err(BadInput::new(
                format!(
                    "{}: runs alone show the motions of each axis, not how the axes stand to each other",
                    arguments.names()
                ),
                "add a ball-bar, a square or probings; or write the motions with `trueaxis measured`",
            ));
        }
        Ok(Self {
            probings: probed.map(|(_, rows)| rows).unwrap_or_default(),
            observations,
            runs,
        })
    }
}
