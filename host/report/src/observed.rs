//! Instruments, drift and temperatures of an identification, as the page shows them.

use super::words::{figure, quantity};
use serde::Serialize;
use trueaxis_study::{
    NoiseRecord, ObservedRecord, SetupPartRecord, SetupRecord, TemperaturesRecord, ThermalRecord,
};

/// Rows of tables, in words.
#[derive(Debug, Default, Serialize)]
pub(crate) struct ShownRows {
    /// Source, rows, noise, of stated, degrees of freedom.
    sources: Vec<[String; 5]>,
    /// Set-up, unknown, value, expanded uncertainty.
    setups: Vec<[String; 4]>,
    unlisted_setups: usize,
    drift: Vec<String>,
    /// Parameter, sensor, change per kelvin, expanded uncertainty, lag.
    terms: Vec<[String; 5]>,
    temperatures: Option<String>,
}

/// Coverage factor of expanded uncertainties.
const EXPANDED: f64 = 2.0;

impl ShownRows {
    /// With at most so many unknowns of set-ups; `None` if there is nothing besides probings.
    pub fn of(
        observed: Option<&ObservedRecord>,
        temperatures: Option<&TemperaturesRecord>,
        most: usize,
    ) -> Option<Self> {
        let mut shown = Self::default();
        if let Some(observed) = observed {
            let source = |one: &NoiseRecord| {
                let factor = one.of_stated.map_or("–".to_owned(), figure);
                let doubt = if one.is_misstated {
                    ", more than chance explains"
                } else {
                    ""
                };
                [
                    one.source.clone(),
                    one.rows.to_string(),
                    format!("{} {}", figure(one.noise), one.unit),
                    factor + doubt,
                    figure(one.degrees_of_freedom),
                ]
            };
            shown.sources = observed.noise.iter().map(source).collect();
            let setups = observed.setups.iter();
            let parts = setups.flat_map(|setup| setup.parts.iter().map(move |part| (setup, part)));
            shown.setups = parts.map(|(setup, part)| of_part(setup, part)).collect();
            shown.unlisted_setups = shown.setups.len().saturating_sub(most);
            shown.setups.truncate(most);
            shown.drift = observed
                .drift
                .iter()
                .map(|one| one.sentence.clone())
                .collect();
        }
        if let Some(warmed) = temperatures {
            shown.terms = warmed.terms.iter().map(of_term).collect();
            shown.temperatures = Some(sentence(warmed));
        }
        (observed.is_some() || temperatures.is_some()).then_some(shown)
    }
}

fn of_part(setup: &SetupRecord, part: &SetupPartRecord) -> [String; 4] {
    let (factor, unit) = match part.what.starts_with("rotation") {
        true => (1e3, "mrad"),
        false => (1.0, "mm"),
    };
    // Avoids −0.
    let value = (part.value * factor * 1e4).round() / 1e4 + 0.0;
    let uncertainty = EXPANDED * part.standard_uncertainty * factor;
    [
        format!("{} ({})", setup.name, setup.kind),
        part.what.clone(),
        format!("{value:.4} {unit}").replace('-', "−"),
        format!("{uncertainty:.4} {unit}"),
    ]
}

fn of_term(term: &ThermalRecord) -> [String; 5] {
    let name = format!("{} (per K)", term.parameter);
    let lag = match term.lag_s > 0.0 {
        true => format!("{:.0} s", term.lag_s),
        false => "–".to_owned(),
    };
    [
        term.parameter.clone(),
        term.sensor.clone(),
        quantity(&name, term.per_kelvin),
        quantity(&name, EXPANDED * term.standard_uncertainty),
        lag,
    ]
}

fn sentence(warmed: &TemperaturesRecord) -> String {
    if warmed.terms.is_empty() {
        return "No temperature improves the prediction of left-out warm-ups.".to_owned();
    }
    format!(
        "Warm-ups predicted from the others are off by {} µm with these terms and by {} µm without (rms of a coordinate). Another one stays within ± {} µm (95 % of coordinates).",
        figure(warmed.left_out_with_um),
        figure(warmed.left_out_without_um),
        figure(warmed.coverage_95_um)
    )
}
