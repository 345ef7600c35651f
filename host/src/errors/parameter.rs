//! Names of error parameters: `EB0A`, `EXY2`, `EAAb`.

/// What a parameter describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ParameterKind {
    /// Inter-axis error (axis location, ISO 230-1 clause 3): `EB0A`. Acts before the axis' motion.
    Inter,
    /// Coefficient of a degree of an intra-axis error (error motion): `EXY2`, per mmᵏ or radᵏ.
    Degree(u8),
    /// Backlash: +E after positive, −E after negative travel: `EAAb`. Half of the reversal value.
    Backlash,
}

/// One error parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Parameter {
    /// Direction of the error: 0…5 for X Y Z A B C.
    pub component: usize,
    /// The axis that carries it, or `S` for the spindle.
    pub axis: char,
    /// What it describes.
    pub kind: ParameterKind,
}

/// Highest degree of an error motion polynomial that is accepted.
pub const MAX_DEGREE: u8 = 12;

const COMPONENTS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];

impl Parameter {
    /// Reads a name; `None` if it is not one.
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
        let is_axis = |c: char| "XYZUVWABCS".contains(c);
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
        let kind = match rest {
            "b" => ParameterKind::Backlash,
            degree => {
                let canonical = degree == "0" || !degree.starts_with('0');
                let degree: u8 = degree.parse().ok()?;
                if !canonical || degree > MAX_DEGREE {
                    return None;
                }
                ParameterKind::Degree(degree)
            }
        };
        Some(Self {
            component,
            axis: second,
            kind,
        })
    }

    /// Reads the name of a whole error motion, `EXX`: component and axis letter.
    #[must_use]
    pub fn parse_motion(name: &str) -> Option<(usize, char)> {
        let parameter = Self::parse(&format!("{name}0"))?;
        matches!(parameter.kind, ParameterKind::Degree(0))
            .then_some((parameter.component, parameter.axis))
    }

    /// True if its value is an angle (rad), false if a length (mm).
    #[must_use]
    pub fn is_angular(self) -> bool {
        self.component >= 3
    }
}

impl std::fmt::Display for Parameter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let component = COMPONENTS[self.component];
        match self.kind {
            ParameterKind::Inter => write!(f, "E{component}0{}", self.axis),
            ParameterKind::Degree(k) => write!(f, "E{component}{}{k}", self.axis),
            ParameterKind::Backlash => write!(f, "E{component}{}b", self.axis),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_and_written_alike() {
        for name in ["EB0A", "EX0S", "EXY2", "EYA0", "EAAb", "ECC3", "EZW12"] {
            assert_eq!(Parameter::parse(name).unwrap().to_string(), name);
        }
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for name in [
            "", "E", "EX", "EXX", "EB0", "EB0Q", "EB0AA", "XB0A", "EDA1", "EXS1", "EXX01", "EXX99",
            "EXXB", "EOX0",
        ] {
            assert_eq!(Parameter::parse(name), None, "{name}");
        }
    }
}
