//! Models: which parameters are identified.

use crate::candidates::{RotationForm, candidates, direction};
use crate::locations::{chain, minimal};
use std::fmt;
use std::str::FromStr;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::Machine;

/// A list of parameters.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// The eight locations of two rotary axes and three linear ones, depending on which axis carries which, and two
    /// relative scales: ten parameters that probings without a length reference can identify (source document,
    /// Chapter 6).
    Ten,
    /// Like `Ten`, with the backlash of both rotary axes (Chapter 5).
    Twelve,
    /// The locations, three scales, and the spindle position across the tool (Chapters 4 and 7).
    Thirteen,
    /// The coefficients of Chapter 5, for machines with the layout of its Kolibri.
    EightyOne,
    /// The coefficients of Chapter 4, for machines with the layout of its HU40.
    EightyFour,
    /// What the probings can identify, with a complexity chosen by cross-validation over balls.
    Auto,
    /// A list of parameters.
    Named(Vec<Parameter>),
}

/// Why a machine does not support a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct ModelError {
    /// What is wrong.
    pub reason: String,
    /// What to do about it.
    pub remedy: String,
}

impl FromStr for Model {
    type Err = ModelError;

    fn from_str(text: &str) -> Result<Self, ModelError> {
        Ok(match text {
            "10" => Self::Ten,
            "12" => Self::Twelve,
            "13" => Self::Thirteen,
            "81" => Self::EightyOne,
            "84" => Self::EightyFour,
            "auto" => Self::Auto,
            names => {
                let mut parameters = Vec::new();
                for name in names.split(',').map(str::trim) {
                    let parameter = Parameter::parse(name).ok_or_else(|| ModelError {
                        reason: format!("`{name}` is neither a model nor an error parameter"),
                        remedy: "give 10, 12, 13, 81, 84, auto, or names separated by commas: EA0Z,EXX1,ECCb".to_owned(),
                    })?;
                    if parameters.contains(&parameter) {
                        return Err(ModelError {
                            reason: format!("{parameter} is named twice"),
                            remedy: "name every parameter once".to_owned(),
                        });
                    }
                    parameters.push(parameter);
                }
                Self::Named(parameters)
            }
        })
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ten => f.write_str("10"),
            Self::Twelve => f.write_str("12"),
            Self::Thirteen => f.write_str("13"),
            Self::EightyOne => f.write_str("81"),
            Self::EightyFour => f.write_str("84"),
            Self::Auto => f.write_str("auto"),
            Self::Named(parameters) => {
                let names: Vec<String> = parameters.iter().map(Parameter::to_string).collect();
                f.write_str(&names.join(","))
            }
        }
    }
}

/// The orders of three directions, the least changed first.
const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [1, 0, 2],
    [2, 1, 0],
    [0, 2, 1],
    [1, 2, 0],
    [2, 0, 1],
];

impl Model {
    /// Parameters on a machine. For `auto` these are the ones it starts from, up to `degree`; `directions` tells
    /// for which axes the direction of approach is known.
    ///
    /// # Errors
    /// [`ModelError`] if the machine has another layout or lacks a named parameter.
    pub fn parameters(
        &self,
        machine: &Machine,
        degree: u8,
        directions: &[bool],
    ) -> Result<Vec<Parameter>, ModelError> {
        Ok(match self {
            Self::Ten => {
                let mut parameters = self.located(machine)?;
                parameters.extend(scales(&[1, 2]));
                parameters
            }
            Self::Twelve => {
                let backlash = |letter| Parameter {
                    component: direction(letter) + 3,
                    axis: letter,
                    kind: ParameterKind::Backlash,
                };
                let mut parameters = self.located(machine)?;
                parameters.extend(scales(&[1, 2]));
                let towards_workpiece = chain(machine).into_iter().rev();
                let rotary = towards_workpiece.filter(|l| "ABC".contains(*l));
                parameters.extend(rotary.map(backlash));
                parameters
            }
            Self::Thirteen => {
                let mut parameters = self.located(machine)?;
                parameters.extend(scales(&[0, 1, 2]));
                let across = (0..3).filter(|k| *k != machine.tool_axis);
                parameters.extend(across.map(|component| Parameter {
                    component,
                    axis: 'S',
                    kind: ParameterKind::Inter,
                }));
                parameters
            }
            Self::EightyOne => {
                self.published("wCAYFXZSt", include_str!("model/kolibri-81.txt"), machine)?
            }
            Self::EightyFour => {
                self.published("wCBXFZYSt", include_str!("model/hu40-84.txt"), machine)?
            }
            Self::Auto => candidates(machine, degree, RotationForm::Harmonics, directions),
            Self::Named(parameters) => {
                let mut known = ErrorModel::perfect(machine);
                if let Some(other) = parameters.iter().find(|p| !known.set(machine, **p, 0.0)) {
                    return Err(ModelError {
                        reason: format!("{} has no parameter {other}", machine.name),
                        remedy: format!(
                            "its axes are those of {}; harmonics are of rotary axes",
                            machine.topology()
                        ),
                    });
                }
                parameters.clone()
            }
        })
    }

    /// The eight location errors of machines with three linear and two rotary axes.
    fn located(&self, machine: &Machine) -> Result<Vec<Parameter>, ModelError> {
        let mut letters = chain(machine);
        letters.sort_unstable();
        let is_of_five = matches!(letters[..], ['A' | 'B', 'B' | 'C', 'X', 'Y', 'Z']);
        match is_of_five {
            true => Ok(minimal(machine)),
            false => Err(ModelError {
                reason: format!(
                    "model {self} is of machines with two rotary axes that are not parallel and the linear axes X, Y and Z; {} is {}",
                    machine.name,
                    machine.topology()
                ),
                remedy: "give --model auto, or the names of parameters".to_owned(),
            }),
        }
    }

    /// A list that was published for one machine, translated to the letters of a machine with the same layout but
    /// other names of directions.
    fn published(
        &self,
        topology: &str,
        names: &str,
        machine: &Machine,
    ) -> Result<Vec<Parameter>, ModelError> {
        let wanted = machine.topology();
        let renamed = |letter: char, order: &[usize; 3]| match "XYZABC".find(letter) {
            Some(i) => b"XYZABC"[i / 3 * 3 + order[i % 3]] as char,
            None => letter,
        };
        // Upper and lower case distinguish w, F, S and t from axes.
        let same = |order: &&[usize; 3]| {
            topology
                .chars()
                .map(|c| renamed(c, order))
                .collect::<String>()
                == wanted
        };
        let order = ORDERS.iter().find(same).ok_or_else(|| ModelError {
            reason: format!(
                "model {self} is of machines laid out as {topology}; {} is {wanted}",
                machine.name
            ),
            remedy: "give --model auto, or the names of parameters".to_owned(),
        })?;
        let parameters = names
            .split_whitespace()
            .filter_map(Parameter::parse)
            .map(|p| Parameter {
                component: p.component / 3 * 3 + order[p.component % 3],
                axis: renamed(p.axis, order),
                ..p
            });
        Ok(parameters.collect())
    }
}

/// Scales of linear directions (0, 1, 2).
fn scales(directions: &[usize]) -> impl Iterator<Item = Parameter> {
    directions.iter().map(|component| Parameter {
        component: *component,
        axis: b"XYZ"[*component] as char,
        kind: ParameterKind::Degree(1),
    })
}
