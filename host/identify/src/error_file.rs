//! Writes identified parameters as an error file.

use crate::formats::observations::Observations;
use crate::formats::probings::Probings;
use crate::{FoundChange, Identified, NotKnown, effect_over_travel};
use std::fmt::Write;
use trueaxis_direct::{counted_twice, tables};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::extremes;

/// Narrowest range (mm or deg) that an error file may declare as calibrated.
const NARROWEST: f64 = 1.0;

/// `[thermal]`: each parameter with its changes.
fn thermal(identified: &Identified) -> String {
    let mut text = String::new();
    let mut parameters: Vec<Parameter> = Vec::new();
    for change in &identified.thermal {
        if !parameters.contains(&change.parameter) {
            parameters.push(change.parameter);
        }
    }
    if !parameters.is_empty() {
        text += "\n[thermal]  # per kelvin from the reference; lag_s: 63 % of a step has arrived\n";
    }
    for parameter in parameters {
        let own = (identified.thermal.iter()).filter(|c| c.parameter == parameter);
        let entry = |change: &FoundChange| {
            let input = &identified.errors.sensors[change.input];
            let lag = match input.lag {
                0.0 => String::new(),
                lag => format!(", lag_s = {lag:?}"),
            };
            let [low, high] = input.range_kelvin;
            format!(
                "    {{ per_kelvin = {:.4e}, sensor = {}{lag}, reference_celsius = {:?}, range_kelvin = [{low:.1}, {high:.1}] }},  # ± {:.1e}, k = 1\n",
                change.per_kelvin,
                toml::Value::from(input.sensor.as_str()),
                input.reference_celsius,
                change.uncertainty
            )
        };
        let entries: String = own.map(entry).collect();
        let _ = write!(text, "{parameter} = [\n{entries}]\n");
    }
    text
}

/// `[unseen]`: what is not known, and the scales that no length reference shows, each with what 10 µm (10 µrad, 10 µm/m)
/// of it changes at the tip over the travel (µm).
fn unseen(machine: &Machine, identified: &Identified, unknown: &NotKnown) -> String {
    const UNIT: f64 = 1e-2;
    let mut text = String::new();
    for (parameters, remedy) in [
        (
            &unknown.hidden,
            "the stylus takes it up: qualify the probe (--probe), or state the place of the stylus",
        ),
        (
            &unknown.motions,
            "no motion of it was measured: give runs of it to the same command, or probe balls",
        ),
        (
            &unknown.backlash,
            "no row says from which side the axis came, or all from one: measure runs in both directions, or if there is none, move it to [parameters] with 0",
        ),
    ] {
        for parameter in parameters {
            let per_unit = if parameter.is_angular() { 1e-3 } else { 1.0 };
            let um = effect_over_travel(machine, *parameter) * per_unit * UNIT * 1e3;
            let _ = writeln!(text, "{parameter} = {um:.1}  # {remedy}");
        }
    }
    for scale in identified.errors.missing_scales(machine) {
        let travel = machine.index(scale.axis).map(|i| machine.axes[i].travel);
        let um = travel.map_or(0.0, |[low, high]| (high - low) * UNIT);
        let _ = writeln!(
            text,
            "{scale} = {um:.1}  # no length reference: probe a bar of known length, or measure with a laser"
        );
    }
    match text.is_empty() {
        true => text,
        false => format!(
            "\n[unseen]  # may exist, not measured: µm at the tip, over the travel, for 10 µm, 10 µrad or 10 µm/m of it\n{text}"
        ),
    }
}

/// An error file: parameters in the order of the model, standard uncertainties, the name of the covariance file, what is
/// not known, and the probed range. Parameters that were not identified are kept.
#[must_use]
pub fn error_file(
    machine: &Machine,
    probings: &Probings,
    observations: &Observations,
    identified: &Identified,
    unknown: &NotKnown,
    covariance: &str,
) -> String {
    let mut text = format!(
        "machine = {}\n{}\n[parameters]  # mm, rad, mm/mm; coefficients per mm or rad to their degree\n",
        toml::Value::from(machine.name.as_str()),
        // Location errors were identified with the tables as they are.
        match counted_twice(machine, &identified.errors).is_empty() {
            true => "",
            false => "slopes_beside_squareness = true\n",
        }
    );
    text += &parameters(machine, identified);
    text += &thermal(identified);
    let _ = write!(
        text,
        "\n[uncertainty]\ncovariance = {}\n",
        toml::Value::from(covariance)
    );
    text += &misfits(observations, unknown);
    text += &unseen(machine, identified, unknown);
    let calibrated: String = (0..machine.axes.len())
        .filter_map(|i| {
            let [low, high] = calibrated(machine, probings, observations, identified, i)?;
            let letter = machine.axes[i].letter;
            Some(format!("{letter} = [{low:.3}, {high:.3}]\n"))
        })
        .collect();
    if !calibrated.is_empty() {
        text += "\n[calibrated]  # mm or deg: the range that was probed\n";
        text += &calibrated;
    }
    tables(&mut text, machine, &identified.errors, &|_, _| Vec::new());
    text
}

/// Whether a parameter was identified.
fn is_found(identified: &Identified, parameter: Parameter) -> bool {
    let mut all = identified.parameters.iter();
    all.any(|e| e.parameter == parameter)
}

/// Values and standard uncertainties, of what was known before and of what was identified.
fn parameters(machine: &Machine, identified: &Identified) -> String {
    let mut text = String::new();
    // A scale of zero that nobody has measured is listed as not seen.
    let missing = identified.errors.missing_scales(machine);
    let kept = identified.errors.parameters.iter();
    let kept: Vec<_> = kept
        .filter(|(p, _)| !is_found(identified, **p) && !missing.contains(p))
        .collect();
    if !kept.is_empty() {
        text += "# Not identified, but known before:\n";
        for (parameter, value) in kept {
            let _ = writeln!(text, "{parameter} = {value:e}");
        }
        text += "# Identified:\n";
    }
    for e in &identified.parameters {
        let _ = writeln!(text, "{} = {:.6e}", e.parameter, e.value);
    }
    text += "\n[standard_uncertainty]\n";
    for e in &identified.parameters {
        let _ = writeln!(text, "{} = {:.3e}", e.parameter, e.uncertainty);
    }
    let known = identified.errors.standard_uncertainty.iter();
    for (parameter, uncertainty) in known.filter(|(p, _)| !is_found(identified, **p)) {
        let _ = writeln!(text, "{parameter} = {uncertainty:e}");
    }
    text
}

/// How far measurements are off for other reasons than the parameters.
fn misfits(observations: &Observations, unknown: &NotKnown) -> String {
    let mut text = String::new();
    if let Some(misfit) = unknown.misfit {
        let _ = writeln!(
            text,
            "misfit_um = {:.3}  # by errors that the model lacks, where it was measured: rms of a coordinate of the tip",
            misfit * 1e3
        );
    }
    if let Some(misfit) = unknown.misfit_of_direction {
        let _ = writeln!(
            text,
            "misfit_urad = {:.3}  # by the same, where angles were measured: rms of a component of the tool's direction",
            misfit * 1e6
        );
    }
    if let Some(left) = observations.thermal.as_ref().and_then(|t| t.left) {
        let _ = writeln!(
            text,
            "thermal_um = {:.2}  # another warm-up or cool-down differs from [thermal] by up to this, 95 %",
            left * 1e3
        );
    }
    text
}

/// The range (mm, deg) in which the motions of an axis are known; `None` if it is that of their tables, or too narrow.
fn calibrated(
    machine: &Machine,
    probings: &Probings,
    observations: &Observations,
    identified: &Identified,
    i: usize,
) -> Option<[f64; 2]> {
    let (axis, errors) = (&machine.axes[i], &identified.errors);
    if is_tabulated(errors, i) {
        return None;
    }
    // Motions that were known before remain valid in their range.
    let is_kept = |p: &Parameter| {
        p.axis == axis.letter.char() && p.kind != ParameterKind::Inter && !is_found(identified, *p)
    };
    if errors.parameters.keys().any(is_kept) {
        return Some(outward(errors.calibrated[i].map(|q| axis.to_command(q))));
    }
    let observed = observations.rows.iter().map(|row| row.position[i]);
    let positions = probings.rows.iter().map(|row| row.position[i]);
    let positions = positions.chain(observed);
    let [low, high] = extremes(positions);
    let [low, high] = [low.max(axis.travel[0]), high.min(axis.travel[1])];
    (high - low >= NARROWEST).then(|| outward([low, high]))
}

/// A range (mm, deg) rounded to three decimals so that none of it is lost: outside it, motions that bend hold their end
/// values. What the conversion of units leaves, far below 1e-9, does not count.
fn outward([low, high]: [f64; 2]) -> [f64; 2] {
    let [low, high] = [(low * 1e3 + 1e-6).floor(), (high * 1e3 - 1e-6).ceil()];
    // No negative zero.
    [low, high].map(|end| end / 1e3 + 0.0)
}

/// True if tables alone say where the motions of an axis (by index) are known: no other of its motions holds its end
/// value.
fn is_tabulated(errors: &ErrorModel, index: usize) -> bool {
    let mut motions = errors.motions[index].iter();
    let has_table = errors.motions[index].iter().any(|m| m.table.is_some());
    has_table && motions.all(|motion| motion.table.is_some() || !motion.holds())
}

#[cfg(test)]
mod tests {
    use super::outward;

    #[test]
    fn a_range_loses_nothing_by_rounding_and_gains_less_than_a_decimal() {
        for (range, expected) in [
            ([-59.9996, 60.0004], [-60.0, 60.001]),
            ([-90.0, 90.0], [-90.0, 90.0]),
            // A degree that has been radians.
            (
                [-90.000_000_000_000_01, 90.000_000_000_000_01],
                [-90.0, 90.0],
            ),
            ([-1e-12, -0.0001], [0.0, 0.0]),
        ] {
            assert_eq!(outward(range), expected, "{range:?}");
        }
        assert!(outward([-2.0, -0.0001])[1].is_sign_positive());
    }
}
