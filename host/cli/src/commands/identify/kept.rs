//! Error motions that runs show, which `trueaxis identify` keeps as tables.

use super::super::bad_input::BadInput;
use super::super::measured::{motions, refused};
use super::Found;
use trueaxis_measure::direct::{DirectResult, Doubt, Measurement, kept, same_tables};
use trueaxis_measure::identify::{Identified, Model};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// Levers of angular motions, which are small, change tables by less in each round.
const ROUNDS: usize = 6;

/// What was found with tables of runs.
pub struct WithTables<T> {
    /// The errors known beforehand, with the tables.
    pub base: ErrorModel,
    pub identified: Identified,
    /// What else came with it.
    pub besides: T,
    /// The motions, if there are runs.
    pub kept: Option<DirectResult>,
}

/// Identifies with the tables that runs show on a machine with what is identified: again and again until both agree.
pub fn with_tables<T>(
    machine: &Machine,
    runs: &[Measurement],
    known: &ErrorModel,
    mut find: impl FnMut(&ErrorModel) -> Result<(Identified, T), BadInput>,
) -> Result<WithTables<T>, BadInput> {
    if runs.is_empty() {
        let (identified, besides) = find(known)?;
        return Ok(WithTables {
            base: known.clone(),
            identified,
            besides,
            kept: None,
        });
    }
    let tables = |found: &ErrorModel| {
        kept(machine, runs, known, found).map_err(|error| {
            refused(&error, runs).or(
                "give these files with --observations, and name parameters of these motions in --model",
            )
        })
    };
    let (mut base, _) = tables(known)?;
    let (mut identified, mut besides) = find(&base)?;
    for _ in 0..ROUNDS {
        let (next, solved) = tables(&identified.errors)?;
        if same_tables(&base, &next) {
            return Ok(WithTables {
                base,
                identified,
                besides,
                kept: Some(solved),
            });
        }
        (identified, besides) = find(&next)?;
        base = next;
    }
    Err(BadInput::new(
        format!(
            "the motions that the runs show and the other parameters do not settle within {ROUNDS} rounds"
        ),
        "give the runs with --observations, to fit all together",
    ))
}

/// Refuses names of parameters of motions that are kept as tables.
pub fn are_apart(
    machine: &Machine,
    model: &Model,
    parameters: &[Parameter],
    base: &ErrorModel,
) -> Result<(), BadInput> {
    let mut all = parameters.iter();
    let twice = all.find(|p| base.is_tabulated(machine, p));
    match (model, twice) {
        (Model::Named(_), Some(parameter)) => Err(BadInput::new(
            format!(
                "--model: {parameter} is part of {}, which is known as a table",
                &parameter.to_string()[..3]
            ),
            "leave it out of --model; or give its runs with --observations to fit it to them and to everything else",
        )),
        _ => Ok(()),
    }
}

/// The tables on the screen.
pub fn lines(text: &mut String, found: &Found<'_>) {
    let Some((runs, kept)) = found.kept else {
        return;
    };
    *text += "\nkept as tables\n";
    motions(text, found.machine, runs, kept);
}

/// What else shows in runs.
pub fn warnings(found: &Found<'_>) -> Vec<String> {
    let Some((runs, kept)) = found.kept else {
        return Vec::new();
    };
    let doubts = kept.doubts.iter();
    let doubts = doubts.filter(|doubt| !matches!(doubt, Doubt::Slope { .. }));
    doubts
        .map(|doubt| {
            let file = doubt.file().map_or("", |file| &runs[file].name);
            format!("{file}: {doubt}: {}", doubt.remedy())
        })
        .collect()
}
