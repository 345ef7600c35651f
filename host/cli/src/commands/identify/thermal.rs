//! Thermal terms in the output of `trueaxis identify`.

use super::super::bad_input::BadInput;
use super::super::files::Text;
use super::super::quantity::{EXPANDED, count, shown};
use super::Found;
use serde::Serialize;
use std::path::Path;
use trueaxis_measure::formats::temperatures;
use trueaxis_measure::identify::{Identified, Model, Problem, Warmed, thermal};
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;

/// The parameters that may change with temperature.
pub fn candidates(
    names: Option<&str>,
    machine: &Machine,
    looked_for: &[Parameter],
) -> Result<Vec<Parameter>, BadInput> {
    let Some(names) = names else {
        return Ok(looked_for.to_vec());
    };
    let named = names
        .parse::<Model>()
        .and_then(|m| m.parameters(machine, 0, &[]));
    named.map_err(|error| BadInput::new(format!("--thermal: {}", error.reason), error.remedy))
}

/// What the temperatures of a file explain.
pub fn warmed(
    problem: &Problem<'_>,
    cold: &Identified,
    path: &Path,
    candidates: &[Parameter],
) -> Result<Warmed, BadInput> {
    let text = Text::read(path)?;
    let log = temperatures::read(&text.text).map_err(|e| text.bad(e))?;
    thermal(problem, cold, &log, candidates)
        .map_err(|e| BadInput::new(format!("{}: {}", path.display(), e.reason), e.remedy))
}

/// The terms, what they explain, and what was dropped.
pub fn lines(text: &mut String, found: &Found<'_>) {
    let Some(warmed) = &found.warmed else { return };
    let [without, with] = warmed.left_out.map(|mm| mm * 1e3);
    *text += &format!(
        "\ntemperatures, from {} each predicted by the others\n",
        count(warmed.cycles.len(), "cycle")
    );
    if found.identified.thermal.is_empty() {
        *text += "  no temperature predicts left-out cycles better than none\n";
    }
    for change in &found.identified.thermal {
        let input = &warmed.model.inputs[change.input];
        let (show, unit) = shown(change.parameter);
        let lag = match warmed.lag_uncertainty[change.input] {
            Some(u) => format!(", lag {:.0} ± {:.0} s", input.lag, EXPANDED * u * input.lag),
            None => String::new(),
        };
        *text += &format!(
            "  {:<8}{:>12} ±{:>10} {unit} per K of {}{lag}\n",
            change.parameter.to_string(),
            show(change.per_kelvin).trim(),
            show(EXPANDED * change.uncertainty).trim(),
            input.sensor
        );
    }
    *text += &format!(
        "  left of left-out cycles: {without:.2} µm without temperatures (rms of a coordinate)\n"
    );
    for taken in &warmed.taken {
        *text += &format!("    {:.2} µm with {}\n", taken.left_out * 1e3, taken.sensor);
    }
    if !warmed.taken.is_empty() {
        *text += &format!("    {with:.2} µm without the terms that do not help\n");
        let each = warmed
            .cycles
            .iter()
            .map(|c| format!("{:.2} instead of {:.2}", c.with * 1e3, c.without * 1e3));
        *text += &format!("  by cycle (µm): {}\n", each.collect::<Vec<_>>().join(", "));
        *text += &format!(
            "  another cycle stays within ± {:.2} µm (95 % of coordinates, with the noise of the readings)\n",
            warmed.band * 1e3
        );
    }
    for dropped in &warmed.dropped {
        *text += &format!("  not used: {dropped}\n");
    }
}

/// The same as JSON.
#[derive(Serialize)]
pub struct Temperatures {
    terms: Vec<Term>,
    /// Root mean square of a coordinate of left-out cycles (µm).
    left_out_without_um: f64,
    left_out_with_um: f64,
    band_95_um: f64,
    cycles: Vec<Cycle>,
    dropped: Vec<String>,
}

#[derive(Serialize)]
struct Term {
    parameter: String,
    sensor: String,
    lag_s: f64,
    lag_standard_uncertainty_s: Option<f64>,
    reference_celsius: f64,
    /// mm, rad, per mmᵏ or radᵏ.
    per_kelvin: f64,
    standard_uncertainty: f64,
}

#[derive(Serialize)]
struct Cycle {
    equations: usize,
    without_um: f64,
    with_um: f64,
}

impl Temperatures {
    pub fn of(found: &Found<'_>) -> Option<Self> {
        let warmed = found.warmed.as_ref()?;
        let terms = found.identified.thermal.iter().map(|change| {
            let input = &warmed.model.inputs[change.input];
            Term {
                parameter: change.parameter.to_string(),
                sensor: input.sensor.clone(),
                lag_s: input.lag,
                lag_standard_uncertainty_s: warmed.lag_uncertainty[change.input]
                    .map(|u| u * input.lag),
                reference_celsius: input.reference_celsius,
                per_kelvin: change.per_kelvin,
                standard_uncertainty: change.uncertainty,
            }
        });
        let cycles = warmed.cycles.iter().map(|c| Cycle {
            equations: c.rows,
            without_um: c.without * 1e3,
            with_um: c.with * 1e3,
        });
        Some(Self {
            terms: terms.collect(),
            left_out_without_um: warmed.left_out[0] * 1e3,
            left_out_with_um: warmed.left_out[1] * 1e3,
            band_95_um: warmed.band * 1e3,
            cycles: cycles.collect(),
            dropped: warmed.dropped.clone(),
        })
    }
}
