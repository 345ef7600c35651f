//! The results of an identification: the part of the output of `identify --json` that a report shows.

use super::observed::{Observed, Temperatures};
use serde::{Deserialize, Serialize};

/// An identification, with the names and units of `identify --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    /// The machine.
    pub machine: String,
    /// Number of probings.
    pub probings: usize,
    /// The range that each axis covered.
    pub probed: Vec<Probed>,
    /// The balls.
    pub balls: Vec<Ball>,
    /// Balls and stylus, found and as stated. Older files do not have them.
    #[serde(default)]
    pub places: Vec<Place>,
    /// The parameters found.
    pub parameters: Vec<Estimate>,
    /// Pairs of parameters whose correlation is above 0.9.
    pub correlations: Vec<(String, String, f64)>,
    /// Unknowns that could not be identified.
    pub unseen: Vec<NotSeen>,
    /// Standard deviation of a coordinate.
    pub noise_um: f64,
    /// The residuals in units of the stated uncertainty, if the file states it for all rows.
    #[serde(default)]
    pub noise_of_stated: Option<f64>,
    /// Sources of readings whose residuals exceed what they state, beyond chance.
    #[serde(default)]
    pub refuted: Vec<String>,
    /// Repeatability, if anything was measured more than once.
    #[serde(default)]
    pub repeats: Option<Repeats>,
    /// Probed coordinates minus unknowns.
    pub degrees_of_freedom: usize,
    /// Condition number of the scaled problem.
    pub condition: f64,
    /// Residuals of balls predicted without them, if available.
    pub held_out: Option<HeldOut>,
    /// Residuals along the axes of the workpiece frame (rms).
    pub left_um: [f64; 3],
    /// Instruments, and drift; `None` if there are only probings that do not drift.
    #[serde(default)]
    pub observed: Option<Observed>,
    /// What temperatures explain, if any were given.
    #[serde(default)]
    pub temperatures: Option<Temperatures>,
    /// Whether the residuals depend on time, temperature, run or direction.
    pub checks: Vec<Check>,
    /// Rows that do not fit the others.
    pub suspected: Vec<Suspected>,
    /// Each probing.
    pub rows: Vec<Row>,
}

/// Rows that do not fit the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suspected {
    /// Cause and remedy.
    pub sentence: String,
}

/// The probed range of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probed {
    /// Its letter.
    pub axis: char,
    /// Its smallest and largest position (mm, deg).
    pub range: [f64; 2],
}

/// A ball.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Its name.
    pub name: String,
    /// Number of probings.
    pub probings: usize,
    /// Residual, rms.
    pub left_um: f64,
    /// Largest residual.
    pub most_um: f64,
}

/// A ball or the stylus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Its name.
    pub what: String,
    /// Where it was found: balls in the workpiece frame, the stylus in the spindle frame.
    pub found_mm: [f64; 3],
    /// Where it was stated to be, if it was.
    pub stated_mm: Option<[f64; 3]>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Its name.
    pub parameter: String,
    /// Its value (mm, rad, per mm or rad to the power of its degree).
    pub value: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty: f64,
    /// Its expanded uncertainty, k = 2.
    pub expanded_uncertainty: f64,
}

/// An unknown that could not be identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotSeen {
    /// Its name.
    pub unknown: String,
    /// The reason.
    pub sentence: String,
    /// A probing that would identify it.
    pub add: Option<String>,
}

/// Residuals of balls predicted by models fitted without them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Over all balls, rms.
    pub rms_um: f64,
}

/// Whether the residuals depend on something.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// `time_s`, `order`, `temperature_C`, `run` or `direction`.
    pub along: String,
    /// The axis, for a direction.
    pub axis: Option<char>,
    /// The run, if that is what it depends on.
    pub run: Option<f64>,
    /// Time (s) or temperature (K) over which it changes.
    pub over: Option<f64>,
    /// The change in the workpiece frame.
    pub change_um: Option<[f64; 3]>,
    /// Its standard uncertainty.
    pub standard_uncertainty_um: Option<[f64; 3]>,
    /// True if it exceeds chance.
    pub is_significant: bool,
}

/// Repeatability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Repeats {
    /// True if it is smaller than the residuals, beyond chance.
    pub is_less: bool,
}

/// A probing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its line in the file.
    pub line: usize,
    /// Its time, if known.
    pub time_s: Option<f64>,
    /// Vector from ball to tip without errors.
    pub before_um: [f64; 3],
    /// The remainder with the parameters.
    pub after_um: [f64; 3],
    /// False if it fits badly.
    pub is_trusted: bool,
}

impl Identification {
    /// True if something says how large the residuals may be: the file of readings, or places that were measured twice.
    #[must_use]
    pub fn is_judged(&self) -> bool {
        self.noise_of_stated.is_some() || self.repeats.is_some()
    }

    /// False if the residuals show errors that the model lacks: they exceed the stated noise, or the repeatability.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.refuted.is_empty() && !self.repeats.as_ref().is_some_and(|repeats| repeats.is_less)
    }

    /// What was measured, in words: `168 probings of 4 balls and 53 observations with 3 set-ups`.
    #[must_use]
    pub fn counts(&self) -> String {
        let noise = self.observed.iter().flat_map(|observed| &observed.noise);
        let observations: usize = (noise.filter(|one| one.source != "probings"))
            .map(|one| one.rows)
            .sum();
        let setups = (self.observed.as_ref()).map_or(0, |observed| observed.setups.len());
        let probings = format!("{} probings of {} balls", self.probings, self.balls.len());
        let plural = if setups == 1 { "" } else { "s" };
        let observed = format!("{observations} observations with {setups} set-up{plural}");
        match (self.probings, observations) {
            (_, 0) => probings,
            (0, _) => observed,
            _ => format!("{probings} and {observed}"),
        }
    }
}

impl Check {
    /// Its subject as text.
    #[must_use]
    pub fn words(&self) -> String {
        match (self.along.as_str(), self.over, self.axis, self.run) {
            ("time_s", Some(span), ..) => format!("drift over {span:.0} s"),
            ("temperature_C", Some(span), ..) => format!("over {span:.1} K"),
            ("direction", _, Some(axis), _) => format!("{axis} from below less from above"),
            ("run", _, _, Some(run)) => format!("run {run} from the others"),
            _ => "drift from the first to the last row".to_owned(),
        }
    }
}
