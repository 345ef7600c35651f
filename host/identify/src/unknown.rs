//! The unknowns of an identification.

use crate::instrument::SettingPart;
use std::fmt;
use trueaxis_model::errors::{Parameter, ParameterKind};

/// One unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// An error parameter (mm, rad, per mmᵏ or radᵏ).
    Parameter(Parameter),
    /// The change of an error parameter per kelvin of a temperature (by its number).
    PerKelvin(Parameter, usize),
    /// A coordinate (0, 1, 2) of the stylus tip in the spindle frame (mm).
    Stylus(usize),
    /// A coordinate of a ball in the workpiece frame (mm).
    Ball(usize, usize),
    /// Part of the set-up of an instrument (mm or rad).
    Setup(usize, SettingPart),
    /// A coordinate of another point of the tool that instruments observe, in the spindle frame (mm).
    Tool(usize, usize),
    /// Drift of the artefact, or of the set-up of an instrument: along (0, 1, 2) or about (3, 4, 5) an axis of the
    /// workpiece frame (mm/h or rad/h).
    Drift(Option<usize>, usize),
}

impl Unknown {
    /// The error parameter that it is or changes, and the temperature it changes with.
    pub(crate) fn parameter(self) -> Option<(Parameter, Option<usize>)> {
        match self {
            Self::Parameter(parameter) => Some((parameter, None)),
            Self::PerKelvin(parameter, input) => Some((parameter, Some(input))),
            _ => None,
        }
    }

    /// Order in which unknowns are given up if several cannot be separated: by degree, setup last; of scales that of
    /// X first, so that the others are relative to it.
    pub(crate) fn dispensable(self) -> (u8, u8, u8) {
        match self {
            Self::Ball(..) | Self::Setup(..) | Self::Tool(..) => (0, 0, 0),
            Self::PerKelvin(..) => (4, 0, 0),
            Self::Drift(..) => (3, 0, 0),
            Self::Stylus(_) => (1, 0, 0),
            Self::Parameter(parameter) => {
                let degree = match parameter.kind {
                    ParameterKind::Inter | ParameterKind::Backlash => 0,
                    ParameterKind::Degree(k) => k,
                    ParameterKind::Cosine(k) | ParameterKind::Sine(k) => k + 1,
                };
                let first = match (parameter.kind, parameter.axis, parameter.component) {
                    (ParameterKind::Degree(1), 'X', 0) => 2,
                    (ParameterKind::Degree(1), 'Y', 1) => 1,
                    _ => 0,
                };
                (2, degree, first)
            }
        }
    }
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinate = |i: &usize| ["x", "y", "z"][*i];
        match self {
            Self::Parameter(parameter) => parameter.fmt(f),
            Self::PerKelvin(parameter, _) => write!(f, "the change of {parameter} per kelvin"),
            Self::Stylus(i) => write!(f, "the stylus' {}", coordinate(i)),
            Self::Ball(_, i) => write!(f, "the balls' {}", coordinate(i)),
            Self::Setup(_, part) => write!(f, "the set-ups' {part}"),
            Self::Tool(_, i) => write!(f, "the tool points' {}", coordinate(i)),
            Self::Drift(_, i) if *i < 3 => write!(f, "drift along {}", coordinate(i)),
            Self::Drift(_, i) => write!(f, "drift about {}", coordinate(&(i - 3))),
        }
    }
}
