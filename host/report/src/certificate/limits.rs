//! Limits, and what is decided about them by the rule of ISO 14253-1: kept only if that is verified in spite of the
//! uncertainty, exceeded only if that is verified, otherwise not decided.

use crate::words::unit;
use serde::Serialize;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// What is limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Amount of an error parameter of the mechanics, whatever tables do about it.
    Parameter(Parameter),
    /// Volumetric error of the tip, or of the tool's direction.
    Volumetric {
        /// False for the direction.
        at_tip: bool,
        /// The mean over the positions, otherwise what 95 % of them do not exceed.
        is_mean: bool,
        /// In the probed zone, otherwise over the travel.
        is_probed: bool,
    },
    /// A circular test (ISO 230-4) in a plane: `G`, `F` or `H`.
    Circle(char, [char; 2]),
    /// Positioning of an axis (ISO 230-2): `E`, `M` or `B`.
    Positioning(char, char),
    /// Systematic deviation E along a body diagonal (ISO 230-6): whether X, Y and Z increase along it.
    Diagonal([bool; 3]),
    /// The scatter measured by a validation with the compensation.
    Validation {
        /// The root mean square, otherwise the largest.
        is_rms: bool,
    },
}

/// A limit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// The standard or agreement that it is from, as written.
    pub test: Option<String>,
    /// What is limited.
    #[serde(serialize_with = "by_name")]
    pub quantity: Quantity,
    /// The largest permitted value.
    pub at_most: f64,
    /// Unit: `µm`, `µrad` or `µm/m`.
    pub unit: &'static str,
}

fn by_name<S: serde::Serializer>(quantity: &Quantity, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&quantity.name())
}

/// What is decided about a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// Conformity is verified.
    Pass,
    /// Nonconformity is verified.
    Fail,
    /// Neither is.
    NotDecided,
}

impl Decision {
    /// Compares the interval that contains the value with 95 % with an upper limit.
    #[must_use]
    pub fn of([low, high]: [f64; 2], at_most: f64) -> Self {
        match (high <= at_most, low > at_most) {
            (true, _) => Self::Pass,
            (_, true) => Self::Fail,
            _ => Self::NotDecided,
        }
    }
}

/// Names that `quantity` can have.
const KNOWN: &str = "write an error parameter (\"EC0Y\"), \"tip mean\", \"tip p95\", \"direction mean\", \"direction p95\", \
                     a circular test (\"G XY\", \"F XY\", \"H XY\"), positioning of an axis (\"E X\", \"M X\", \"B X\"), \
                     a diagonal (\"E +X+Y-Z\"), \"validation rms\" or \"validation largest\"";

impl Quantity {
    /// Reads a name; an error is a message and a remedy.
    ///
    /// # Errors
    /// An unknown name, or something that the machine does not have.
    pub fn parse(name: &str, machine: &Machine) -> Result<Self, (String, String)> {
        let plain = name.replace('−', "-");
        let words: Vec<&str> = plain.split(' ').collect();
        let quantity = match words[..] {
            [one] => match Parameter::parse(one) {
                Some(parameter) => return Self::of_parameter(parameter, one, machine),
                None => None,
            },
            [what, of] => Self::of_words(what, of),
            _ => None,
        };
        let quantity = quantity.ok_or_else(|| {
            let message = format!("`{name}` is not a quantity that can be limited");
            (message, KNOWN.to_owned())
        })?;
        let linear = machine.axes.iter().filter(|a| !a.letter.is_rotary());
        let has = |axis: &char| linear.clone().any(|a| a.letter.char() == *axis);
        match quantity.axes().into_iter().find(|axis| !has(axis)) {
            Some(axis) => Err(without(format!("no linear axis {axis}"))),
            None => Ok(quantity),
        }
    }

    /// An error parameter that the machine has and that is a deviation; `name` is for messages.
    fn of_parameter(
        parameter: Parameter,
        name: &str,
        machine: &Machine,
    ) -> Result<Self, (String, String)> {
        if !ErrorModel::perfect(machine).set(machine, parameter, 0.0) {
            return Err(without(format!("no parameter {name}")));
        }
        match unit(parameter).0 {
            Some(_) => Ok(Self::Parameter(parameter)),
            None => Err((
                format!("{name} is a coefficient, not a deviation"),
                "limit its effect instead: \"tip mean\", \"G XY\" or \"E X\"".to_owned(),
            )),
        }
    }

    /// The quantity with a name of two words, on any machine.
    fn of_words(what: &str, of: &str) -> Option<Self> {
        let first = |text: &str| text.chars().next().unwrap_or(' ');
        match (what, of) {
            ("tip" | "direction", "mean" | "p95") => Some(Self::Volumetric {
                at_tip: what == "tip",
                is_mean: of == "mean",
                is_probed: false,
            }),
            ("validation", "rms" | "largest") => Some(Self::Validation {
                is_rms: of == "rms",
            }),
            ("G" | "F" | "H", plane) => {
                let mut planes = [['X', 'Y'], ['Y', 'Z'], ['Z', 'X']].into_iter();
                let plane = planes.find(|p| p.iter().collect::<String>() == plane)?;
                Some(Self::Circle(first(what), plane))
            }
            ("E" | "M" | "B", axis) if axis.chars().count() == 1 => {
                Some(Self::Positioning(first(what), first(axis)))
            }
            ("E", diagonal) => {
                let mut diagonals = DIAGONALS.into_iter();
                let signs = diagonals.find(|signs| diagonal_name(*signs) == diagonal)?;
                Some(Self::Diagonal(signs))
            }
            _ => None,
        }
    }

    /// The linear axes that its test moves.
    fn axes(self) -> Vec<char> {
        match self {
            Self::Circle(_, plane) => plane.to_vec(),
            Self::Positioning(_, axis) => vec![axis],
            Self::Diagonal(_) => vec!['X', 'Y', 'Z'],
            _ => Vec::new(),
        }
    }

    /// In the probed zone; `None` if it has its own positions.
    #[must_use]
    pub(crate) fn in_probed_zone(self) -> Option<Self> {
        match self {
            Self::Volumetric {
                at_tip, is_mean, ..
            } => Some(Self::Volumetric {
                at_tip,
                is_mean,
                is_probed: true,
            }),
            _ => None,
        }
    }

    /// Name, as in the file.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Parameter(parameter) => parameter.to_string(),
            Self::Volumetric {
                at_tip, is_mean, ..
            } => format!(
                "{} {}",
                if *at_tip { "tip" } else { "direction" },
                if *is_mean { "mean" } else { "p95" }
            ),
            Self::Circle(what, [a, b]) => format!("{what} {a}{b}"),
            Self::Positioning(what, axis) => format!("{what} {axis}"),
            Self::Diagonal(signs) => format!("E {}", diagonal_name(*signs)),
            Self::Validation { is_rms: true } => "validation rms".to_owned(),
            Self::Validation { is_rms: false } => "validation largest".to_owned(),
        }
    }

    /// Description.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::Parameter(parameter) => format!("amount of {parameter}"),
            Self::Volumetric {
                at_tip,
                is_mean,
                is_probed,
            } => format!(
                "volumetric error {}, {} the {}",
                if *at_tip {
                    "at the tip"
                } else {
                    "of the tool direction"
                },
                if *is_mean { "mean over" } else { "95 % of" },
                if *is_probed { "probed zone" } else { "travel" }
            ),
            Self::Circle('G', [a, b]) => {
                format!("bidirectional circular deviation G(b) in {a}{b}, ISO 230-4")
            }
            Self::Circle('F', [a, b]) => format!("largest radial deviation F in {a}{b}, ISO 230-4"),
            Self::Circle(_, [a, b]) => format!("circular hysteresis H in {a}{b}, ISO 230-4"),
            Self::Positioning('E', axis) => format!("systematic deviation E of {axis}, ISO 230-2"),
            Self::Positioning('M', axis) => {
                format!("range of mean deviations M of {axis}, ISO 230-2")
            }
            Self::Positioning(_, axis) => format!("reversal value B of {axis}, ISO 230-2"),
            Self::Diagonal(signs) => {
                let name = diagonal_name(*signs).replace('-', "−");
                format!("systematic deviation E along {name}, ISO 230-6")
            }
            Self::Validation { is_rms } => format!(
                "scatter of the tip around the balls, {}",
                if *is_rms { "rms" } else { "largest" }
            ),
        }
    }

    /// Keys that a limit of it can have.
    pub(crate) fn keys(&self) -> &'static [&'static str] {
        match self.unit() {
            // The same number: 1 µrad is 1 µm/m.
            "µrad" => &["urad", "um_per_m"],
            "µm/m" => &["um_per_m"],
            _ => &["um"],
        }
    }

    /// The unit of its value.
    pub(crate) fn unit(&self) -> &'static str {
        match self {
            Self::Parameter(parameter) => unit(*parameter).1,
            Self::Volumetric { at_tip: false, .. } => "µrad",
            _ => "µm",
        }
    }
}

/// Message and remedy for something that the machine does not have.
fn without(what: String) -> (String, String) {
    (
        format!("this machine has {what}"),
        "correct the name, or leave the limit out".to_owned(),
    )
}

/// The signs of the four body diagonals along X, Y and Z, as the report has them.
const DIAGONALS: [[bool; 3]; 4] = [
    [true, true, true],
    [false, true, true],
    [true, false, true],
    [true, true, false],
];

/// `+X+Y-Z`
fn diagonal_name(signs: [bool; 3]) -> String {
    let all = signs.into_iter().zip(['X', 'Y', 'Z']);
    all.map(|(plus, axis)| format!("{}{axis}", if plus { '+' } else { '-' }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_proven_is_decided() {
        // ISO 14253-1 with an upper limit of 10 and U = 2: up to 8 it conforms, above 12 it does not.
        let around = |value: f64| [value - 2.0, value + 2.0];
        for (value, decision) in [
            (8.0, Decision::Pass),
            (8.1, Decision::NotDecided),
            (10.0, Decision::NotDecided),
            (12.0, Decision::NotDecided),
            (12.1, Decision::Fail),
        ] {
            assert_eq!(Decision::of(around(value), 10.0), decision, "{value}");
        }
    }

    #[test]
    fn names_of_quantities_are_read_as_they_are_written() {
        let text = include_str!("../../../../examples/huron-k2x8/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        for name in [
            "EA0Z",
            "EXX1",
            "EXXb",
            "tip mean",
            "tip p95",
            "direction mean",
            "G XY",
            "F YZ",
            "H ZX",
            "E X",
            "M Y",
            "B Z",
            "E +X+Y-Z",
            "E -X+Y+Z",
            "validation rms",
            "validation largest",
        ] {
            assert_eq!(Quantity::parse(name, &machine).unwrap().name(), name);
        }
        for name in [
            "",
            "EW0Z",
            "EXX2",
            "EXB1c",
            "G YX",
            "E A",
            "E W",
            "Q X",
            "E +X-Y-Z",
            "tip max",
            "tip  mean",
        ] {
            assert!(Quantity::parse(name, &machine).is_err(), "{name}");
        }
        let of = |name| Quantity::parse(name, &machine).unwrap();
        assert_eq!(of("EXX1").unit(), "µm/m");
        assert_eq!(of("EC0X").keys(), ["urad", "um_per_m"]);
        assert_eq!(of("EXXb").keys(), ["um"]);
    }
}
