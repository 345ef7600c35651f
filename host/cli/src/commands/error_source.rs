//! Finds the line of an error file that explains a failed or too large correction.

use super::bad_input::BadInput;
use super::files::{MachineFiles, Text};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::{EntryKind, SingleEntry};
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;
use trueaxis_tables::compile::{CompileError, Warning};
use trueaxis_tables::schemes::SchemeError;

/// The line of a parameter or table, with a message about it.
fn at(
    files: &MachineFiles,
    (parameter, tabulated): (Parameter, bool),
    message: &str,
    label: String,
    remedy: &str,
) -> BadInput {
    let place = Text::read(&files.errors).ok().and_then(|text| {
        let span = ErrorModel::place(&text.text, parameter, tabulated)?;
        Some(text.bad(FileError::at(span, message, label, remedy)))
    });
    place.unwrap_or_else(|| BadInput::new(message, remedy))
}

/// A correction that does not converge: points to the largest error.
pub fn not_converged(
    message: &str,
    files: &MachineFiles,
    machine: &Machine,
    errors: &ErrorModel,
) -> BadInput {
    let remedy = SchemeError::NotConverged(NotConverged {
        step: 0.0,
        iterations: 0,
    })
    .remedy();
    let size = |alone: &SingleEntry<'_>| match alone.parameter.is_angular() {
        // An angular error moves the tip of a 1 m tool by this much. 0.1 rad is the most that a file may contain.
        true => alone.size() * 1e3,
        false => alone.size(),
    };
    let all = SingleEntry::all(machine, errors);
    let Some(largest) = all.iter().max_by(|a, b| size(a).total_cmp(&size(b))) else {
        return BadInput::new(message, remedy);
    };
    let tabulated = matches!(largest.said, EntryKind::Table | EntryKind::TableReversal);
    let unit = match largest.parameter.is_angular() {
        true => "rad",
        false => "mm",
    };
    let label = format!("the largest of the errors: up to {} {unit}", largest.size());
    at(
        files,
        (largest.parameter, tabulated),
        message,
        label,
        remedy,
    )
}

/// Errors of `compile` and `verify`.
pub fn compile(
    error: CompileError,
    files: &MachineFiles,
    machine: &Machine,
    errors: &ErrorModel,
) -> BadInput {
    let message = error.to_string();
    match &error {
        CompileError::NotConverged(_) | CompileError::Scheme(SchemeError::NotConverged(_)) => {
            not_converged(&message, files, machine, errors)
        }
        CompileError::TooLarge { warning, unit, .. } => match named(warning) {
            Some((found, part)) => {
                let label = format!("{part:.3} {unit} of it");
                at(files, found, &message, label, error.remedy())
            }
            None => error.into(),
        },
        CompileError::TooFast(too_fast) => {
            let text = Text::read(&files.machine).ok();
            let place = text.and_then(|text| {
                let (axis, of_acceleration) = (too_fast.axis, too_fast.is_acceleration);
                let span = Machine::correction_limit_place(&text.text, axis, of_acceleration)?;
                Some(text.bad(FileError::at(span, &*message, "this limit", error.remedy())))
            });
            place.unwrap_or_else(|| error.into())
        }
        _ => error.into(),
    }
}

/// The parameter, or the table of a motion, that contributes most to a correction, and its share.
fn named(warning: &Warning) -> Option<((Parameter, bool), f64)> {
    let Warning::Large {
        culprit: Some(culprit),
        ..
    } = warning
    else {
        return None;
    };
    let found = match culprit.parameter.strip_prefix("the table ") {
        None => (Parameter::parse(&culprit.parameter)?, false),
        Some(motion) => {
            let (component, axis) = Parameter::parse_motion(motion)?;
            let kind = ParameterKind::Degree(0);
            let parameter = Parameter {
                component,
                axis,
                kind,
            };
            (parameter, true)
        }
    };
    Some((found, culprit.part))
}
