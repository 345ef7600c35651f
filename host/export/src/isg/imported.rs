//! Parameters of such a file as an error file.

use super::COMPONENTS;
use super::parameters::{IsgParameters, IsgTable};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::ops::Range;
use trueaxis_model::machine::{Axis, Machine};
use trueaxis_model::source::FileError;

/// The straightness (component) that an angle of the direction of a linear axis causes, and its sign: an axis along k that
/// is turned about i moves along i × k.
fn slope(along: usize, about: usize) -> Option<(usize, f64)> {
    match (about + 3 - along) % 3 {
        1 => Some(((about + 1) % 3, -1.0)),
        2 => Some(((about + 2) % 3, 1.0)),
        _ => None,
    }
}

/// The errors as an error file. Locations of rotary axes become parameters; an angle of a linear axis becomes the slope of
/// its straightness, because it turns no more than the direction of this axis.
///
/// # Errors
/// [`FileError`] for parameters that the machine does not have.
pub fn imported(parameters: &IsgParameters, machine: &Machine) -> Result<String, FileError> {
    if parameters.constants.is_empty() && parameters.tables.is_empty() {
        return Err(FileError::whole(
            "no parameters",
            "give a CSV of ISG, or a file of Etalon's variant Vendor",
        ));
    }
    once_each(parameters)?;
    let (mut located, mut left_out) = (String::new(), Vec::new());
    let mut tables = parameters.tables.clone();
    for (name, value, span) in &parameters.constants {
        let Some((component, index)) = location(name, machine) else {
            if !name.starts_with(['P', 'N', 'V', 'I', 'L']) {
                return Err(FileError::here(
                    span.clone(),
                    format!("`{name}` is no error of an axis that the machine has"),
                    "give the machine file of this machine, or leave the parameter out",
                ));
            }
            left_out.push(name.clone());
            continue;
        };
        let axis = &machine.axes[index];
        if *value == 0.0 {
            continue;
        }
        if axis.letter.is_rotary() {
            let _ = writeln!(located, "E{name} = {value:?}");
            continue;
        }
        let along = axis.letter.component();
        let turned = component
            .checked_sub(3)
            .and_then(|about| slope(along, about));
        let Some((straightness, sign)) = turned else {
            // A constant offset of a linear axis, or a rotation about itself.
            left_out.push(name.clone());
            continue;
        };
        // The rotation turns the way that the axis moves, which is against the command if it is reversed.
        let slope = if axis.reversed {
            -sign * value
        } else {
            sign * value
        };
        add_slope(&mut tables, COMPONENTS[straightness], axis, slope, span);
    }
    if left_out.len() == parameters.constants.len() && tables.is_empty() {
        return Err(FileError::here(
            parameters.constants[0].2.clone(),
            format!(
                "there is no error of an axis in it: {} are of the control's own model, or move only the datum",
                left_out.join(", ")
            ),
            "look for misspelt names: A0C is the inclination of C about X, EXY a motion over the position of Y",
        ));
    }
    let name = toml::Value::from(machine.name.as_str());
    let mut text = format!("machine = {name}\n");
    if !left_out.is_empty() {
        let _ = writeln!(
            text,
            "# Not imported, because it is of the control's own model or moves only the datum: {}.",
            left_out.join(", ")
        );
    }
    text += "# Squareness is in the slopes of straightness.\nslopes_beside_squareness = true\n";
    if !located.is_empty() {
        let _ = write!(text, "\n[parameters]\n{located}");
    }
    for table in tables {
        let (component, axis) = table.motion(machine)?;
        is_of_machine(&table, &machine.axes[axis])?;
        if table.values.iter().any(|v| *v != 0.0) {
            text += &tabulated(table, component);
        }
    }
    Ok(text)
}

/// Refuses a parameter that is there twice: neither is known to be the right one.
fn once_each(parameters: &IsgParameters) -> Result<(), FileError> {
    let constants = parameters
        .constants
        .iter()
        .map(|(name, _, span)| (name, span));
    let tables = parameters
        .tables
        .iter()
        .map(|table| (&table.name, &table.span));
    let mut seen = BTreeSet::new();
    for (name, span) in constants.chain(tables) {
        if !seen.insert(name) {
            return Err(FileError::here(
                span.clone(),
                format!("`{name}` is given twice"),
                "leave one of them out",
            ));
        }
    }
    Ok(())
}

/// A table of this machine has a part of its axis' travel.
fn is_of_machine(table: &IsgTable, axis: &Axis) -> Result<(), FileError> {
    let [low, high] = axis.travel;
    let (Some(first), Some(last)) = (table.at.first(), table.at.last()) else {
        return Ok(());
    };
    if axis.modulo || *first < high && *last > low {
        return Ok(());
    }
    Err(FileError::here(
        table.span.clone(),
        format!(
            "{} from {first} to {last}, and {} travels from {low} to {high}",
            table.name, axis.letter
        ),
        "give the machine file of this machine",
    ))
}

/// The component and the axis (by its index) of a location, like `A0Z`.
fn location(name: &str, machine: &Machine) -> Option<(usize, usize)> {
    let letters: Vec<char> = name.chars().collect();
    let [error, '0', axis] = letters[..] else {
        return None;
    };
    let component = COMPONENTS.iter().position(|c| *c == error);
    component.zip(machine.index(axis))
}

/// Adds the slope of a straightness to its table, or makes one.
fn add_slope(
    tables: &mut Vec<IsgTable>,
    straightness: char,
    axis: &Axis,
    slope: f64,
    span: &Range<usize>,
) {
    let motion = format!("E{straightness}{}", axis.letter);
    match tables.iter_mut().find(|table| table.name == motion) {
        Some(table) => {
            for (value, at) in table.values.iter_mut().zip(&table.at) {
                *value += slope * at;
            }
        }
        None => tables.push(IsgTable {
            name: motion,
            argument: axis.letter.char(),
            at: axis.travel.to_vec(),
            values: axis.travel.iter().map(|at| slope * at).collect(),
            span: span.clone(),
        }),
    }
}

/// A table as the error file has it.
fn tabulated(table: IsgTable, component: usize) -> String {
    let (mut at, mut values) = (table.at, table.values);
    // One row is a constant; a table has two.
    if let ([p], [value]) = (&at[..], &values[..]) {
        (at, values) = (vec![p - 1.0, p + 1.0], vec![*value; 2]);
    }
    let list = |values: &[f64]| {
        let words = values
            .iter()
            .map(|v| format!("{:?}", (v * 1e12).round() / 1e12 + 0.0));
        words.collect::<Vec<_>>().join(", ")
    };
    let unit = if component < 3 { "mm" } else { "rad" };
    format!(
        "\n[tabulated.{}]\nat = [{}]\nvalue = [{}]\nunit = \"{unit}\"\n",
        table.name,
        list(&at),
        list(&values)
    )
}
