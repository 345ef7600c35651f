//! Identification on machines with known errors.

use trueaxis_identify::formats::artefact::ArtefactBar;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_identify::{Chosen, Fit, Identified, IdentifyOptions, Level};
use trueaxis_model::errors::Parameter;
use trueaxis_tests::probed::Case;

#[test]
fn the_order_of_rows_does_not_matter() {
    let case = Case::new("hu40", "errors-13.toml");
    let measured = case.noisy(0);
    // As a file with its lines in another order, so that the balls appear in another order too.
    let text = probings::write(&measured, &case.machine);
    let (header, rows) = text.split_once('\n').unwrap();
    let mut rows: Vec<&str> = rows.lines().rev().collect();
    rows.swap(3, 50);
    rows.rotate_left(20);
    let other = format!("{header}\n{}\n", rows.join("\n"));
    let [measured, other] =
        [&text, &other].map(|t| probings::read(t, &case.machine, true).unwrap());
    assert_ne!(measured.balls, other.balls);
    let one = case.found("13", &measured, IdentifyOptions::default());
    let other = case.found("13", &other, IdentifyOptions::default());
    assert_eq!(one.parameters, other.parameters);
    assert_eq!((one.noise, one.condition), (other.noise, other.condition));
}

#[test]
fn outliers_are_named_and_count_little() {
    let case = Case::new("kolibri", "errors-10.toml");
    let clean = Disturbances {
        noise: 1e-3,
        seed: 5,
        ..Disturbances::default()
    };
    let options = IdentifyOptions {
        robust: true,
        ..IdentifyOptions::default()
    };
    let expected = case.found("10", &case.measured(&clean), IdentifyOptions::default());
    let dirty = Disturbances {
        outliers: 0.05,
        outlier: 0.1,
        ..clean
    };
    let (measured, good) = (case.measured(&dirty), case.measured(&clean));
    let identified = case.found("10", &measured, options);
    let mut wrong = 0;
    for ((row, found), clean) in measured.rows.iter().zip(&identified.rows).zip(&good.rows) {
        let is_wrong = row.position != clean.position;
        wrong += usize::from(is_wrong);
        assert_eq!(found.is_trusted, !is_wrong, "line {}", row.line);
    }
    assert!((4..15).contains(&wrong), "{wrong}");
    for (found, clean) in identified.parameters.iter().zip(&expected.parameters) {
        let off = (found.value - clean.value).abs();
        assert!(
            off < 2.0 * clean.uncertainty,
            "{}: {off} {}",
            found.parameter,
            clean.uncertainty
        );
    }
}

#[test]
fn what_cannot_be_seen_is_said() {
    let case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(0);
    let all =
        "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EXX1,EYY1,EZZ1,EX0S,EZ0S,EZ0C,EC0S,ECCb,EA0A,EC0Y";
    let identified = case.found(all, &measured, IdentifyOptions::default());
    let mut found: Vec<String> = identified.unseen.iter().map(|u| u.sentence()).collect();
    found.sort();
    let mut expected = vec![
        "EXX1 and EYY1, EZZ1 differ by a common scale only: there is no length reference (a bar in the artefact), so they are relative to EXX1".to_owned(),
        "EX0S cannot be distinguished from the stylus' x: index the spindle; if it cannot be oriented, zero the stylus for run-out and state x_mm and y_mm with their standard uncertainties under [stylus] in the artefact".to_owned(),
        "EZ0S cannot be distinguished from the stylus' z: give the length of the stylus with its uncertainty (length_standard_uncertainty_mm in the artefact)".to_owned(),
        "EZ0C cannot be distinguished from the balls' locations".to_owned(),
        "EC0S does nothing at these positions".to_owned(),
        "ECCb is not known: no row says from which direction the axis came (a column such as A_dir)".to_owned(),
        "EA0A cannot be distinguished from EA0C".to_owned(),
        "EC0Y cannot be distinguished from EC0X".to_owned(),
    ];
    expected.sort();
    assert_eq!(found, expected);
    assert_eq!(identified.parameters.len(), 10);
    for e in &identified.parameters {
        let off = (e.value - case.truth(e.parameter)) / e.uncertainty;
        assert!(off.abs() < 4.0, "{}: {off}", e.parameter);
    }
}

#[test]
fn a_bar_makes_scales_absolute() {
    let case = Case::new("hu40", "errors-13.toml");
    let measured = case.noisy(0);
    let scale = |identified: &Identified| {
        let all = identified
            .parameters
            .iter()
            .map(|e| e.parameter.to_string());
        all.filter(|name| name == "EXX1").count()
    };
    assert_eq!(
        scale(&case.found("13", &measured, IdentifyOptions::default())),
        1
    );
    let mut without = Case::new("hu40", "errors-13.toml");
    without.artefact.bars.clear();
    assert_eq!(
        scale(&without.found("13", &measured, IdentifyOptions::default())),
        0
    );
}

fn fit(level: &Level) -> &Fit {
    level.found.as_ref().unwrap()
}

fn chosen(case: &Case) -> Chosen {
    case.chosen(&case.noisy(0), &Observations::default())
}

#[test]
fn the_automatic_model_has_the_motions_that_predict_other_positions_and_no_others() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let found = chosen(&case);
    assert_eq!((found.chosen, found.identified.parameters.len()), (0, 10));
    // Every motion up to degree 1 fits these rows better, but others worse.
    let [fewest, degree_1] = [0, 2].map(|i| fit(&found.levels[i]));
    assert!(degree_1.left < fewest.left && degree_1.elsewhere > fewest.elsewhere);
    let curved = [("EZX2", 4e-6), ("EXCc2", 0.02), ("EYY2", -3e-6)];
    for (name, value) in curved {
        let parameter = Parameter::parse(name).unwrap();
        assert!(case.errors.set(&case.machine, parameter, value));
    }
    let found = chosen(&case);
    let names = found.identified.parameters.iter();
    let names: Vec<String> = names.map(|e| e.parameter.to_string()).collect();
    for (name, _) in curved {
        assert!(names.contains(&name.to_owned()), "{name}: {names:?}");
    }
    // Ten as before, three coefficients, and at most what comes with them: a sine and two degrees.
    assert!(names.len() <= 16, "{names:?}");
}

#[test]
fn bars_that_are_known_far_better_than_the_probe_repeats_do_no_harm() {
    let mut case = Case::new("kolibri", "errors-81.toml");
    let ball = |i: usize| case.artefact.balls[i].nominal.unwrap();
    let bars = [(0, 1), (0, 2), (1, 3), (2, 3)].map(|(a, b)| ArtefactBar {
        balls: [a, b].map(|i| case.artefact.balls[i].name.clone()),
        length: (ball(a) - ball(b)).norm(),
        uncertainty: 1e-5,
    });
    case.artefact.bars.extend(bars);
    let measured = case.noisy(0);
    let identified = case.found("81", &measured, IdentifyOptions::default());
    assert_eq!(identified.parameters.len(), 79);
    // 1 µm, to a twentieth: with 400 degrees of freedom it is known to 3.5 %.
    assert!(
        (identified.noise - 1e-3).abs() < 5e-5,
        "{}",
        identified.noise
    );
}

#[test]
fn a_row_of_another_ball_is_named() {
    let case = Case::new("kolibri", "errors-10.toml");
    let mut measured = case.noisy(0);
    let clean = case.found("10", &measured, IdentifyOptions::default());
    let own = measured.balls[measured.rows[130].ball].clone();
    measured.rows[130].ball = 1;
    let identified = case.found(
        "10",
        &measured,
        IdentifyOptions {
            robust: true,
            ..IdentifyOptions::default()
        },
    );
    for (number, row) in identified.rows.iter().enumerate() {
        assert_eq!(row.is_trusted, number != 130);
    }
    for (found, clean) in identified.parameters.iter().zip(&clean.parameters) {
        // One row fewer of 168.
        let off = (found.value - clean.value).abs();
        assert!(off < 0.5 * clean.uncertainty, "{}", found.parameter);
    }
    // By default it names the row and returns no parameters.
    let error = case
        .tried("10", &measured, IdentifyOptions::default())
        .unwrap_err();
    let line = measured.rows[130].line;
    assert!(
        error
            .to_string()
            .contains(&format!("line {line} looks like a probing of ball {own}")),
        "{error}"
    );
}
