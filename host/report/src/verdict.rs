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
mod tests {
    use super::*;

    const WHY: &str = "no axis turns the tool";

    fn quality(tip: f64, direction: f64) -> Quality {
        let all = |v: f64| Statistics {
            mean: v,
            rms: v,
            p95: v,
            max: 2.0 * v,
        };
        Quality {
            translation_um: all(tip),
            direction_urad: all(direction),
        }
    }

    fn share(name: &str, words: &str, tip: f64, direction: f64) -> Share {
        Share {
            name: name.to_owned(),
            words: words.to_owned(),
            value: None,
            standard_uncertainty: None,
            alone: quality(tip, direction),
            expanded_uncertainty_mean_um: None,
            expanded_uncertainty_max_um: None,
            expanded_uncertainty_mean_urad: None,
            expanded_uncertainty_max_urad: None,
            uncorrected_urad: None,
        }
    }

    fn volumetric(before: Quality, after: Option<Quality>) -> Volumetric {
        Volumetric {
            positions: 1,
            before,
            after,
            kinematic: None,
            difference_um: None,
            difference_urad: None,
            meets_tolerance: None,
            um_per_mm_of_tool_length: None,
            known: after.map(|_| super::super::ErrorKnowledge {
                coverage: quality(2.06, 4.0),
                at_most: quality(3.0, 6.0),
                is_of_zone: false,
                after: None,
                is_direction_measured: true,
                uncertain: 1,
                exact: 0,
            }),
        }
    }

    /// A machine of which all was seen.
    fn none() -> ErrorModel {
        let text = include_str!("../../../examples/huron-k2x8/machine.toml");
        let machine = trueaxis_model::machine::Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        errors.misfit = Some(0.0);
        errors.misfit_of_direction = Some(0.0);
        errors
    }

    #[test]
    fn where_nothing_was_measured_in_space_no_figure_is_a_limit() {
        let mut errors = none();
        errors.misfit = None;
        let found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 1.7)));
        let said = sentences(&found, &[], &errors, WHY);
        assert!(!said.concat().contains("no more than"), "{said:?}");
        let last = said.last().unwrap();
        assert!(
            last.starts_with("Errors that are not in the error file"),
            "{said:?}"
        );
        // Where no figure includes an uncertainty, none is an interval.
        let without = volumetric(quality(66.2, 89.0), None);
        let said = sentences(&without, &[], &errors, WHY).concat();
        assert!(!said.contains("not in the error file"), "{said}");
    }

    #[test]
    fn where_something_was_not_seen_no_figure_is_a_limit() {
        use trueaxis_model::errors::Parameter;
        let mut errors = none();
        for (name, um) in [("EX0C", 20.0), ("EXX1", 4.0)] {
            errors.unseen.insert(Parameter::parse(name).unwrap(), um);
        }
        let found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 1.7)));
        let said = sentences(&found, &[], &errors, WHY);
        assert!(
            said[0].starts_with(
                "With these tables the measured errors put the tip off by about 3.1 µm"
            ),
            "{said:?}"
        );
        assert!(!said.concat().contains("no more than"), "{said:?}");
        assert_eq!(
            said[3],
            "Not measured, and not in these figures: EX0C, EXX1. 10 µm of EX0C alone moves the tip by 20 µm over the \
             travel; the error file names a measurement for each."
        );
    }

    #[test]
    fn a_direction_that_was_not_measured_is_apart() {
        let mut errors = none();
        errors.misfit = Some(1e-3);
        errors.misfit_of_direction = None;
        let mut found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 1.7)));
        let known = found.known.as_mut().unwrap();
        known.is_direction_measured = false;
        let said = sentences(&found, &[], &errors, WHY);
        assert!(said[2].ends_with("known to ±2.1 µm (95 %)."), "{said:?}");
        assert!(
            said[0].ends_with(
                " 6.1 µm at the worst (each with 95 % probability, over the travel). This includes the uncertainty of the \
                 parameters, and the remaining error of the tables, but no errors that vary between the measured positions. The tool direction was not measured: the errors of the \
                 model turn it by up to 7.7, 7.7 and 16 µrad; other errors are unknown."
            ),
            "{said:?}"
        );
        errors.misfit_of_direction = Some(1e-6);
        found.known.as_mut().unwrap().is_direction_measured = true;
        let said = sentences(&found, &[], &errors, WHY);
        assert!(
            said[0].contains("at the worst, and the tool direction by 7.7"),
            "{said:?}"
        );
    }

    #[test]
    fn the_largest_at_the_tip_is_named_and_the_effect_of_the_tables() {
        let shares = [
            share("EZ0S", "the spindle's Z position", 55.6, 0.0),
            share("EA0Z", "the inclination of axis Z about X", 21.0, 106.0),
        ];
        let found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 1.7)));
        assert_eq!(
            sentences(&found, &shares, &none(), WHY),
            [
                "With these tables the tip is off by no more than about 3.1 µm on average, 3.1 µm at 95 % of positions \
                 and 6.1 µm at the worst, and the tool direction by 7.7, 7.7 and 16 µrad (each with 95 % probability, over \
                 the travel). This includes the uncertainty of the parameters, and the remaining error of the tables, but no \
                 errors that vary between the measured positions.",
                "The spindle's Z position (EZ0S) causes 56 of 66 µm on average.",
                "With exact parameters, the tables reduce the tip error from 66 to 0.05 µm and the direction error \
                 from 89 to 1.7 µrad (means). The parameters are known to ±2.1 µm and ±4.0 µrad (95 %).",
            ]
        );
    }

    #[test]
    fn errors_that_count_as_exact_are_counted_and_errors_without_uncertainties_named() {
        let mut found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 1.7)));
        if let Some(known) = &mut found.known {
            known.exact = 2;
        }
        let said = sentences(&found, &[], &none(), WHY);
        assert!(
            said[0].contains("the parameters, of which 2 of 3 count as exact, and"),
            "{said:?}"
        );
        found.known = None;
        let said = sentences(&found, &[], &none(), WHY);
        assert!(
            said[0].starts_with(
                "If the errors are as entered, the tables reduce the tip error from 66 to 0.05 µm"
            ) && said[0].ends_with("(means). The errors have no uncertainties."),
            "{said:?}"
        );
        found.after = None;
        let said = sentences(&found, &[], &none(), WHY);
        assert_eq!(
            said[0],
            "Without tables the machine is off by 66 µm and 89 µrad on average over the travel."
        );
    }

    #[test]
    fn errors_that_take_each_other_away_and_those_of_direction_alone_are_told_as_such() {
        let shares = [share("EX0S", "the spindle's X position", 100.0, 0.0)];
        let found = sentences(&volumetric(quality(82.0, 0.0), None), &shares, &none(), WHY);
        assert_eq!(
            found[1],
            "The spindle's X position (EX0S) by itself would cause 100 µm on average; together with the others it is 82 µm."
        );
        let shares = [share(
            "EA0S",
            "the spindle's inclination about X",
            0.0,
            30.0,
        )];
        let found = sentences(&volumetric(quality(0.0, 30.0), None), &shares, &none(), WHY);
        assert_eq!(
            found[1],
            "The spindle's inclination about X (EA0S) causes 30 of 30 µrad of the tool's direction on average."
        );
    }

    #[test]
    fn without_a_kinematic_correction_nothing_is_said_of_tables() {
        let mut found = volumetric(quality(66.2, 89.0), None);
        found.known = None;
        assert_eq!(
            sentences(&found, &[], &none(), WHY)[2],
            "The effect of tables is unknown: some positions have no kinematic correction. The errors have no uncertainties."
        );
    }

    #[test]
    fn direction_errors_that_no_table_can_correct_are_named_as_such() {
        let mut found = volumetric(quality(66.2, 89.0), Some(quality(0.05, 89.0)));
        found.known = None;
        found.kinematic = Some(quality(0.0, 89.0));
        assert_eq!(
            sentences(&found, &[], &none(), WHY)[0],
            "If the errors are as entered, the tables reduce the tip error from 66 to 0.05 µm (means); 89 µrad of \
             direction error remain with any tables: no axis turns the tool. The errors have no uncertainties."
        );
        found.after = Some(quality(0.05, 1.75));
        found.kinematic = Some(quality(0.0, 1.7));
        assert!(sentences(&found, &[], &none(), WHY)[0].contains(
            "from 89 to 1.8 µrad (means); 1.7 µrad of direction error remain with any tables: no axis turns the tool"
        ));
        // Direction errors alone, and no axis to correct them.
        let mut found = volumetric(quality(0.0, 89.0), Some(quality(0.0, 89.0)));
        found.known = None;
        found.kinematic = Some(quality(0.0, 89.0));
        assert!(sentences(&found, &[], &none(), WHY)[0].starts_with(
            "89 µrad of direction error remain with any tables: no axis turns the tool."
        ));
    }

    #[test]
    fn a_machine_without_known_errors_has_a_verdict() {
        let found = sentences(&volumetric(quality(0.0, 0.0), None), &[], &none(), WHY);
        assert_eq!(
            found,
            ["No error of this machine is known: there is nothing to correct."]
        );
        let shares = [share("EX0X", "the X position of axis X", 0.0, 0.0)];
        let found = sentences(&volumetric(quality(0.0, 0.0), None), &shares, &none(), WHY);
        assert_eq!(
            found,
            ["The errors that are known change nothing at the tool."]
        );
    }
}
