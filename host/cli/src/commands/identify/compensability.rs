//! How far a compensation has reduced each parameter.

use super::super::quantity::{EXPANDED, shown};
use trueaxis_identify::{Compensability, Compensated};

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
