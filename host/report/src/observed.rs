//! Instruments, drift and temperatures of an identification, as the page shows them.

use super::words::{figure, quantity};
use serde::{Deserialize, Serialize};

/// What was read besides probings, and how everything drifted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observed {
    /// Every kind of reading with its noise.
    pub noise: Vec<Noise>,
    /// The instruments as they were found to be set up.
    pub setups: Vec<Setup>,
    /// Drift that was found together with the parameters.
    pub drift: Vec<Drift>,
}

/// The noise of a kind of reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Its name.
    pub source: String,
    /// Number of rows.
    pub rows: usize,
    /// Standard deviation.
    pub noise: f64,
    /// Its unit.
    pub unit: String,
    /// The residuals divided by the stated uncertainty, if all rows state one.
    pub of_stated: Option<f64>,
    /// Degrees of freedom.
    pub degrees_of_freedom: f64,
    /// True if chance does not explain that factor.
    pub is_misstated: bool,
}

/// An instrument.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Its name.
    pub name: String,
    /// What it reads.
    pub kind: String,
    /// Its unknowns.
    pub parts: Vec<Part>,
}

/// An unknown of a set-up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its name.
    pub what: String,
    /// Its value (mm; rad in addition to the start value).
    pub value: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty: f64,
}

/// A component of drift.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// What moved how far.
    pub sentence: String,
}

/// What temperatures explain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Temperatures {
    /// Changes of parameters.
    pub terms: Vec<Term>,
    /// What is left of cycles that were predicted from the others, without temperatures (rms of a coordinate).
    pub left_out_without_um: f64,
    /// The same with them.
    pub left_out_with_um: f64,
    /// Another cycle stays within this (95 % of coordinates).
    pub band_95_um: f64,
}

/// The change of a parameter with a temperature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// Its name.
    pub parameter: String,
    /// The sensor.
    pub sensor: String,
    /// Time constant between sensor and effect.
    pub lag_s: f64,
    /// Change per kelvin.
    pub per_kelvin: f64,
    /// Its standard uncertainty.
    pub standard_uncertainty: f64,
}

/// The same as rows of tables, in words.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Shown {
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

impl Shown {
    /// With at most so many unknowns of set-ups; `None` if there is nothing besides probings.
    pub fn of(
        observed: Option<&Observed>,
        temperatures: Option<&Temperatures>,
        most: usize,
    ) -> Option<Self> {
        let mut shown = Self::default();
        if let Some(observed) = observed {
            let source = |one: &Noise| {
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
            shown.setups = parts.map(|(setup, part)| part.row(setup)).collect();
            shown.unlisted_setups = shown.setups.len().saturating_sub(most);
            shown.setups.truncate(most);
            shown.drift = observed
                .drift
                .iter()
                .map(|one| one.sentence.clone())
                .collect();
        }
        if let Some(warmed) = temperatures {
            shown.terms = warmed.terms.iter().map(Term::row).collect();
            shown.temperatures = Some(warmed.sentence());
        }
        (observed.is_some() || temperatures.is_some()).then_some(shown)
    }
}

impl Part {
    fn row(&self, setup: &Setup) -> [String; 4] {
        let (factor, unit) = match self.what.starts_with("rotation") {
            true => (1e3, "mrad"),
            false => (1.0, "mm"),
        };
        // Avoids −0.
        let value = (self.value * factor * 1e4).round() / 1e4 + 0.0;
        let uncertainty = EXPANDED * self.standard_uncertainty * factor;
        [
            format!("{} ({})", setup.name, setup.kind),
            self.what.clone(),
            format!("{value:.4} {unit}").replace('-', "−"),
            format!("{uncertainty:.4} {unit}"),
        ]
    }
}

impl Term {
    fn row(&self) -> [String; 5] {
        let name = format!("{} (per K)", self.parameter);
        let lag = match self.lag_s > 0.0 {
            true => format!("{:.0} s", self.lag_s),
            false => "–".to_owned(),
        };
        [
            self.parameter.clone(),
            self.sensor.clone(),
            quantity(&name, self.per_kelvin),
            quantity(&name, EXPANDED * self.standard_uncertainty),
            lag,
        ]
    }
}

impl Temperatures {
    fn sentence(&self) -> String {
        if self.terms.is_empty() {
            return "No temperature predicts warm-ups that were left out better than none."
                .to_owned();
        }
        format!(
            "Warm-ups predicted from the others are off by {} µm with these terms and by {} µm without (rms of a coordinate). Another one stays within ± {} µm (95 % of coordinates).",
            figure(self.left_out_with_um),
            figure(self.left_out_without_um),
            figure(self.band_95_um)
        )
    }
}
