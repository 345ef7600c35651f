//! Thermal terms in the output of `trueaxis identify`.

use super::super::quantity::{EXPANDED, count, shown};
use trueaxis_identify::{FoundChange, Warmed};
use trueaxis_study::StudyOutcome;

fn term(warmed: &Warmed, change: &FoundChange) -> String {
    let input = &warmed.model.inputs[change.input];
    let (show, unit) = shown(change.parameter);
    let lag = match warmed.lag_uncertainty[change.input] {
        Some(u) => format!(", lag {:.0} ± {:.0} s", input.lag, EXPANDED * u * input.lag),
        None => String::new(),
    };
    format!(
        "  {:<8}{:>12} ±{:>10} {unit} per K of {}{lag}\n",
        change.parameter.to_string(),
        show(change.per_kelvin).trim(),
        show(EXPANDED * change.uncertainty).trim(),
        input.sensor
    )
}

/// The terms, what they explain, and what was dropped.
pub fn lines(text: &mut String, found: &StudyOutcome<'_>) {
    let Some(warmed) = &found.warmed else { return };
    let [without, with] = warmed.left_out.map(|mm| mm * 1e3);
    *text += &format!(
        "\ntemperatures, from {} each predicted by the others\n",
        count(warmed.cycles.len(), "cycle")
    );
    if found.identified.thermal.is_empty() {
        *text += "  no temperature improves the prediction of left-out cycles\n";
    }
    let changes = found.identified.thermal.iter();
    text.extend(changes.map(|change| term(warmed, change)));
    *text += &format!(
        "  residual of left-out cycles: {without:.2} µm without temperatures (rms of a coordinate)\n"
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
