//! Text output that several commands share.

use trueaxis_model::kinematics::Policy;
use trueaxis_model::uncertainty::OverTravel;
use trueaxis_model::validate::{Quality, Statistics, Verification};
use trueaxis_tables::compile::{AxisBounds, Proof, Size};
use trueaxis_tables::reversal::Reversal;

/// The region where tables can follow the correction.
const INSIDE: &str = "inside the ranges of the error motions";
/// The rest of the travel, where error motions keep their end values.
const OUTSIDE: &str = "outside the ranges of the error motions";

/// Effects of the tool length below this (µm per mm) are of no interest.
const LENGTH_MATTERS: f64 = 0.01;

/// Volumetric errors before and after, a line each: what most users want to know.
pub fn summary(verification: &Proof) -> String {
    let mut text = format!(
        "{:34}{:>21}{:>27}\n{:34}{:>10} {:>10}      {:>10} {:>10}\n",
        "volumetric error",
        "tool tip (µm)",
        "tool direction (µrad)",
        "",
        "mean",
        "largest",
        "mean",
        "largest"
    );
    let mut rows = |before: &str, found: &Verification| {
        for (name, quality) in [(before, &found.before), ("with the tables", &found.after)] {
            let [tip, direction] = [&quality.translation_um, &quality.direction_urad]
                .map(|s| format!("{:>10} {:>10}", number(s.mean), number(s.max)));
            text += &format!("{name:34}{tip}      {direction}\n");
        }
    };
    match (
        &verification.held,
        &verification.inside,
        &verification.outside,
    ) {
        (Some(held), ..) => rows("before, at these rotary positions", &held.found),
        (None, Some(inside), outside) if verification.partly_calibrated => {
            rows("before, inside the calibrated ranges", inside);
            if let Some(outside) = outside {
                rows("before, outside of them", outside);
            }
        }
        _ => rows("before, over the whole travel", &verification.travel),
    }
    text
}

/// Volumetric errors before and after, in each region that differs. Regions that differ by next to nothing are shown
/// as one; if only that makes the tolerance fail, a line says so.
pub fn quality(verification: &Proof, tolerance: f64) -> String {
    let mut text = String::new();
    text += &format!(
        "volumetric error{:>28}{:>34}\n",
        "translation (µm)", "tool direction (µrad)"
    );
    text += &format!("{:22}{}    {}\n", "", heads(), heads());
    if let Some(held) = &verification.held {
        let axes = held.axes.iter();
        let axes: Vec<String> = axes
            .map(|(letter, position)| format!("{letter} = {position}"))
            .collect();
        let name = format!("at {}, for which the tables are made", axes.join(", "));
        region(&mut text, &name, &held.found);
    }
    if verification.partly_calibrated {
        for (name, found) in [
            (INSIDE, &verification.inside),
            (OUTSIDE, &verification.outside),
        ] {
            if let Some(found) = found {
                region(&mut text, name, found);
            }
        }
        near_points(&mut text, verification);
        return text;
    }
    region(&mut text, "whole travel", &verification.travel);
    if let Some(inside) = &verification.inside
        && !verification.travel.meets(tolerance)
        && inside.deviations != verification.travel.deviations
    {
        text += &format!("  {INSIDE}, {}\n", difference(inside));
    }
    near_points(&mut text, verification);
    text
}

/// Positions that do not count for the tolerance, because no table that reads commands is exact there.
fn near_points(text: &mut String, verification: &Proof) {
    if let Some(near) = &verification.near_points {
        let all = near.positions
            + verification
                .inside
                .as_ref()
                .map_or(0, |found| found.positions);
        *text += &format!(
            "  within one correction of a measured point, {} of {all} positions, {}\n",
            near.positions,
            difference(near)
        );
    }
}

fn heads() -> String {
    format!("{:>9} {:>9} {:>9}", "mean", "rms", "max")
}

fn region(text: &mut String, name: &str, verification: &Verification) {
    *text += &format!("{name}, {} random positions\n", verification.positions);
    for (what, quality) in [
        ("before", &verification.before),
        ("tables", &verification.after),
        ("kinematic correction", &verification.kinematic),
    ] {
        *text += &format!("{:22}{}\n", format!("  {what}"), row(quality));
    }
    *text += &format!(
        "  tables differ from the kinematic correction {}\n",
        difference(verification)
    );
    if let Policy::Direction { .. } = verification.policy {
        let axes = verification.deviations.iter();
        let axes: Vec<String> = axes
            .map(|found| format!("{} {} {}", found.axis, number(found.deviation), found.unit))
            .collect();
        *text += &format!("    axis by axis: {}\n", axes.join(", "));
    }
}

fn difference(verification: &Verification) -> String {
    let place: Vec<String> = verification
        .worst_at
        .iter()
        .map(|q| format!("{q:.1}"))
        .collect();
    let [tip, direction] = match verification.policy {
        Policy::Direction { .. } => [" at the tip", " of direction"],
        Policy::Orientation | Policy::Position => [""; 2],
    };
    format!(
        "by at most {} µm{tip} and {} µrad{direction} (worst at {})",
        number(verification.difference_um),
        number(verification.difference_urad),
        place.join(", ")
    )
}

fn row(quality: &Quality) -> String {
    let three = |s: &Statistics| {
        format!(
            "{:>9} {:>9} {:>9}",
            number(s.mean),
            number(s.rms),
            number(s.max)
        )
    };
    format!(
        "{}    {}",
        three(&quality.translation_um),
        three(&quality.direction_urad)
    )
}

/// Four decimals below 1, fewer above.
pub fn number(value: f64) -> String {
    let digits = match value.abs() {
        v if v < 1.0 => 4,
        v if v < 100.0 => 2,
        _ => 1,
    };
    format!("{value:.digits$}")
}

/// The error that uncertain parameters and tabulated motions leave, if known.
pub fn uncertainty(found: Option<&OverTravel>) -> String {
    let Some(found) = found else {
        return String::new();
    };
    let mut text = format!(
        "95 % interval of the error from uncertain parameters, {} random positions\n",
        found.positions
    );
    let mut region = |name: &str, quality| {
        text += &format!("{name:22}{}\n", row(quality));
    };
    region("  whole travel", &found.travel);
    if let Some(inside) = &found.inside {
        region("  calibrated", inside);
    }
    if let Some(zone) = &found.zone {
        region("  probed zone", zone);
    }
    let loose = found.parameters - found.correlated;
    if loose > 0 {
        text += &format!(
            "  {loose} of {} parameters are taken as uncorrelated: no file of covariances has them\n",
            found.parameters
        );
    }
    if found.exact > 0 {
        text += &format!(
            "  {} more have no standard uncertainty, and count as exact\n",
            found.exact
        );
    }
    if found.exact_tables > 0 {
        text += &format!(
            "  {} of {} tabulated motions have no standard uncertainty, and count as exact\n",
            found.exact_tables,
            found.tables + found.exact_tables
        );
    }
    text
}

/// Tables, terms, samples, bytes.
pub fn size(size: &Size) -> String {
    let Size {
        tables,
        banks,
        terms,
        grids,
        samples,
        bytes,
        ..
    } = size;
    let grids = match grids {
        0 => String::new(),
        1 => ", 1 grid".to_owned(),
        n => format!(", {n} grids"),
    };
    format!(
        "{tables} tables in {banks} banks, {terms} terms{grids}, {samples} samples, {bytes} bytes\n"
    )
}

/// The reference of before and after, if the tables subtract the correction of a position.
pub fn zero(zero_at: Option<&str>) -> String {
    match zero_at {
        Some(position) => {
            format!("before and after are relative to the correction at {position}\n")
        }
        None => String::new(),
    }
}

/// What the rotary axes correct.
pub fn policy(policy: trueaxis::Policy) -> String {
    format!("policy: {policy}\n")
}

/// The largest correction of each axis beside its bounds.
pub fn bounds(bounds: &[AxisBounds], verified: &[f64]) -> String {
    let mut text = String::from("axis   largest correction         bound         rate bound\n");
    for (bound, verified) in bounds.iter().zip(verified) {
        let AxisBounds {
            axis,
            unit,
            largest,
            value_bound,
            rate_bound,
            ..
        } = bound;
        let largest = largest.max(*verified);
        text += &format!(
            "{axis:<6} {largest:>14.5} {unit:<3} {value_bound:>13.5} {unit:<3} {rate_bound:>10.3} {unit}/s\n"
        );
    }
    text
}

/// What each axis makes up where it reverses, and what of it a circle shows.
pub fn reversals(reversals: &[Reversal]) -> String {
    reversals
        .iter()
        .map(|reversal| format!("{reversal}\n"))
        .collect()
}

/// Where rotary corrections are largest: near positions where the tool is parallel to a rotary axis.
pub fn largest(policy: trueaxis::Policy, bounds: &[AxisBounds]) -> String {
    let trueaxis::Policy::Direction { .. } = policy else {
        return String::new();
    };
    let is_rotary = |bound: &AxisBounds| bound.unit == "deg";
    let places = bounds.iter().filter(|bound| is_rotary(bound)).map(|bound| {
        let rotary = bounds.iter().zip(&bound.at);
        let rotary = rotary.filter(|(other, _)| is_rotary(other));
        let place: Vec<String> = rotary
            .map(|(other, q)| format!("{} = {q:.1}", other.axis))
            .collect();
        format!("{} at {}", bound.axis, place.join(", "))
    });
    let places: Vec<String> = places.collect();
    if places.is_empty() {
        return String::new();
    }
    format!("largest rotary corrections: {}\n", places.join("; "))
}

/// The effect of another tool, if it matters.
pub fn tool_length(verification: &Proof) -> String {
    match verification.um_per_mm_of_tool_length {
        Some(um) if um >= LENGTH_MATTERS => format!(
            "Each mm of another tool length adds up to {} µm of error; length_range_mm in the machine file makes the length an input.\n",
            number(um)
        ),
        _ => String::new(),
    }
}
