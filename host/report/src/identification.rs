//! What an identification says of itself: what `identify --json` writes, as far as a report shows it.

use serde::{Deserialize, Serialize};

/// An identification, in the names and units of `identify --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identification {
    /// The machine.
    pub machine: String,
    /// How many probings.
    pub probings: usize,
    /// From where to where each axis went.
    pub probed: Vec<Probed>,
    /// The balls.
    pub balls: Vec<Ball>,
    /// The parameters that were found.
    pub parameters: Vec<Estimate>,
    /// Pairs of parameters whose correlation is above 0.9.
    pub correlations: Vec<(String, String, f64)>,
    /// What could not be seen.
    pub unseen: Vec<NotSeen>,
    /// Standard deviation of a coordinate.
    pub noise_um: f64,
    /// Probed coordinates less unknowns.
    pub degrees_of_freedom: usize,
    /// Condition of the scaled problem.
    pub condition: f64,
    /// What balls were predicted to without them, if that could be tried.
    pub held_out: Option<HeldOut>,
    /// What is left along the axes of the workpiece frame (rms).
    pub left_um: [f64; 3],
    /// Whether what is left goes with time, temperature, run or direction.
    pub checks: Vec<Check>,
    /// What does not go with the other rows.
    pub suspected: Vec<Suspected>,
    /// Each probing.
    pub rows: Vec<Row>,
}

/// Rows that do not go with the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suspected {
    /// What they are, and what to do.
    pub sentence: String,
}

/// What probings have seen of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Probed {
    /// Its letter.
    pub axis: char,
    /// Its least and its largest position (mm, deg).
    pub range: [f64; 2],
}

/// A ball.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ball {
    /// Its name.
    pub name: String,
    /// How often it was probed.
    pub probings: usize,
    /// What is left there, rms.
    pub left_um: f64,
    /// The most that is left there.
    pub most_um: f64,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Its name.
    pub parameter: String,
    /// Its value (mm, rad, per mm or rad to its degree).
    pub value: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty: f64,
    /// Its expanded uncertainty, k = 2.
    pub expanded_uncertainty: f64,
}

/// What could not be seen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NotSeen {
    /// Its name.
    pub unknown: String,
    /// Why.
    pub sentence: String,
    /// A probing with which it would be seen.
    pub add: Option<String>,
}

/// Balls that were left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Of all.
    pub rms_um: f64,
}

/// Whether what is left goes with something.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// `time_s`, `order`, `temperature_C`, `run` or `direction`.
    pub along: String,
    /// The axis of a direction.
    pub axis: Option<char>,
    /// The run.
    pub run: Option<f64>,
    /// Time (s) or temperature (K) over which it changes.
    pub over: Option<f64>,
    /// By how much, in the workpiece frame.
    pub change_um: Option<[f64; 3]>,
    /// Its standard uncertainty.
    pub standard_uncertainty_um: Option<[f64; 3]>,
    /// True if it is more than chance.
    pub is_significant: bool,
}

/// A probing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its line in the file.
    pub line: usize,
    /// When it was, if that is known.
    pub time_s: Option<f64>,
    /// From tip to ball without errors.
    pub before_um: [f64; 3],
    /// What the parameters leave of that.
    pub after_um: [f64; 3],
    /// False if it fits badly.
    pub is_trusted: bool,
}

impl Check {
    /// What it is about.
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
