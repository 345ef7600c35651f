//! Parameters and figures in everyday terms.

use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::explain::{EntryKind, SingleEntry, number};

const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// The unit in which a parameter is displayed, and the factor for its value (mm, rad); no factor if it is displayed
/// as in files.
#[must_use]
pub fn unit(parameter: Parameter) -> (Option<f64>, &'static str) {
    match (parameter.kind, parameter.is_angular()) {
        (ParameterKind::Degree(1), false) if "XYZUVW".contains(parameter.axis) => {
            (Some(1e6), "µm/m")
        }
        (ParameterKind::Degree(k), angular) if k > 0 => (
            None,
            if angular {
                "rad per mm or rad to the degree"
            } else {
                "mm per mm or rad to the degree"
            },
        ),
        (_, true) => (Some(1e6), "µrad"),
        (_, false) => (Some(1e3), "µm"),
    }
}

/// The value of a parameter with its unit: `−0.87 µm/m`; for a coefficient of a motion `12.00 µrad/m²`, per kelvin
/// `1.50 µm/K`. As in files if it is not a parameter.
pub fn quantity(name: &str, value: f64) -> String {
    let text = match in_unit(name) {
        Some((factor, unit)) => format!("{:.2} {unit}", value * factor),
        None => number(value),
    };
    text.replace('-', "−")
}

/// The factor for a parameter's value and the unit that it is then in, as [`quantity`] shows it; `None` if it is not a
/// parameter.
pub(crate) fn in_unit(name: &str) -> Option<(f64, String)> {
    let (name, per_kelvin) = match name.split_once(" (per K") {
        Some((name, _)) => (name, "/K"),
        None => (name, ""),
    };
    let (factor, unit) = Parameter::parse(name).map(shown)?;
    Some((factor, format!("{unit}{per_kelvin}")))
}

/// Like [`unit()`], with coefficients of motions in µm or µrad per metre or radian to the power of their degree.
fn shown(parameter: Parameter) -> (f64, String) {
    let coefficient = match (unit(parameter), parameter.kind) {
        ((Some(factor), unit), _) => return (factor, unit.to_owned()),
        (_, ParameterKind::Degree(k)) => k,
        ((None, unit), _) => return (1.0, unit.to_owned()),
    };
    let (small, unit) = match parameter.is_angular() {
        true => (1e6, "µrad"),
        false => (1e3, "µm"),
    };
    let (metres, per) = match is_rotary(parameter.axis) {
        true => (1.0, "rad"),
        false => (1e3_f64, "m"),
    };
    let degree = match coefficient {
        1 => String::new(),
        2 => "²".to_owned(),
        3 => "³".to_owned(),
        k => format!("^{k}"),
    };
    (
        small * metres.powi(i32::from(coefficient)),
        format!("{unit}/{per}{degree}"),
    )
}

/// The name of an entry of an error file: `EZ0S`, `EXX (table)`.
pub fn name(alone: &SingleEntry<'_>) -> String {
    let name = alone.parameter.to_string();
    let motion = &name[..3.min(name.len())];
    match &alone.said {
        EntryKind::Parameter(_) => name,
        EntryKind::Table => format!("{motion} (table)"),
        EntryKind::TableReversal => format!("{motion} (reversal)"),
        EntryKind::PerKelvin { sensor, .. } => format!("{name} (per K of {sensor})"),
    }
}

/// Description: `the spindle's Z position`.
pub(crate) fn in_words(alone: &SingleEntry<'_>) -> String {
    described(alone.parameter, &alone.said)
}

/// The description of a parameter: `the spindle's Z position`.
#[must_use]
pub fn parameter_in_words(parameter: Parameter) -> String {
    described(parameter, &EntryKind::Parameter(0.0))
}

/// An inter-axis error along or about a direction of the machine.
fn location(axis: char, about: char, angular: bool) -> String {
    match (axis, angular) {
        ('S', false) => format!("the spindle's {about} position"),
        ('S', true) => format!("the spindle's inclination about {about}"),
        (_, true) if is_rotary(axis) && about == along(axis) => {
            format!("the zero position of axis {axis}")
        }
        (_, false) => format!("the {about} position of axis {axis}"),
        (_, true) => format!("the inclination of axis {axis} about {about}"),
    }
}

fn described(parameter: Parameter, said: &EntryKind) -> String {
    let (component, axis, kind) = (parameter.component, parameter.axis, parameter.kind);
    let about = AXES[component % 3];
    let angular = parameter.is_angular();
    let own = along(axis);
    let rotary = is_rotary(axis);
    let motion = || motion_in_words(component, axis);
    let words = match (said, kind) {
        (EntryKind::Table, _) => format!("{}, as measured", motion()),
        (EntryKind::TableReversal, _) => format!("{}, between its two directions", motion()),
        (_, ParameterKind::Inter) => location(axis, about, angular),
        (_, ParameterKind::Backlash) if angular == rotary && about == own => {
            format!("the backlash of {axis}")
        }
        (_, ParameterKind::Backlash) => {
            format!("{}, between its two directions", motion())
        }
        (_, ParameterKind::Degree(1)) if !rotary && !angular && about == own => {
            format!("the scale of {axis}")
        }
        (_, ParameterKind::Degree(2)) if !rotary && !angular && about != own => {
            format!("the bow of {axis} in {about}")
        }
        (_, ParameterKind::Degree(0)) => format!("a constant in {}", motion()),
        (_, ParameterKind::Degree(1)) => format!("a slope in {}", motion()),
        (_, ParameterKind::Degree(k)) => format!("degree {k} of {}", motion()),
        (_, ParameterKind::Cosine(1) | ParameterKind::Sine(1)) => {
            format!("once a turn in {}", motion())
        }
        (_, ParameterKind::Cosine(k) | ParameterKind::Sine(k)) => {
            format!("{k} times a turn in {}", motion())
        }
    };
    match said {
        EntryKind::PerKelvin { sensor, .. } => format!("{words}, as {sensor} warms"),
        _ => words,
    }
}

/// True for the letter of a rotary axis.
pub fn is_rotary(axis: char) -> bool {
    matches!(axis, 'A' | 'B' | 'C')
}

/// The coordinate axis that an axis moves along or rotates about.
fn along(axis: char) -> char {
    match axis {
        'X' | 'U' | 'A' => 'X',
        'Y' | 'V' | 'B' => 'Y',
        _ => 'Z',
    }
}

/// The description of an error motion by its component 0…5 and axis: `the straightness of X in Y`.
pub(crate) fn motion_in_words(component: usize, axis: char) -> String {
    let about = AXES[component % 3];
    match (is_rotary(axis), component >= 3, about == along(axis)) {
        (false, false, true) => format!("the positioning of {axis}"),
        (false, false, false) => format!("the straightness of {axis} in {about}"),
        (false, true, true) => format!("the roll of {axis}"),
        (false, true, false) => format!("the tilt of {axis} about {about} as it moves"),
        (true, true, true) => format!("the angular positioning of {axis}"),
        (true, false, true) => format!("the axial motion of {axis}"),
        (true, false, false) => format!("the radial motion of {axis} in {about}"),
        (true, true, false) => format!("the tilt of {axis} about {about} as it turns"),
    }
}

/// Capitalizes the first letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => String::new(),
    }
}

/// A figure with two digits, or all digits before the decimal point; with a true minus sign.
#[must_use]
pub fn figure(value: f64) -> String {
    let size = value.abs();
    let digits = match size {
        v if v >= 9.95 => 0,
        v if v >= 0.995 => 1,
        v if v >= 0.0995 => 2,
        v if v >= 0.009_95 => 3,
        _ => 4,
    };
    let text = format!("{size:.digits$}");
    match text.parse::<f64>() {
        Ok(0.0) => "0".to_owned(),
        _ if value < 0.0 => format!("−{text}"),
        _ => text,
    }
}

/// Like [`coarse`], in µm or µrad for a shop: what is finer than 0.01 is "below 0.01".
#[must_use]
pub fn sensible(value: f64) -> String {
    match value.abs() {
        size if size >= 0.009_95 => coarse(value),
        size if size < 5e-5 => "0".to_owned(),
        _ => "below 0.01".to_owned(),
    }
}

/// Like [`figure`], but never finer than 0.01: for figures that are measured, or limits to what is.
#[must_use]
pub fn coarse(value: f64) -> String {
    in_steps(value, f64::round)
}

/// Sensible digits, rounded up: an upper limit stays one.
#[must_use]
pub fn rounded_up(value: f64) -> String {
    in_steps(value, f64::ceil)
}

/// Sensible digits, rounded down: a lower limit stays one.
#[must_use]
pub fn rounded_down(value: f64) -> String {
    in_steps(value, f64::floor)
}

fn in_steps(value: f64, round: fn(f64) -> f64) -> String {
    let digits = match value.abs() {
        v if v >= 9.95 => 0,
        v if v >= 0.995 => 1,
        _ => 2,
    };
    let steps = value * 10_f64.powi(digits);
    // What differs from a step by the last bits only is that step.
    let nearest = steps.round();
    let steps = match (steps - nearest).abs() < 1e-9 * nearest.abs() {
        true => nearest,
        false => round(steps),
    };
    let text = format!("{:.*}", digits as usize, steps.abs() / 10_f64.powi(digits));
    match steps {
        0.0 => "0".to_owned(),
        s if s < 0.0 => format!("−{text}"),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::ErrorModel;
    use trueaxis_model::machine::Machine;

    #[test]
    fn parameters_are_shown_in_the_units_of_the_command() {
        assert_eq!(quantity("EC0A", -868.045_322_881e-6), "−868.05 µrad");
        assert_eq!(quantity("EZ0S", 0.0556), "55.60 µm");
        assert_eq!(quantity("EYY1", -609.86e-6), "−609.86 µm/m");
        assert_eq!(quantity("EXX2", 2e-9), "2.00 µm/m²");
        assert_eq!(quantity("EBX3", -1.234_567_8e-15), "−1.23 µrad/m³");
        assert_eq!(quantity("ECA1", -17.3e-3), "−17300.00 µrad/rad");
        assert_eq!(quantity("EXC4", 0.5e-3), "0.50 µm/rad^4");
        assert_eq!(quantity("EZ0S (per K of head)", 1.5e-3), "1.50 µm/K");
        assert_eq!(quantity("EXX1 (per K of X)", 11e-6), "11.00 µm/m/K");
    }

    #[test]
    fn figures_have_two_digits() {
        for (value, text) in [
            (55.6, "56"),
            (137.24, "137"),
            (9.96, "10"),
            (1.78, "1.8"),
            (0.0456, "0.046"),
            (0.0019, "0.0019"),
            (-2.06, "−2.1"),
            (0.000_01, "0"),
            (0.0, "0"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn ranges_are_rounded_outward_and_nothing_is_finer_than_a_hundredth() {
        for (value, down, near, up) in [
            (137.24, "137", "137", "138"),
            (9.96, "9", "10", "10"),
            (1.78, "1.7", "1.8", "1.8"),
            (1.8, "1.8", "1.8", "1.8"),
            (0.0456, "0.04", "0.05", "0.05"),
            (0.0019, "0", "0", "0.01"),
            (0.0, "0", "0", "0"),
            (-2.06, "−2.1", "−2.1", "−2.0"),
        ] {
            assert_eq!(
                [rounded_down(value), coarse(value), rounded_up(value)],
                [down, near, up]
            );
        }
    }

    #[test]
    fn parameters_are_named_as_people_say_them() {
        let text = include_str!("../../../examples/huron-k2x8/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, words) in [
            ("EZ0S", "the spindle's Z position"),
            ("EA0S", "the spindle's inclination about X"),
            ("EC0C", "the zero position of axis C"),
            ("EB0A", "the inclination of axis A about Y"),
            ("EY0C", "the Y position of axis C"),
            ("EXX1", "the scale of X"),
            ("EYX2", "the bow of X in Y"),
            ("EXXb", "the backlash of X"),
            ("ECCb", "the backlash of C"),
            ("EAX0", "a constant in the roll of X"),
            ("EZCc2", "2 times a turn in the axial motion of C"),
        ] {
            errors.clone_from(&ErrorModel::perfect(&machine));
            let parameter = Parameter::parse(name).unwrap();
            assert!(errors.set(&machine, parameter, 1e-5), "{name}");
            assert_eq!(
                in_words(&SingleEntry::all(&machine, &errors)[0]),
                words,
                "{name}"
            );
        }
    }
}
