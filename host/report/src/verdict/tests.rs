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
    let text = include_str!("../../../../examples/huron-k2x8/machine.toml");
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
        said[0]
            .starts_with("With these tables the measured errors put the tip off by about 3.1 µm"),
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
    assert!(
        sentences(&found, &[], &none(), WHY)[0].starts_with(
            "89 µrad of direction error remain with any tables: no axis turns the tool."
        )
    );
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
