//! Writes measured errors as an error file.

use crate::measurement::{MeasuredRuns, Measurement};
use crate::motion::name;
use crate::solve::DirectResult;
use crate::warnings::counted_twice;
use std::fmt::Write;
use trueaxis_model::errors::{ErrorModel, Table};
use trueaxis_model::machine::{Axis, Machine};
use trueaxis_model::validate::calibrated;

/// An error file with everything that was known before, and everything that was measured, with comments.
#[must_use]
pub fn error_file(machine: &Machine, measurements: &[Measurement], found: &DirectResult) -> String {
    let errors = &found.errors;
    let mut text = format!("machine = {}\n", toml::Value::from(machine.name.as_str()));
    if !counted_twice(machine, errors).is_empty() {
        // Known errors were included.
        text += "slopes_beside_squareness = true\n";
    }
    if !errors.parameters.is_empty() {
        text += "\n[parameters]  # mm, rad, mm/mm; coefficients per mm or rad to their degree\n";
    }
    for (parameter, value) in &errors.parameters {
        let location = found.locations.iter().find(|l| l.parameter == *parameter);
        let from = location.map(|l| format!("  # {}", comment(&measurements[l.from].name)));
        let from = from.unwrap_or_default();
        let _ = writeln!(text, "{parameter} = {value:.6e}{from}");
    }
    if !errors.standard_uncertainty.is_empty() {
        text += "\n[standard_uncertainty]\n";
    }
    for (parameter, value) in &errors.standard_uncertainty {
        let _ = writeln!(text, "{parameter} = {value:.3e}");
    }
    text += &of_before(errors);
    let before: Vec<usize> = (0..machine.axes.len())
        .filter(|i| is_limited(machine, found, *i))
        .collect();
    if !before.is_empty() {
        text += "\n[calibrated]  # mm or deg: where motions are known that were known before\n";
    }
    for i in before {
        let axis = &machine.axes[i];
        let [low, high] = errors.calibrated[i].map(|q| axis.to_command(q));
        let _ = writeln!(text, "{} = [{low:?}, {high:?}]", axis.letter);
    }
    tables(&mut text, machine, errors, &|index, component| {
        let motions = found.motions.iter();
        let own = motions.filter(|m| (m.axis, m.component) == (index, component));
        own.map(|m| how(machine, &measurements[m.from])).collect()
    });
    text
}

/// `[tabulated]`: every table of the errors with its uncertainty; `notes` says how a motion was measured.
pub fn tables(
    text: &mut String,
    machine: &Machine,
    errors: &ErrorModel,
    notes: &dyn Fn(usize, usize) -> Vec<String>,
) {
    for (index, axis) in machine.axes.iter().enumerate() {
        for (component, motion) in errors.motions[index].iter().enumerate() {
            let Some(table) = &motion.table else {
                continue;
            };
            let name = name(machine, index, component);
            let _ = writeln!(text, "\n[tabulated.{name}]");
            for note in notes(index, component) {
                let _ = writeln!(text, "# {note}");
            }
            let uncertainty = errors.table_uncertainty.get(&(index, component));
            write_table(text, axis, table, component >= 3, uncertainty);
        }
    }
}

/// What an earlier identification says of the tip, and the errors that it could not show and that still are not measured.
fn of_before(errors: &ErrorModel) -> String {
    let mut text = String::new();
    if errors.misfit.is_some() || errors.misfit_of_direction.is_some() {
        text += "\n[uncertainty]\n";
    }
    if let Some(misfit) = errors.misfit {
        let _ = writeln!(text, "misfit_um = {:.3}", misfit * 1e3);
    }
    if let Some(misfit) = errors.misfit_of_direction {
        let _ = writeln!(text, "misfit_urad = {:.3}", misfit * 1e6);
    }
    if !errors.unseen.is_empty() {
        text += "\n[unseen]  # may exist, not measured\n";
    }
    for (parameter, um) in &errors.unseen {
        let _ = writeln!(text, "{parameter} = {um:?}");
    }
    text
}

/// True if what was known of an axis before is not known everywhere: motions hold their end values, or the range that was
/// probed is a part of the travel.
fn is_limited(machine: &Machine, found: &DirectResult, index: usize) -> bool {
    let anew = |component: usize| {
        let mut motions = found.motions.iter();
        motions.any(|m| (m.axis, m.component) == (index, component))
    };
    let motions = found.errors.motions[index].iter().enumerate();
    let mut old = motions.filter(|(component, _)| !anew(*component));
    let [low, high] = calibrated(machine, &found.errors, index);
    let [from, to] = machine.axes[index].travel;
    let is_part = low > from + 1e-9 || high < to - 1e-9;
    let is_measured = found.motions.iter().any(|m| m.axis == index);
    is_part && !is_measured || old.any(|(_, motion)| motion.holds() || is_part && !motion.is_zero())
}

/// A name reduced to one line.
fn comment(name: &str) -> String {
    name.replace(char::is_control, " ")
}

/// Describes how an error was measured.
fn how(machine: &Machine, measurement: &Measurement) -> String {
    let name = comment(&measurement.name);
    match &measurement.measured {
        MeasuredRuns::Line(line) => format!("{name}: {}", line.setup.words(machine)),
        MeasuredRuns::Square(_) => name,
    }
}

fn write_table(
    text: &mut String,
    axis: &Axis,
    table: &Table,
    is_angular: bool,
    uncertainty: Option<&Vec<f64>>,
) {
    let (factor, unit) = match is_angular {
        true => (1e6, "urad"),
        false => (1e3, "um"),
    };
    let mut list = |key: &str, values: &mut dyn Iterator<Item = String>| list(text, key, values);
    // Degrees without rounding errors from radians.
    let place = |at: &f64| format!("{:?}", (axis.to_command(*at) * 1e9).round() / 1e9 + 0.0);
    list("at", &mut table.at.iter().map(place));
    let value = |v: &f64| format!("{:?}", (v * factor * 1e6).round() / 1e6 + 0.0);
    match &table.negative {
        None => list("value", &mut table.positive.iter().map(value)),
        Some(negative) => {
            list("positive", &mut table.positive.iter().map(value));
            list("negative", &mut negative.iter().map(value));
        }
    }
    // Four digits, like those of parameters.
    let uncertain = |u: &f64| format!("{:.3e}", u * factor);
    match uncertainty {
        Some(all) if all.windows(2).any(|w| w[0] != w[1]) => {
            list("standard_uncertainty", &mut all.iter().map(uncertain));
        }
        Some(all) => {
            let one = all.first().map(uncertain);
            let _ = writeln!(text, "standard_uncertainty = {}", one.unwrap_or_default());
        }
        None => {}
    }
    let _ = writeln!(text, "unit = \"{unit}\"");
}

fn list(text: &mut String, key: &str, values: &mut dyn Iterator<Item = String>) {
    let _ = writeln!(text, "{key} = [");
    let values: Vec<String> = values.collect();
    for row in values.chunks(12) {
        let _ = writeln!(text, "    {},", row.join(", "));
    }
    text.push_str("]\n");
}
