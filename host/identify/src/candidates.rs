//! The parameters that `auto` starts from.

use crate::locations::{self, minimal};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::{Axis, Machine};

/// Form of the motions of an axis that rotates by a full turn but has limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotationForm {
    /// Harmonics: the same after each turn.
    Harmonics,
    /// Polynomials: cables wind up, for example.
    Polynomials,
}

impl RotationForm {
    /// The forms that differ on this machine.
    pub(crate) fn of(machine: &Machine) -> &'static [Self] {
        let is_either = |axis: &Axis| turns_round(axis) && !axis.modulo;
        match machine.axes.iter().any(is_either) {
            true => &[Self::Harmonics, Self::Polynomials],
            false => &[Self::Harmonics],
        }
    }
}

/// A full turn, deg.
const TURN: f64 = 360.0;

fn turns_round(axis: &Axis) -> bool {
    let [low, high] = axis.travel;
    axis.letter.is_rotary() && (axis.modulo || high - low >= TURN)
}

/// The fewest parameters that a machine is identified with: the location errors that show whatever the stylus is, the
/// scales of the linear axes (relative to that of X unless something `has_length`), and backlash. These are the
/// fixed models' parameters.
pub(crate) fn fewest(machine: &Machine, has_length: bool, directions: &[bool]) -> Vec<Parameter> {
    let mut parameters = minimal(machine);
    let scales = scales(machine).skip(usize::from(!has_length));
    parameters.extend(scales);
    parameters.extend(backlash(machine, directions));
    possible(machine, parameters)
}

/// All parameters that a machine can have up to a degree: locations; motions of linear axes and of rotary axes with
/// less than a turn, as polynomials (from degree 1, because constants are locations); motions of other rotary axes
/// in the given form; backlash.
pub(crate) fn candidates(
    machine: &Machine,
    degree: u8,
    form: RotationForm,
    directions: &[bool],
) -> Vec<Parameter> {
    let mut parameters = locations::all(machine);
    for k in 1..=degree {
        for axis in &machine.axes {
            for component in 0..6 {
                parameters.extend(of_degree(axis, component, k, form));
            }
        }
    }
    if degree == 0 {
        // Locations alone would omit errors that every machine has.
        parameters.extend(scales(machine));
    }
    parameters.extend(backlash(machine, directions));
    possible(machine, parameters)
}

/// The coefficients of one degree of an error motion.
pub(crate) fn of_degree(
    axis: &Axis,
    component: usize,
    degree: u8,
    form: RotationForm,
) -> Vec<Parameter> {
    let is_harmonic = turns_round(axis) && (axis.modulo || form == RotationForm::Harmonics);
    let kinds = match is_harmonic {
        true => vec![ParameterKind::Cosine(degree), ParameterKind::Sine(degree)],
        false => vec![ParameterKind::Degree(degree)],
    };
    let axis = axis.letter.char();
    let of = |kind| Parameter {
        component,
        axis,
        kind,
    };
    kinds.into_iter().map(of).collect()
}

/// True if a motion with this parameter holds its end value outside the range in which it was measured: from degree 2, and
/// with harmonics on axes that are not endless.
pub(crate) fn holds(machine: &Machine, parameter: &Parameter) -> bool {
    let axis = machine.index(parameter.axis).map(|i| &machine.axes[i]);
    match parameter.kind {
        ParameterKind::Degree(k) => k >= 2,
        ParameterKind::Cosine(_) | ParameterKind::Sine(_) => axis.is_some_and(|a| !a.modulo),
        _ => false,
    }
}

fn scales(machine: &Machine) -> impl Iterator<Item = Parameter> {
    let letters = machine.axes.iter().map(|axis| axis.letter);
    let mut linear: Vec<char> = (letters.filter(|letter| !letter.is_rotary()))
        .map(|letter| letter.char())
        .collect();
    linear.sort_by_key(|letter| "XYZUVW".find(*letter));
    linear.into_iter().map(Parameter::scale)
}

/// Of the axes that are marked.
pub(crate) fn backlash(machine: &Machine, axes: &[bool]) -> impl Iterator<Item = Parameter> {
    let marked = machine.axes.iter().zip(axes);
    marked
        .filter(|(_, is_marked)| **is_marked)
        .map(|(axis, _)| {
            let letter = axis.letter.char();
            Parameter {
                component: direction(letter) + if axis.letter.is_rotary() { 3 } else { 0 },
                axis: letter,
                kind: ParameterKind::Backlash,
            }
        })
}

/// Without degrees and harmonics above the maximum.
fn possible(machine: &Machine, mut parameters: Vec<Parameter>) -> Vec<Parameter> {
    let mut known = ErrorModel::perfect(machine);
    parameters.retain(|p| known.set(machine, *p, 0.0));
    parameters
}

/// The direction of an axis by its letter: 0, 1, 2.
pub(crate) fn direction(letter: char) -> usize {
    "XYZABCUVW".find(letter).unwrap_or(0) % 3
}
