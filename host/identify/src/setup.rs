//! Set-ups of instruments, and drift, as found.

use crate::instrument::Kind;
use crate::prior::Prior;
use std::fmt;

/// One unknown of a set-up.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPart {
    /// What: `place in x`, `dead length`, `tool point in x`.
    pub what: String,
    /// Value (mm); for a rotation, what was added to the first orientation (rad).
    pub value: f64,
    /// Standard uncertainty of the unknown.
    pub uncertainty: f64,
    /// What was stated beforehand, if anything.
    pub prior: Option<Prior>,
}

impl FoundPart {
    /// Factor and unit in which it is shown.
    #[must_use]
    pub fn shown(&self) -> (f64, &'static str) {
        match self.what.starts_with("rotation") {
            true => (1e3, "mrad"),
            false => (1.0, "mm"),
        }
    }
}

/// An instrument as it was found to be set up.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundSetup {
    /// Name.
    pub name: String,
    /// What it reads.
    pub kind: Kind,
    /// Unknowns that the observations determine.
    pub parts: Vec<FoundPart>,
}

/// Drift of the artefact or of an instrument over the time of its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundDrift {
    /// Name of the set-up; `None` for the artefact.
    pub setup: Option<String>,
    /// Along (0, 1, 2) or about (3, 4, 5) which axis of the workpiece frame.
    pub component: usize,
    /// Time constant (s) with which it approached its end; `None` if it was linear in time.
    pub lag: Option<f64>,
    /// How far it moved from the first to the last row (mm or rad).
    pub value: f64,
    /// Standard uncertainty of that.
    pub uncertainty: f64,
    /// The time from the first to the last row (s).
    pub seconds: f64,
}

impl fmt::Display for FoundDrift {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = self.setup.as_deref().unwrap_or("the artefact");
        let axis = ["x", "y", "z"][self.component % 3];
        let (way, unit, factor) = match self.component {
            0..3 => ("along", "µm", 1e3),
            _ => ("about", "µrad", 1e6),
        };
        write!(
            f,
            "{what} moved {way} {axis} by {:.2} ± {:.2} {unit} in {:.0} s",
            self.value * factor,
            2.0 * self.uncertainty * factor,
            self.seconds
        )?;
        match self.lag {
            Some(lag) => write!(f, ", with a time constant of {lag:.0} s"),
            None => Ok(()),
        }
    }
}
