//! The controller's names for the axes of the machine.

use crate::positions::travel;
use std::ops::Range;
use trueaxis::Axis;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// The axes of a machine, each with the names it has on a controller.
#[derive(Clone, Debug)]
pub struct NamedAxes {
    /// The axes as in a blob.
    pub axes: Vec<Axis>,
    names: Vec<Vec<String>>,
}

/// Number of machine axes that a controller has.
const MOST_AXES: u32 = 31;

/// Errors in a map of axes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AxesError {
    /// Not of the form `X=AX1`.
    #[error("`{0}` is not an axis of the machine, an equals sign and the controller's name for it")]
    Pair(String),
    /// The machine has no such axis.
    #[error("the machine has no axis `{0}`")]
    NoAxis(String),
    /// Not a valid axis name on a controller.
    #[error(
        "`{0}` is not a name of an axis: letters, digits and underscores, the first a letter; AX1 to AX31"
    )]
    Name(String),
    /// One name for two axes.
    #[error("`{0}` is given twice")]
    Twice(String),
    /// An axis without a name.
    #[error("axis {0} has no name on the controller")]
    Missing(char),
}

impl NamedAxes {
    /// The axes of a blob, with a map such as `X=AX1,A=AX4`. A letter may have several names; the first is used for
    /// writing.
    ///
    /// # Errors
    /// [`AxesError`]
    pub fn new(axes: &[Axis], map: &str) -> Result<Self, AxesError> {
        let mut names = vec![Vec::new(); axes.len()];
        for part in map.split(',') {
            let pair = part.split_once('=');
            let Some((letter, name)) = pair.map(|(l, n)| (l.trim(), n.trim())) else {
                return Err(AxesError::Pair(part.trim().to_owned()));
            };
            let is_it = |a: &Axis| letter.eq_ignore_ascii_case(&char::from(a.name).to_string());
            let Some(index) = axes.iter().position(is_it) else {
                return Err(AxesError::NoAxis(letter.to_owned()));
            };
            if !is_name(name) {
                return Err(AxesError::Name(name.to_owned()));
            }
            let name = name.to_ascii_uppercase();
            if names.iter().flatten().any(|known| *known == name) {
                return Err(AxesError::Twice(name));
            }
            names[index].push(name);
        }
        Ok(Self {
            axes: axes.to_vec(),
            names,
        })
    }

    /// The axes of a machine, with bounds to be set once the output of the tables is known.
    ///
    /// # Errors
    /// [`AxesError`]
    pub fn of(machine: &Machine, map: &str) -> Result<Self, AxesError> {
        let axes = machine.axes.iter().map(|axis| Axis {
            name: axis.letter.char() as u8,
            travel: match axis.modulo {
                true => [-f32::MAX, f32::MAX],
                false => axis.travel.map(|t| t as f32),
            },
            period: if axis.modulo { 360.0 } else { 0.0 },
            value_bound: 1.0,
            rate_bound: 1.0,
            reversal_threshold: axis.reversal_threshold as f32,
            ramp_rate: 1.0,
            reversal_rate: 1.0,
            reversal_acceleration: 20.0,
        });
        Self::new(&axes.collect::<Vec<_>>(), map)
    }

    /// Checks that all axes have a name.
    ///
    /// # Errors
    /// [`AxesError::Missing`]
    pub fn complete(self) -> Result<Self, AxesError> {
        match self.names.iter().position(Vec::is_empty) {
            Some(index) => Err(AxesError::Missing(self.letter(index))),
            None => Ok(self),
        }
    }

    /// Letter of an axis.
    #[must_use]
    pub fn letter(&self, axis: usize) -> char {
        char::from(self.axes[axis].name)
    }

    /// True for axes in degrees, false for mm.
    #[must_use]
    pub fn is_rotary(&self, axis: usize) -> bool {
        matches!(self.axes[axis].name, b'A' | b'B' | b'C')
    }

    /// `mm` or `deg`.
    #[must_use]
    pub fn unit(&self, axis: usize) -> &'static str {
        if self.is_rotary(axis) { "deg" } else { "mm" }
    }

    /// The name of an axis for writing; its letter if the map has none.
    #[must_use]
    pub fn name(&self, axis: usize) -> String {
        match self.names[axis].first() {
            Some(name) => name.clone(),
            None => self.letter(axis).to_string(),
        }
    }

    /// The axis with a name used in a file.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        let is_it = |known: &String| known.eq_ignore_ascii_case(name);
        self.names.iter().position(|names| names.iter().any(is_it))
    }

    /// Travel of an axis (mm, deg); for an axis without limits, its turn.
    #[must_use]
    pub fn travel(&self, axis: usize) -> [f64; 2] {
        travel(&self.axes[axis])
    }
}

/// Whether a text is a valid axis name.
#[must_use]
pub fn is_name(name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let is_word = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_part);
    let upper = name.to_ascii_uppercase();
    let number = upper
        .strip_prefix("AX")
        .filter(|rest| rest.bytes().all(|b| b.is_ascii_digit()));
    let is_one = |number: &str| (1..=MOST_AXES).any(|axis| axis.to_string() == number);
    is_word && number.is_none_or(is_one)
}

/// An axis that is not in the map.
pub(super) fn unknown_axis(name: &str, span: &Range<usize>) -> FileError {
    FileError::at(
        span.clone(),
        format!("the controller's axis `{name}` is not in the map of axes"),
        "named here",
        "say with --axes which axis of the machine it is: --axes X=AX1,A=AX4",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(map: &str) -> Result<NamedAxes, AxesError> {
        let machine = include_str!("../../../../examples/huron-k2x8/machine.toml");
        NamedAxes::of(&Machine::from_toml(machine).unwrap(), map)
    }

    #[test]
    fn an_axis_is_found_by_each_of_its_names() {
        let axes = axes("X=AX1, x=X1,A=A_1").unwrap();
        for (name, found) in [
            ("AX1", Some('X')),
            ("x1", Some('X')),
            ("a_1", Some('A')),
            ("AX4", None),
        ] {
            assert_eq!(axes.find(name).map(|i| axes.letter(i)), found, "{name}");
        }
        assert_eq!(axes.name(axes.find("X1").unwrap()), "AX1");
        assert_eq!(axes.complete().unwrap_err(), AxesError::Missing('Y'));
    }

    #[test]
    fn a_map_that_cannot_be_meant_is_refused() {
        for (map, message) in [
            ("X", "`X` is not an axis of the machine, an equals"),
            ("U=AX1", "no axis `U`"),
            ("X=1", "`1` is not a name"),
            ("X=AX31,Y=AX32", "`AX32` is not a name"),
            ("X=AX0", "`AX0` is not a name"),
            ("X=AX01", "`AX01` is not a name"),
            ("X=AX99999999999", "`AX99999999999` is not a name"),
            ("X=AX1,Y=ax1", "`AX1` is given twice"),
            ("", "`` is not an axis"),
        ] {
            let error = axes(map).unwrap_err().to_string();
            assert!(error.contains(message), "{map}: {error}");
        }
    }
}
