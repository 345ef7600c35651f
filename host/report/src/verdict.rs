//! The summary at the top of a report.

use super::words::{capital, figure, rounded_up, sensible};
use super::{ErrorKnowledge, Share, Volumetric};
use trueaxis_model::errors::{ErrorModel, ParameterKind};
use trueaxis_model::numbers::by;
use trueaxis_model::validate::{Quality, Statistics};

/// Mean errors below this (µm, µrad) count as zero.
const NOTHING: f64 = 5e-5;
/// A single error differs from the whole by other random positions only.
const ROUNDING: f64 = 0.02;
/// The smallest share of the direction error that rotary axes must be able to correct, so that it counts as corrected.
const REACHED: f64 = 0.01;
/// Mean direction errors (µrad) beyond the reach of the axes that are worth a word.
const REMAINS: f64 = 0.1;

/// The verdict, one sentence each: the expected error of the machine, its main cause, and the effect of the tables.
/// Figures are means over the travel unless they say otherwise.
/// `why` is the reason for which direction errors remain with any tables.
pub fn sentences(
    volumetric: &Volumetric,
    shares: &[Share],
    errors: &ErrorModel,
    why: &str,
) -> Vec<String> {
    let before = &volumetric.before;
    if is_nothing(before) && shares.is_empty() {
        return vec!["No error of this machine is known: there is nothing to correct.".to_owned()];
    }
    if is_nothing(before) {
        return vec!["The errors that are known change nothing at the tool.".to_owned()];
    }
    let mut all = match expected(volumetric, errors) {
        Some(expected) => vec![expected, cause(before, shares), remaining(volumetric, why)],
        None => vec![remaining(volumetric, why), cause(before, shares)],
    };
    all.extend(unseen(errors).or_else(|| beyond_the_file(volumetric, errors)));
    all
}

/// Most errors that the sentence names.
const NAMED: usize = 4;

/// The parameters that the measurements could not show.
fn unseen(errors: &ErrorModel) -> Option<String> {
    let all = by(errors.unseen.iter().collect(), |(_, um)| -**um);
    let (most, um) = all.first()?;
    let names: Vec<String> = all.iter().take(NAMED).map(|(p, _)| p.to_string()).collect();
    let more = match all.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let unit = match (most.is_angular(), most.kind) {
        (true, _) => "10 µrad",
        (_, ParameterKind::Degree(1)) => "10 µm/m",
        _ => "10 µm",
    };
    Some(format!(
        "Not measured, and not in these figures: {}{more}. {unit} of {most} alone moves the tip by {} µm over the travel; the error file names a measurement for each.",
        names.join(", "),
        figure(**um)
    ))
}

/// What figures that include uncertainties do not include if nothing measured the tip in space.
fn beyond_the_file(volumetric: &Volumetric, errors: &ErrorModel) -> Option<String> {
    let is_expected = volumetric.known.is_some() && volumetric.after.is_some();
    (is_expected && errors.misfit.is_none()).then(|| {
        "Errors that are not in the error file are not in these figures: it states no misfit, which the tip shows when it is \
         measured in space."
            .to_owned()
    })
}

/// The expected error; with tables, their remaining error plus the effect of uncertain parameters, which must be known.
fn expected(volumetric: &Volumetric, errors: &ErrorModel) -> Option<String> {
    let Some(after) = &volumetric.after else {
        return Some(format!(
            "Without tables the machine is off by {} on average over the travel.",
            means(&volumetric.before)
        ));
    };
    let known = volumetric.known.as_ref()?;
    let most = known.with_tables(after);
    let [mean, p95, largest] = most_of(&most.translation_um);
    let [of_mean, of_p95, of_largest] = most_of(&most.direction_urad);
    let of_direction = format!("{of_mean}, {of_p95} and {of_largest} µrad");
    // Balls show how errors outside the model move the tip, not how they turn the tool.
    let (and_direction, direction) = match errors.is_direction_measured() {
        true => (
            format!(", and the tool direction by {of_direction}"),
            String::new(),
        ),
        false => (
            String::new(),
            format!(
                " The tool direction was not measured: the errors of the model turn it by up to {of_direction}; other errors are unknown."
            ),
        ),
    };
    let how_far = match errors.bounds_the_tip() {
        true => "the tip is off by no more than about",
        false => "the measured errors put the tip off by about",
    };
    let between = match errors.bounds_the_tip() {
        true => ", but no errors that vary between the measured positions",
        false => "",
    };
    let exact = match known.exact {
        0 => String::new(),
        n => format!(", of which {n} of {} count as exact", n + known.uncertain),
    };
    Some(format!(
        "With these tables {how_far} {mean} µm on average, {p95} µm at 95 % of positions and {largest} µm at the worst{and_direction} (each with 95 % probability, over the {}). This includes the uncertainty of the parameters{exact}, and the remaining error of the tables{between}.{direction}",
        zone(known)
    ))
}

/// Mean, 95 % of positions and largest, rounded up.
fn most_of(statistics: &Statistics) -> [String; 3] {
    [statistics.mean, statistics.p95, statistics.max].map(rounded_up)
}

/// The zone of an interval.
fn zone(known: &ErrorKnowledge) -> &'static str {
    match known.is_of_zone {
        true => "probed zone; outside of it, errors beyond the model are unknown",
        false => "travel",
    }
}

/// The means for tip and direction.
fn means(quality: &Quality) -> String {
    format!(
        "{} µm and {} µrad",
        figure(quality.translation_um.mean),
        figure(quality.direction_urad.mean)
    )
}

fn is_nothing(quality: &Quality) -> bool {
    quality.translation_um.max < NOTHING && quality.direction_urad.max < NOTHING
}

/// The parameter that causes most of the error and its share: at the tip, or of the direction if there is none at
/// the tip.
fn cause(before: &Quality, shares: &[Share]) -> String {
    let at_tip = before.translation_um.mean >= NOTHING;
    let mean = |quality: &Quality| match at_tip {
        true => quality.translation_um.mean,
        false => quality.direction_urad.mean,
    };
    let unit = match at_tip {
        true => "µm",
        false => "µrad of the tool's direction",
    };
    let most = shares.iter().max_by(|a, b| {
        let (a, b) = (mean(&a.alone), mean(&b.alone));
        a.total_cmp(&b)
    });
    let all = mean(before);
    match most {
        None => format!("The error is {} {unit} on average.", figure(all)),
        Some(most) => {
            let (words, name) = (capital(&most.words), &most.name);
            let alone = mean(&most.alone);
            match alone <= all * (1.0 + ROUNDING) {
                true => format!(
                    "{words} ({name}) causes {} of {} {unit} on average.",
                    figure(alone),
                    figure(all)
                ),
                false => format!(
                    "{words} ({name}) by itself would cause {} {unit} on average; together with the others it is {} {unit}.",
                    figure(alone),
                    figure(all)
                ),
            }
        }
    }
}

/// The error that remains with a correction if the errors are as entered, and how well they are known.
fn remaining(volumetric: &Volumetric, why: &str) -> String {
    let remaining = match (&volumetric.after, &volumetric.kinematic) {
        (Some(after), _) => with(volumetric, after, "the tables reduce", why),
        (None, Some(best)) => with(volumetric, best, "the best tables would reduce", why),
        (None, None) => {
            "The effect of tables is unknown: some positions have no kinematic correction"
                .to_owned()
        }
    };
    match &volumetric.known {
        Some(known) => format!(
            "{remaining}. The parameters are known to ±{} µm{} (95 %{}).",
            figure(known.coverage.translation_um.mean),
            // The interval of a direction that was not measured lacks the misfit.
            match known.is_direction_measured {
                true => format!(" and ±{} µrad", figure(known.coverage.direction_urad.mean)),
                false => String::new(),
            },
            match known.is_of_zone {
                true => ", in the probed zone, with the misfit of the model",
                false => "",
            }
        ),
        None => format!("{remaining}. The errors have no uncertainties."),
    }
}

/// The effect of a correction on the mean errors, apart from what no correction with these axes can change.
fn with(volumetric: &Volumetric, after: &Quality, reduce: &str, why: &str) -> String {
    let before = &volumetric.before;
    let mut parts = Vec::new();
    if before.translation_um.max >= NOTHING {
        parts.push(format!(
            "the tip error from {} to {} µm",
            figure(before.translation_um.mean),
            sensible(after.translation_um.mean)
        ));
    }
    let [was, is] = [before, after].map(|quality| quality.direction_urad.mean);
    let best = volumetric.kinematic.as_ref();
    let best = best.map_or(0.0, |quality| quality.direction_urad.mean);
    let is_reached = best < was * (1.0 - REACHED);
    if before.direction_urad.max >= NOTHING && is_reached {
        parts.push(format!(
            "the direction error from {} to {} µrad",
            figure(was),
            figure(is)
        ));
    }
    let remains = (best >= REMAINS && best > is / 2.0).then(|| {
        format!(
            "{} µrad of direction error remain with any tables: {why}",
            figure(best)
        )
    });
    if parts.is_empty() {
        return remains.unwrap_or_else(|| "No table changes these errors".to_owned());
    }
    format!(
        "{}, {reduce} {} (means){}",
        match volumetric.known {
            Some(_) => "With exact parameters",
            None => "If the errors are as entered",
        },
        parts.join(" and "),
        remains.map_or_else(String::new, |remains| format!("; {remains}"))
    )
}

/// The drift that the thermal model does not predict, if it is known.
pub fn thermal(errors: &ErrorModel) -> Option<String> {
    let left = errors.thermal_left?;
    Some(format!(
        "In addition, drift with temperature stays within ± {} µm in each direction (in 95 % of other warm-ups or cool-downs).",
        figure(left * 1e3)
    ))
}

#[cfg(test)]
mod tests;
