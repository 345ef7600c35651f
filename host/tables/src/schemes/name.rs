//! The names of schemes on the command line and in results.

use super::{Scheme, grid3d, poly25, trigo23};
use std::fmt;
use std::num::NonZeroU8;
use std::str::FromStr;

/// Default number of positions along each axis of the grid to which schemes are fitted (sections 5.9.1 and 6.5.2).
const NODES: usize = 10;
/// Default number of tables of a subset.
const TABLES: NonZeroU8 = NonZeroU8::new(10).unwrap();

/// No scheme has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{name}` is not a scheme: write one of {}", names())]
pub struct UnknownScheme {
    /// The unknown name.
    pub name: String,
}

fn names() -> String {
    let names: Vec<String> = Scheme::every().iter().map(Scheme::pattern).collect();
    names.join(", ")
}

impl Scheme {
    /// Every scheme with its default options.
    #[must_use]
    pub fn every() -> Vec<Self> {
        let poly25 = poly25::Wanted {
            objective: poly25::Objective::Corrections,
            nodes: NODES,
        };
        let trigo23 = |free| Self::Trigo23(trigo23::Wanted { free, nodes: NODES });
        vec![
            Self::default(),
            Self::Grid3d(grid3d::Wanted::default()),
            Self::Poly25(poly25),
            trigo23(false),
            trigo23(true),
            Self::Fik {
                adjustable: Vec::new(),
            },
            Self::Subset { tables: TABLES },
        ]
    }

    /// The pattern of its name, with N for a number.
    fn pattern(&self) -> String {
        match self {
            Self::Subset { .. } => "subset:N".to_owned(),
            other => other.name(),
        }
    }

    /// Name on the command line and in results.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Exact { .. } => "exact".to_owned(),
            Self::Grid3d(_) => "grid3d".to_owned(),
            Self::Poly25(_) => "poly25".to_owned(),
            Self::Trigo23(wanted) if wanted.free => "trigo23:free".to_owned(),
            Self::Trigo23(_) => "trigo23".to_owned(),
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

/// Parses a name; the scheme has its default options.
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
        for wrong in [
            "subset",
            "subset:",
            "subset:0",
            "subset:-3",
            "subset:256",
            "subset:ten",
        ] {
            assert!(wrong.parse::<Scheme>().is_err(), "{wrong}");
        }
        let error = "exactly".parse::<Scheme>().unwrap_err().to_string();
        assert!(
            error.starts_with("`exactly` is not a scheme: write one of exact"),
            "{error}"
        );
    }
}
