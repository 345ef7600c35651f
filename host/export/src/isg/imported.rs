//! Parameters of such a file as an error file.

use super::COMPONENTS;
use super::parameters::{IsgParameters, IsgTable};
use crate::rigid_body::{AxisErrors, Chain, Error};
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::fmt::Write;
use trueaxis_model::machine::{Axis, Machine};
use trueaxis_model::source::FileError;

/// A centre of rotation (mm) may differ by as much from the machine file: an error of a mrad about it moves by a nm more.
const SAME_POINT: f64 = 1e-3;
/// A direction may: 1 µm over a metre.
const SAME_DIRECTION: f64 = 1e-6;

/// The errors as an error file, and notes about what it does not have. Locations of rotary axes become parameters; an angle
/// of a linear axis becomes the slope of its straightness, because it turns no more than the direction of this axis. The
/// control has errors in the coordinates of the machine, the error file in those of the axis.
///
/// # Errors
/// [`FileError`] for parameters that the machine does not have.
pub fn imported(
    parameters: &IsgParameters,
    machine: &Machine,
) -> Result<(String, Vec<String>), FileError> {
    if parameters.constants.is_empty() && parameters.tables.is_empty() {
        return Err(FileError::whole(
            "no parameters",
            "give a CSV of ISG, or a file of Etalon's variant Vendor",
        ));
    }
    once_each(parameters)?;
    let chain = Chain::new(machine);
    let mut motions = parameters.motions(machine)?;
    for table in &parameters.tables {
        let (_, axis) = table.motion(machine)?;
        is_of_machine(table, &machine.axes[axis])?;
    }
    let mut located: Vec<Error> = vec![[0.0; 6]; machine.axes.len()];
    let mut is_sloped = vec![false; machine.axes.len()];
    let (mut count, mut left_out) = (parameters.tables.len(), Vec::new());
    for (name, value, span) in &parameters.constants {
        let Some((component, index)) = location(name, machine) else {
            let Some(expected) = of_the_model(name, &chain) else {
                return Err(FileError::here(
                    span.clone(),
                    format!(
                        "`{name}` is neither an error of an axis that the machine has nor of the control's model of it"
                    ),
                    "look for misspelt names, give the machine file of this machine, or leave the parameter out",
                ));
            };
            if let Some((expected, _)) = expected.filter(|(v, same)| (v - value).abs() > *same) {
                return Err(FileError::here(
                    span.clone(),
                    format!(
                        "{name} is {value}, and by the machine file {:.6}",
                        expected + 0.0
                    ),
                    "give the machine file of this machine, in the coordinates of the control",
                ));
            }
            continue;
        };
        let axis = &machine.axes[index];
        if axis.letter.is_rotary() {
            located[index][component] = *value;
            count += 1;
            continue;
        }
        let angle =
            (component.checked_sub(3)).map_or(Vector3::zeros(), |k| Vector3::ith(k, *value));
        let slope = angle.cross(&chain.axes[index].direction);
        // A constant offset of a linear axis, or a rotation about itself, but for rounding.
        if *value != 0.0 && slope.norm() <= f64::EPSILON * value.abs() {
            left_out.push(name.clone());
            continue;
        }
        count += 1;
        is_sloped[index] |= slope.norm() > 0.0;
        let [x, y, z] = slope.into();
        motions[index].add(&AxisErrors {
            at: axis.travel.to_vec(),
            errors: (axis.travel.iter())
                .map(|q| [x * q, y * q, z * q, 0.0, 0.0, 0.0])
                .collect(),
        });
    }
    if count == 0 {
        return Err(FileError::here(
            parameters.constants[0].2.clone(),
            "there is no error of an axis in it that does more than move the datum",
            "A0C is the inclination of C about X, EXY a motion over the position of Y",
        ));
    }
    let mut notes = Vec::new();
    if !left_out.is_empty() {
        let left_out = left_out.join(", ");
        notes.push(format!(
            "not imported, because it moves only the datum: {left_out}"
        ));
    }
    let mut calibrated = String::new();
    for (index, axis) in machine.axes.iter().enumerate() {
        let [from, to] = axis.travel;
        let Some([low, high]) = covered(parameters, machine, index)? else {
            continue;
        };
        if axis.modulo || low <= from && high >= to {
            continue;
        }
        let letter = axis.letter;
        notes.push(format!(
            "tables of {letter} end at {low} and {high}: beyond, their end values are held"
        ));
        // Held motions are without slope, which a squareness keeps over the whole travel. An error file has ranges from 1 mm.
        let [low, high] = [low.max(from), high.min(to)];
        if !is_sloped[index] && high - low >= 1.0 {
            let _ = writeln!(calibrated, "{letter} = [{low:?}, {high:?}]");
        }
    }
    let name = toml::Value::from(machine.name.as_str());
    let mut text = format!("machine = {name}\n");
    for note in &notes {
        let _ = writeln!(text, "# {note}");
    }
    text += "# Squareness is in the slopes of straightness.\nslopes_beside_squareness = true\n";
    let mut parameters = String::new();
    for (axis, (placed, error)) in machine.axes.iter().zip(chain.axes.iter().zip(located)) {
        for (component, value) in COMPONENTS.iter().zip(placed.in_frame(error)) {
            if rounded(value) != 0.0 {
                let _ = writeln!(
                    parameters,
                    "E{component}0{} = {:?}",
                    axis.letter,
                    rounded(value)
                );
            }
        }
    }
    if !parameters.is_empty() {
        let _ = write!(text, "\n[parameters]\n{parameters}");
    }
    for (axis, (placed, motions)) in machine.axes.iter().zip(chain.axes.iter().zip(motions)) {
        let errors: Vec<Error> = (motions.errors.iter())
            .map(|error| placed.in_frame(*error))
            .collect();
        for (k, component) in COMPONENTS.iter().enumerate() {
            let values: Vec<f64> = errors.iter().map(|error| rounded(error[k])).collect();
            if values.iter().any(|v| *v != 0.0) {
                let unit = if k < 3 { "mm" } else { "rad" };
                text += &tabulated(
                    &format!("E{component}{}", axis.letter),
                    &motions.at,
                    &values,
                    unit,
                );
            }
        }
    }
    if !calibrated.is_empty() {
        let _ = write!(text, "\n[calibrated]\n{calibrated}");
    }
    Ok((text, notes))
}

/// The part of an axis' travel (mm, deg) that all its tables cover; one row is a constant.
fn covered(
    parameters: &IsgParameters,
    machine: &Machine,
    index: usize,
) -> Result<Option<[f64; 2]>, FileError> {
    let mut covered: Option<[f64; 2]> = None;
    for table in parameters.tables.iter().filter(|table| table.at.len() > 1) {
        if table.motion(machine)?.1 == index {
            let [low, high] = covered.unwrap_or([f64::MIN, f64::MAX]);
            let (first, last) = (table.at[0], table.at[table.at.len() - 1]);
            covered = Some([low.max(first), high.min(last)]);
        }
    }
    Ok(covered)
}

/// A parameter of the control's model: what it is by the machine file, if this has it, and how much it may differ from that.
fn of_the_model(name: &str, chain: &Chain<'_>) -> Option<Option<(f64, f64)>> {
    let letters: Vec<char> = name.chars().collect();
    let [kind, of, axis] = letters[..] else {
        return None;
    };
    let along = |letter: char| COMPONENTS[..3].iter().position(|c| *c == letter);
    let placed = |letter: char| chain.machine.index(letter).map(|index| &chain.axes[index]);
    Some(match (kind, of) {
        // Another tool may be longer, but not beside this one.
        ('P', '0') => {
            let k = along(axis)?;
            (chain.tool[k].abs() < SAME_DIRECTION).then_some((chain.tip[k], SAME_POINT))
        }
        ('N', '0') => along(axis).map(|_| None)?,
        ('P', _) if !"XYZ".contains(axis) => Some((placed(axis)?.point[along(of)?], SAME_POINT)),
        ('V', _) => Some((placed(axis)?.direction[along(of)?], SAME_DIRECTION)),
        // An offset of the positions of all tables.
        ('I', 'D') => along(axis).map(|_| Some((0.0, 0.0)))?,
        ('L', 'N') => COMPONENTS.contains(&axis).then_some(None)?,
        _ => return None,
    })
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

/// Without what is only rounding: 1 fm, or 1 pm over a metre.
fn rounded(value: f64) -> f64 {
    (value * 1e12).round() / 1e12 + 0.0
}

/// A table as the error file has it.
fn tabulated(name: &str, at: &[f64], values: &[f64], unit: &str) -> String {
    let list = |values: &[f64]| {
        let words = values.iter().map(|v| format!("{v:?}"));
        words.collect::<Vec<_>>().join(", ")
    };
    // One row is a constant; a table has two.
    let (at, values) = match (at, values) {
        ([p], [value]) => (list(&[p - 1.0, p + 1.0]), list(&[*value; 2])),
        _ => (list(at), list(values)),
    };
    format!("\n[tabulated.{name}]\nat = [{at}]\nvalue = [{values}]\nunit = \"{unit}\"\n")
}
