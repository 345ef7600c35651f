//! What runs show, as it is written for programs: names, files and units with every figure.

use crate::{DirectResult, FoundLocation, FoundMotion, Measurement};
use serde::Serialize;
use trueaxis_model::machine::Machine;

/// All results of [`solve`](fn@crate::solve); positions in mm and degrees.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DirectRecord {
    /// Name of the machine.
    pub machine: String,
    /// Error motions, axis by axis.
    pub motions: Vec<MotionRecord>,
    /// Squareness errors.
    pub locations: Vec<LocationRecord>,
    /// Slopes of straightedges, removed from straightness runs.
    pub slopes: Vec<SlopeRecord>,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// An error motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionRecord {
    /// Name, like `EYX`.
    pub motion: String,
    /// File that shows it.
    pub file: String,
    /// Unit of the values: `µm` or `µrad`.
    pub unit: &'static str,
    /// Commanded positions of the axis.
    pub at: Vec<f64>,
    /// Values in positive travel.
    pub positive: Vec<f64>,
    /// Values in negative travel, where they are separate.
    pub negative: Option<Vec<f64>>,
    /// Mean of positive less negative travel.
    pub mean_reversal: Option<f64>,
    /// Standard uncertainty of a value.
    pub standard_uncertainty: Option<f64>,
}

/// A squareness error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LocationRecord {
    /// Name, like `EC0Y`.
    pub parameter: String,
    /// File that shows it.
    pub file: String,
    /// In the sense of ISO 230-1.
    pub value_urad: f64,
    /// `None` if no reading states one.
    pub standard_uncertainty_urad: Option<f64>,
}

/// The slope of a straightedge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlopeRecord {
    /// File of the run.
    pub file: String,
    /// Against the axis.
    pub slope_urad: f64,
}

/// Warnings, each with the file that it is about.
#[must_use]
pub fn warnings(found: &DirectResult, measurements: &[Measurement]) -> Vec<String> {
    let said = found.doubts.iter().map(|doubt| match doubt.file {
        Some(file) => format!("{}: {doubt}", measurements[file].name),
        None => doubt.to_string(),
    });
    said.collect()
}

impl FoundMotion {
    /// From mm or rad to the unit in which people read it.
    #[must_use]
    pub fn shown(&self) -> (f64, &'static str) {
        match self.component >= 3 {
            true => (1e6, "µrad"),
            false => (1e3, "µm"),
        }
    }
}

impl DirectRecord {
    /// Of results, with the measurements that they come from.
    #[must_use]
    pub fn of(machine: &Machine, measurements: &[Measurement], found: &DirectResult) -> Self {
        let file = |k: usize| measurements[k].name.clone();
        let motion = |m: &FoundMotion| {
            let (factor, unit) = m.shown();
            let scaled = |values: &Vec<f64>| values.iter().map(|v| v * factor).collect();
            let axis = &machine.axes[m.axis];
            MotionRecord {
                motion: m.name(machine),
                file: file(m.from),
                unit,
                at: m.at.iter().map(|q| axis.to_command(*q)).collect(),
                positive: scaled(&m.positive),
                negative: m.negative.as_ref().map(scaled),
                mean_reversal: m.backlash().map(|b| 2.0 * b * factor),
                standard_uncertainty: m.uncertainty.map(|u| u * factor),
            }
        };
        let location = |l: &FoundLocation| LocationRecord {
            parameter: l.parameter.to_string(),
            file: file(l.from),
            value_urad: l.value * 1e6,
            standard_uncertainty_urad: l.uncertainty.map(|u| u * 1e6),
        };
        let slope = |(k, slope): &(usize, f64)| SlopeRecord {
            file: file(*k),
            slope_urad: slope * 1e6,
        };
        Self {
            machine: machine.name.clone(),
            motions: found.motions.iter().map(motion).collect(),
            locations: found.locations.iter().map(location).collect(),
            slopes: found.slopes.iter().map(slope).collect(),
            warnings: warnings(found, measurements),
        }
    }
}
