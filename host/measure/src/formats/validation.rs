//! `validation.json`: what was measured at other positions without and with a compensation, by
//! `trueaxis linuxcnc calibrate`.

use serde::{Deserialize, Serialize};

/// Scatter of the tip around the balls (µm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scatter {
    /// Root mean square over the probings.
    pub rms_um: f64,
    /// The largest.
    pub largest_um: f64,
}

/// A compensation, proven by probings from which nothing was identified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Number of probings, each made before and after.
    pub probings: usize,
    /// The machine as it was found.
    pub before: Scatter,
    /// The machine with the new compensation.
    pub after: Scatter,
    /// What probing itself scatters, from what identification left (µm).
    pub probing_um: f64,
    /// What is not known of the parameters (µm, 95 %, mean over the travel).
    pub band_um: f64,
    /// The largest accepted `after.rms_um`: both, and the scatter of so few rows (µm).
    pub expected_um: f64,
    /// Errors that were not measured, `[unseen]` of the error file: they are in none of these figures but `after`, as far
    /// as they show at these positions.
    #[serde(default)]
    pub unseen: Vec<String>,
    /// Whether the new compensation is in use.
    pub is_kept: bool,
}
