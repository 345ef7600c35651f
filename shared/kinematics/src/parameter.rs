//! Names of error parameters: `EB0A`, `EXY2`, `EXCc1`, `EAAb`.

use crate::Letter;
use core::fmt;

/// The kind of error that a parameter describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ParameterKind {
    /// Inter-axis error (axis location, ISO 230-1 clause 3): `EB0A`. Acts before the axis motion.
    Inter,
    /// Coefficient of a degree of an intra-axis error (error motion): `EXY2`, per mmᵏ or radᵏ.
    Degree(u8),
    /// Cosine of a multiple, from 1, of the angle of a rotary axis: `EXCc1`.
    Cosine(u8),
    /// Sine of a multiple, from 1, of the angle of a rotary axis: `EXCs1`.
    Sine(u8),
    /// Backlash: +E after positive, −E after negative travel: `EAAb`. Half of the reversal value.
    Backlash,
}

/// One error parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Parameter {
    /// Direction of the error: 0…5 for X Y Z A B C.
    pub component: usize,
    /// Letter of the axis that has the error, or `S` for the spindle.
    pub axis: char,
    /// The kind of error.
    pub kind: ParameterKind,
}

/// Highest accepted degree of an error motion polynomial.
pub const MAX_DEGREE: u8 = 12;
/// Highest accepted multiple of the angle in an error motion of a rotary axis.
pub const MAX_HARMONIC: u8 = 8;

const COMPONENTS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

impl Parameter {
    /// The scale error of a linear axis X, Y, Z, U, V or W, as `EXX1`.
    #[must_use]
    pub fn scale(axis: char) -> Self {
        Self {
            component: "XYZUVW".find(axis).unwrap_or(0) % 3,
            axis,
            kind: ParameterKind::Degree(1),
        }
    }

    /// Parses a name; `None` if it is not valid.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        let mut chars = name.chars();
        if chars.next() != Some('E') {
            return None;
        }
        let first = chars.next()?;
        let component = COMPONENTS.iter().position(|c| *c == first)?;
        let second = chars.next()?;
        let rest = chars.as_str();
        let is_axis = |c: char| c == 'S' || Letter::new(c).is_some();
        if second == '0' {
            let mut letters = rest.chars();
            let axis = letters.next()?;
            return (is_axis(axis) && letters.next().is_none()).then_some(Self {
                component,
                axis,
                kind: ParameterKind::Inter,
            });
        }
        if !is_axis(second) || second == 'S' {
            return None;
        }
        let kind = if rest == "b" {
            ParameterKind::Backlash
        } else if let Some(k) = rest.strip_prefix('c') {
            ParameterKind::Cosine(number(k, 1, MAX_HARMONIC)?)
        } else if let Some(k) = rest.strip_prefix('s') {
            ParameterKind::Sine(number(k, 1, MAX_HARMONIC)?)
        } else {
            ParameterKind::Degree(number(rest, 0, MAX_DEGREE)?)
        };
        Some(Self {
            component,
            axis: second,
            kind,
        })
    }

    /// Parses the name of a whole error motion, `EXX`: component and axis letter.
    #[must_use]
    pub fn parse_motion(name: &str) -> Option<(usize, char)> {
        let mut chars = name.chars();
        let (Some('E'), Some(first), Some(axis), None) =
            (chars.next(), chars.next(), chars.next(), chars.next())
        else {
            return None;
        };
        let component = COMPONENTS.iter().position(|c| *c == first)?;
        Letter::new(axis).map(|axis| (component, axis.char()))
    }

    /// True if its value is an angle (rad), false if a length (mm).
    #[must_use]
    pub fn is_angular(self) -> bool {
        self.component >= 3
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let component = COMPONENTS[self.component];
        match self.kind {
            ParameterKind::Inter => write!(f, "E{component}0{}", self.axis),
            ParameterKind::Degree(k) => write!(f, "E{component}{}{k}", self.axis),
            ParameterKind::Cosine(k) => write!(f, "E{component}{}c{k}", self.axis),
            ParameterKind::Sine(k) => write!(f, "E{component}{}s{k}", self.axis),
            ParameterKind::Backlash => write!(f, "E{component}{}b", self.axis),
        }
    }
}

/// Parses a number without leading zeros, within limits.
fn number(text: &str, least: u8, most: u8) -> Option<u8> {
    let canonical = text == "0" || !text.starts_with(['0', '+']);
    let number: u8 = text.parse().ok()?;
    (canonical && (least..=most).contains(&number)).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn names_are_read_and_written_alike() {
        for name in [
            "EB0A", "EX0S", "EXY2", "EYA0", "EAAb", "ECC3", "EZW12", "EXCc1", "EBAs8",
        ] {
            assert_eq!(Parameter::parse(name).unwrap().to_string(), name);
        }
    }

    #[test]
    fn names_of_whole_motions_are_read() {
        assert_eq!(Parameter::parse_motion("EAY"), Some((3, 'Y')));
        for name in ["EX", "EXX1", "EXS", "EX0", "XXX"] {
            assert_eq!(Parameter::parse_motion(name), None, "{name}");
        }
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for name in [
            "", "E", "EX", "EXX", "EB0", "EB0Q", "EB0AA", "XB0A", "EDA1", "EXS1", "EXX01", "EXX99",
            "EXXB", "EOX0", "EXX+1", "EXCc0", "EXCs9", "EXCc", "EXCc01", "EXCé",
        ] {
            assert_eq!(Parameter::parse(name), None, "{name}");
        }
    }
}
