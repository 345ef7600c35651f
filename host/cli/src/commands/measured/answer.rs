//! Output of `trueaxis measured --json`.

use super::Imported;
use serde::Serialize;

/// All results; values in µm and µrad, positions in mm and degrees.
#[derive(Serialize)]
pub struct MeasuredAnswer<'a> {
    machine: &'a str,
    motions: Vec<MotionAnswer<'a>>,
    locations: Vec<Location<'a>>,
    /// Slopes removed from straightness runs.
    slopes: Vec<SlopeAnswer<'a>>,
    warnings: Vec<String>,
}

#[derive(Serialize)]
struct MotionAnswer<'a> {
    motion: String,
    file: &'a str,
    unit: &'static str,
    at: Vec<f64>,
    positive: Vec<f64>,
    negative: Option<Vec<f64>>,
    mean_reversal: Option<f64>,
    standard_uncertainty: Option<f64>,
}

#[derive(Serialize)]
struct Location<'a> {
    parameter: String,
    file: &'a str,
    value_urad: f64,
    standard_uncertainty_urad: Option<f64>,
}

#[derive(Serialize)]
struct SlopeAnswer<'a> {
    file: &'a str,
    slope_urad: f64,
}

impl<'a> MeasuredAnswer<'a> {
    pub fn new(imported: &'a Imported) -> Self {
        let Imported {
            machine,
            measurements,
            found,
        } = imported;
        let file = |k: usize| measurements[k].name.as_str();
        let motions = found.motions.iter().map(|m| {
            let (factor, unit) = match m.component >= 3 {
                true => (1e6, "µrad"),
                false => (1e3, "µm"),
            };
            let scaled = |values: &Vec<f64>| values.iter().map(|v| v * factor).collect();
            MotionAnswer {
                motion: m.name(machine),
                file: file(m.from),
                unit,
                at: (m.at.iter())
                    .map(|q| machine.axes[m.axis].to_command(*q))
                    .collect(),
                positive: scaled(&m.positive),
                negative: m.negative.as_ref().map(scaled),
                mean_reversal: m.backlash().map(|b| 2.0 * b * factor),
                standard_uncertainty: m.uncertainty.map(|u| u * factor),
            }
        });
        Self {
            machine: &machine.name,
            motions: motions.collect(),
            locations: (found.locations.iter())
                .map(|l| Location {
                    parameter: l.parameter.to_string(),
                    file: file(l.from),
                    value_urad: l.value * 1e6,
                    standard_uncertainty_urad: l.uncertainty.map(|u| u * 1e6),
                })
                .collect(),
            slopes: (found.slopes.iter())
                .map(|(k, slope)| SlopeAnswer {
                    file: file(*k),
                    slope_urad: slope * 1e6,
                })
                .collect(),
            warnings: super::warnings(found, measurements),
        }
    }
}
