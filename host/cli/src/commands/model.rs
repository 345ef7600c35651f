//! `trueaxis model`, for the page for browsers: the data that it draws a machine from.

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, MachineFiles};
use super::output;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use trueaxis_model::errors::Parameter;
use trueaxis_model::explain::explain;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_report::{PageModel, parameter_in_words};
use trueaxis_tables::compile::belongs;

/// Print the data from which the page draws the machine, as JSON
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    /// The compensation
    blob: Option<PathBuf>,
}

#[derive(Serialize)]
struct Answer<'a> {
    machine: &'a str,
    model: PageModel,
    /// The parameters of the error file: name, and the sentence of `explain`.
    explained: Vec<(String, String)>,
    /// The parameters that a person may add: name, and what it is.
    known: Vec<(String, String)>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let (machine, errors) = arguments.files.read()?;
    let bytes = arguments.blob.as_ref().map(|path| files::read_blob(path));
    let bytes = bytes.transpose()?;
    // Tables of another machine or of other errors are left out.
    let runtime = bytes.as_ref().and_then(|blob| Runtime::load(blob).ok());
    let runtime = runtime.filter(|runtime| belongs(&machine, &errors, runtime).is_ok());
    let explained = explain(&machine, &errors);
    output::print_json(&Answer {
        machine: &machine.name,
        model: PageModel::new(&machine, &errors, runtime.as_ref()),
        explained: explained
            .iter()
            .map(|one| (one.alone.parameter.to_string(), one.sentence()))
            .collect(),
        known: known(&machine),
    })?;
    Ok(Outcome::Done)
}

/// Locations and the first two degrees of motions, with two harmonics and the backlash of rotary axes.
fn known(machine: &Machine) -> Vec<(String, String)> {
    let axes = machine.axes.iter().map(|axis| axis.letter.char());
    let kinds = |letter: char| match letter {
        'S' => vec![],
        'A'..='C' => vec!["0", "1", "2", "c1", "s1", "c2", "s2", "b"],
        _ => vec!["0", "1", "2", "3", "b"],
    };
    let mut all = Vec::new();
    for letter in axes.chain(['S']) {
        for component in "XYZABC".chars() {
            let motions = kinds(letter).into_iter();
            let motions = motions.map(|kind| format!("E{component}{letter}{kind}"));
            all.extend(
                [format!("E{component}0{letter}")]
                    .into_iter()
                    .chain(motions),
            );
        }
    }
    all.into_iter()
        .filter_map(|name| Some((name.clone(), parameter_in_words(Parameter::parse(&name)?))))
        .collect()
}
