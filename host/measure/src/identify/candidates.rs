//! The parameters that `auto` starts from.

use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::{Axis, Machine};

/// Form of the motions of an axis that rotates by a full turn but has limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Harmonics: the same after each turn.
    Harmonics,
    /// Polynomials: cables wind up, for example.
    Polynomials,
}

impl Form {
    /// The forms that differ on this machine.
    pub(super) fn of(machine: &Machine) -> &'static [Self] {
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

/// All parameters that a machine can have up to a degree: locations; motions of linear axes and of rotary axes with
/// less than a turn, as polynomials (from degree 1, because constants are locations); motions of other rotary axes
/// in the given form; backlash.
pub(super) fn candidates(
    machine: &Machine,
    degree: u8,
    form: Form,
    directions: &[bool],
) -> Vec<Parameter> {
    let letters: Vec<char> = machine.axes.iter().map(|a| a.letter.char()).collect();
    let six = |axis: char, kind| {
        (0..6).map(move |component| Parameter {
            component,
            axis,
            kind,
        })
    };
    let mut parameters: Vec<Parameter> = Vec::new();
    for axis in letters.iter().copied().chain(['S']) {
        parameters.extend(six(axis, ParameterKind::Inter));
    }
    for k in 1..=degree {
        for axis in &machine.axes {
            let letter = axis.letter.char();
            if turns_round(axis) && (axis.modulo || form == Form::Harmonics) {
                parameters.extend(six(letter, ParameterKind::Cosine(k)));
                parameters.extend(six(letter, ParameterKind::Sine(k)));
            } else {
                parameters.extend(six(letter, ParameterKind::Degree(k)));
            }
        }
    }
    if degree == 0 {
        // Locations alone would omit errors that every machine has.
        let linear = letters.iter().filter(|l| "XYZUVW".contains(**l));
        parameters.extend(linear.map(|axis| Parameter {
            component: direction(*axis),
            axis: *axis,
            kind: ParameterKind::Degree(1),
        }));
    }
    for (axis, known) in letters.iter().zip(directions) {
        let own = direction(*axis) + if "ABC".contains(*axis) { 3 } else { 0 };
        parameters.extend(known.then_some(Parameter {
            component: own,
            axis: *axis,
            kind: ParameterKind::Backlash,
        }));
    }
    // Skip degrees and harmonics above the maximum.
    let mut known = ErrorModel::perfect(machine);
    parameters.retain(|p| known.set(machine, *p, 0.0));
    parameters
}

/// The direction of an axis by its letter: 0, 1, 2.
pub(super) fn direction(letter: char) -> usize {
    "XYZABCUVW".find(letter).unwrap_or(0) % 3
}
