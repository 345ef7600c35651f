//! What instruments read and temperatures explain, as programs read it.

use serde::{Deserialize, Serialize};

/// What was read besides probings, and how everything drifted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservedRecord {
    /// Every kind of reading with its noise.
    pub noise: Vec<NoiseRecord>,
    /// The instruments as they were found to be set up.
    pub setups: Vec<SetupRecord>,
    /// Drift that was found together with the parameters.
    pub drift: Vec<DriftRecord>,
    /// Each reading.
    #[serde(default)]
    pub rows: Vec<ReadingRecord>,
}

/// The noise of a kind of reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseRecord {
    /// Name of the kind.
    pub source: String,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation.
    pub noise: f64,
    /// µm, or µrad for angles.
    pub unit: String,
    /// The residuals divided by the stated uncertainty, if all rows state one.
    pub of_stated: Option<f64>,
    /// Share of the degrees of freedom.
    pub degrees_of_freedom: f64,
    /// True if chance does not explain that factor.
    pub is_misstated: bool,
}

/// An instrument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetupRecord {
    /// Name in the file.
    pub name: String,
    /// What it reads.
    pub kind: String,
    /// The unknowns that the readings determine.
    pub parts: Vec<SetupPartRecord>,
}

/// An unknown of a set-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetupPartRecord {
    /// Name of the unknown.
    pub what: String,
    /// In mm; rad in addition to the start value.
    pub value: f64,
    /// Of the value.
    pub standard_uncertainty: f64,
    /// What was stated beforehand, in the same unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stated: Option<PartStated>,
}

/// What was stated of an unknown of a set-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartStated {
    /// As it was stated.
    pub value: f64,
    /// As it was stated.
    pub standard_uncertainty: f64,
    /// Standard deviations between both; nothing if no other measurement tells anything about it.
    pub z: Option<f64>,
}

/// A component of drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriftRecord {
    /// The set-up, or nothing for the artefact.
    #[serde(default)]
    pub setup: Option<String>,
    /// `x`, `y`, `z`: along; `a`, `b`, `c`: about.
    #[serde(default)]
    pub component: String,
    /// In mm or rad.
    #[serde(default)]
    pub value: f64,
    /// Of the value.
    #[serde(default)]
    pub standard_uncertainty: f64,
    /// From the first to the last row.
    #[serde(default)]
    pub over_s: f64,
    /// If it approached its end exponentially.
    #[serde(default)]
    pub time_constant_s: Option<f64>,
    /// What moved how far.
    pub sentence: String,
}

/// A reading; residuals in µm, or µrad for angles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReadingRecord {
    /// Name of the file.
    pub file: String,
    /// Line in the file.
    pub line: usize,
    /// Name of the set-up.
    pub setup: String,
    /// What was read.
    pub kind: String,
    /// Without errors.
    pub before: Vec<f64>,
    /// With the parameters.
    pub after: Vec<f64>,
    /// False if it fits badly.
    pub is_trusted: bool,
}

/// What temperatures explain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TemperaturesRecord {
    /// Changes of parameters.
    pub terms: Vec<ThermalRecord>,
    /// What is left of cycles that were predicted from the others, without temperatures (rms of a coordinate).
    pub left_out_without_um: f64,
    /// Like `left_out_without_um`, with them.
    pub left_out_with_um: f64,
    /// Another cycle stays within this (95 % of coordinates).
    pub coverage_95_um: f64,
    /// Each cycle that was left out.
    #[serde(default)]
    pub cycles: Vec<CycleRecord>,
    /// What was not taken, and why.
    #[serde(default)]
    pub dropped: Vec<String>,
}

/// The change of a parameter with a temperature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ThermalRecord {
    /// Name of the parameter.
    pub parameter: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Time constant between sensor and effect.
    pub lag_s: f64,
    /// Of the time constant.
    #[serde(default)]
    pub lag_standard_uncertainty_s: Option<f64>,
    /// Where the change is zero.
    #[serde(default)]
    pub reference_celsius: f64,
    /// In mm, rad, per mmᵏ or radᵏ.
    pub per_kelvin: f64,
    /// Of the change per kelvin.
    pub standard_uncertainty: f64,
}

/// A cycle that was predicted from the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CycleRecord {
    /// Number of its equations.
    pub equations: usize,
    /// Residual without temperatures.
    pub without_um: f64,
    /// Residual with them.
    pub with_um: f64,
}
