//! How far a compensation has reduced each parameter, as text and as JSON.

use super::super::quantity::{EXPANDED, shown};
use serde::Serialize;
use trueaxis_measure::identify::{Compensability, Compensated};

/// The effect of a compensation.
#[derive(Serialize)]
pub struct Gone {
    parameters: Vec<OneGone>,
    /// Mean displacement of the tip by all parameters at the probings, before and after.
    mean_um: [f64; 2],
    largest_um: [f64; 2],
}

#[derive(Serialize)]
struct OneGone {
    parameter: String,
    before: f64,
    before_standard_uncertainty: f64,
    after: Option<f64>,
    after_standard_uncertainty: Option<f64>,
    /// 1 if the whole error is removed; `None` if unknown.
    compensability: Option<f64>,
    compensability_standard_uncertainty: Option<f64>,
    is_small_before: bool,
    effect_um: [f64; 2],
}

impl Gone {
    pub fn new(compared: &Compensated) -> Self {
        let um = |k: usize| compared.tip.map(|of| of[k] * 1e3);
        Self {
            parameters: compared.parameters.iter().map(OneGone::new).collect(),
            mean_um: um(0),
            largest_um: um(1),
        }
    }
}

impl OneGone {
    fn new(one: &Compensability) -> Self {
        Self {
            parameter: one.parameter.to_string(),
            before: one.before[0],
            before_standard_uncertainty: one.before[1],
            after: one.after.map(|after| after[0]),
            after_standard_uncertainty: one.after.map(|after| after[1]),
            compensability: one.part().map(|part| part[0]),
            compensability_standard_uncertainty: one.part().map(|part| part[1]),
            is_small_before: one.is_small(),
            effect_um: one.effect.map(|effect| effect * 1e3),
        }
    }
}

/// A line for each parameter.
pub fn compensability(text: &mut String, compared: Option<&Compensated>) {
    let Some(compared) = compared else { return };
    *text += &format!(
        "\n{:<14}{:>14}{:>12} {:<6}{:>22}{:>16}{:>8}\n",
        "parameter", "before", "after", "", "compensability (k = 2)", "effect (µm)", "after"
    );
    for one in &compared.parameters {
        let (show, unit) = shown(one.parameter);
        let after = one.after.map_or("-".to_owned(), |[value, _]| show(value));
        *text += &format!(
            "  {:<12}{:>14}{after:>12} {unit:<6}{:>22}{:>16.2}{:>8.2}\n",
            one.parameter.to_string(),
            show(one.before[0]),
            gone(one),
            one.effect[0] * 1e3,
            one.effect[1] * 1e3
        );
    }
    let [mean, largest] = [0, 1].map(|k| compared.tip.map(|of| of[k] * 1e3));
    for (name, [before, after]) in [("mean", mean), ("largest", largest)] {
        let name = format!("tip at these probings (µm), {name}");
        *text += &format!("  {name:<69}{before:>16.2}{after:>8.2}\n");
    }
}

/// The removed share of a parameter, with its expanded uncertainty.
fn gone(one: &Compensability) -> String {
    match one.part() {
        Some([part, uncertainty]) => format!(
            "{:.1} ± {:.1} %",
            100.0 * part,
            100.0 * EXPANDED * uncertainty
        ),
        None if one.is_small() => "too small before".to_owned(),
        None => "not seen".to_owned(),
    }
}
