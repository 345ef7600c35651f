//! Errors that tables cannot correct, and why.

use super::words::figure;
use super::{AxisMotions, ErrorBudget, Share, Subject, Volumetric};
use trueaxis_model::kinematics::Policy;
use trueaxis_model::numbers::by;

/// Mean direction errors (µrad) below this are not mentioned.
const MATTERS: f64 = 0.1;

/// Why direction errors remain with any tables.
pub fn why(subject: &Subject<'_>) -> &'static str {
    let axes = subject.machine.axes.iter();
    match (
        axes.filter(|axis| axis.letter.is_rotary()).count(),
        subject.policy,
    ) {
        (0, _) => "the machine has no rotary axis that could turn the tool back",
        (_, Policy::Position) => "the policy `position` does not correct rotary axes",
        (1, _) => "one rotary axis can turn the tool back in one plane only",
        (_, Policy::Orientation) => {
            "the policy `orientation` weighs rotation about the tool's own axis as much as its direction"
        }
        (_, Policy::Direction { .. }) => {
            "where the tool is parallel to a rotary axis, that axis cannot change its direction, and damping keeps its corrections small around there"
        }
    }
}

/// Sentences on errors that remain with any tables.
pub fn beyond(subject: &Subject<'_>, volumetric: &Volumetric, budget: &ErrorBudget) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some(best) = &volumetric.kinematic {
        let (mean, max) = (best.direction_urad.mean, best.direction_urad.max);
        if max >= MATTERS {
            sentences.push(format!(
                "Direction errors of {} µrad remain on average, {} at most: {}.",
                figure(mean),
                figure(max),
                why(subject)
            ));
        }
        if best.translation_um.max >= 1e-3 {
            sentences.push(format!(
                "Up to {} µm remain at the tip, whatever the tables.",
                figure(best.translation_um.max)
            ));
        }
    }
    sentences.extend(least_within_reach(budget));
    if let Some(um) = volumetric.um_per_mm_of_tool_length
        && um >= 1e-3
    {
        sentences.push(format!(
            "The tables are for one tool length: each mm more or less adds up to {} µm.",
            figure(um)
        ));
    }
    if let Some(compensation) = subject.compensation
        && compensation.verification.partly_calibrated
        && let Some(outside) = &compensation.verification.outside
    {
        sentences.push(format!(
            "Outside of the calibrated ranges, where nothing was measured, the errors keep their end values. If these are right, up to {} µm remain there with the tables.",
            figure(outside.after.translation_um.max)
        ));
    }
    sentences
}

/// The parameters that leave most of their direction error to any correction.
fn least_within_reach(budget: &ErrorBudget) -> Option<String> {
    let left = |share: &Share| share.uncorrected_urad.unwrap_or(0.0);
    let worst = by(budget.shares.iter().collect(), |share| -left(share));
    let named = worst.iter().take(3).filter(|share| left(share) >= MATTERS);
    let named: Vec<String> = named
        .map(|share| {
            let all = figure(share.alone.direction_urad.mean);
            format!("{} ({} of {all} µrad)", share.name, figure(left(share)))
        })
        .collect();
    let names = named.join(", ");
    (!named.is_empty()).then(|| format!("Least within reach of the axes: {names}."))
}

/// Axes that were not fully probed, if the errors come from probings.
pub(crate) fn never_probed(axes: &[AxisMotions]) -> Option<String> {
    let parts: Vec<String> = (axes.iter())
        .filter_map(|axis| {
            let [from, to] = axis.probed?;
            let is_part = from > axis.travel[0] || to < axis.travel[1];
            let [from, to] = [from, to].map(|q| format!("{q:.1}").replace('-', "−"));
            is_part.then(|| format!("{} outside of {from} to {to} {}", axis.axis, axis.unit))
        })
        .collect();
    (!parts.is_empty()).then(|| {
        format!(
            "Never probed: {}. What was found is carried on there.",
            parts.join(", ")
        )
    })
}
