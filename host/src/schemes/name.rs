//! The names of schemes, in commands and in their answers.

use super::Scheme;
use std::fmt;
use std::num::NonZeroU8;
use std::str::FromStr;

/// Nothing has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is no scheme: write one of {}", names())]
pub struct UnknownScheme {
    /// What was written.
    pub name: String,
}

fn names() -> String {
    let names: Vec<String> = Scheme::every().iter().map(Scheme::to_string).collect();
    names.join(", ")
}

impl Scheme {
    /// Every scheme, as it is without options of its own.
    #[must_use]
    pub fn every() -> Vec<Self> {
        vec![
            Self::default(),
            Self::Fik {
                adjustable: Vec::new(),
            },
            Self::Subset {
                tables: NonZeroU8::MIN.saturating_add(9),
            },
        ]
    }

    /// Its name in the command and in its answers.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Exact { .. } => "exact".to_owned(),
            Self::Fik { .. } => "fik".to_owned(),
            Self::Subset { tables } => format!("subset:{tables}"),
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())
    }
}

/// The scheme of a name, without options of its own.
impl FromStr for Scheme {
    type Err = UnknownScheme;

    fn from_str(name: &str) -> Result<Self, UnknownScheme> {
        if let Some(tables) = name.strip_prefix("subset:").and_then(|n| n.parse().ok()) {
            return Ok(Self::Subset { tables });
        }
        let mut every = Self::every().into_iter();
        every
            .find(|scheme| scheme.name() == name)
            .ok_or_else(|| UnknownScheme {
                name: name.to_owned(),
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scheme_is_found_by_its_name_and_nothing_else_is() {
        for scheme in Scheme::every() {
            assert_eq!(scheme.name().parse(), Ok(scheme));
        }
        let error = "exactly".parse::<Scheme>().unwrap_err().to_string();
        assert!(
            error.starts_with("`exactly` is no scheme: write one of exact"),
            "{error}"
        );
    }
}
