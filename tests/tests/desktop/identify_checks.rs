//! Diagnostics of an identification from faulty probings.

use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueaxis_identify::formats::artefact::ArtefactBar;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_identify::{
    Checked, Honesty, IdentifyError, IdentifyOptions, Model, Problem, TrendAlong, honesty,
    identify, snoop,
};
use trueaxis_model::errors::{Covariance, ErrorModel, Parameter, ParameterKind};
use trueaxis_tests::probed::Case;
use trueaxis_tests::usual_or_all;

fn bar(case: &Case, [a, b]: [usize; 2], longer: f64) -> ArtefactBar {
    ArtefactBar {
        balls: [a, b].map(|i| case.artefact.balls[i].name.clone()),
        length: (case.ball(a) - case.ball(b)).norm() + longer,
        uncertainty: 1e-3,
    }
}

#[test]
fn uncertainties_that_cannot_be_are_an_error_and_no_hang() {
    let case = Case::new("kolibri", "errors-10.toml");
    let tried = |sigma: f64| {
        let mut measured = case.noisy(1);
        for row in &mut measured.rows {
            row.sigma = Some(1e-3);
        }
        measured.rows[0].sigma = Some(sigma);
        case.tried("10", &measured, IdentifyOptions::default())
    };
    for sigma in [1e-303, f64::NAN] {
        assert_eq!(
            tried(sigma).err(),
            Some(IdentifyError::NotFinite),
            "{sigma}"
        );
    }
    // Without the ignored row there is one row fewer.
    let without = tried(1e300).unwrap();
    assert!((without.noise - 1e-3).abs() < 1e-4, "{}", without.noise);
}

#[test]
fn parameters_that_the_machine_cannot_have_are_an_error_and_none_of_a_model() {
    let case = Case::new("kolibri", "errors-10.toml");
    let perfect = ErrorModel::perfect(&case.machine);
    // Its step would never move anything.
    let ninth = Parameter {
        component: 0,
        axis: 'C',
        kind: ParameterKind::Cosine(9),
    };
    let measured = case.noisy(1);
    let problem = Problem::new(&case.machine, &measured, &case.artefact, &[ninth], &perfect);
    let error = identify(&problem, IdentifyOptions::default()).unwrap_err();
    assert_eq!(error, IdentifyError::NoSuchParameter { parameter: ninth });
    for degree in 0..=20 {
        let all = Model::Auto.parameters(&case.machine, degree, &[]).unwrap();
        let mut machine = perfect.clone();
        let is_known = |p: &Parameter| machine.set(&case.machine, *p, 0.0);
        assert!(all.iter().all(is_known), "{degree}");
    }
}

#[test]
fn a_bar_whose_balls_are_in_one_place_is_an_error() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    case.artefact.bars.push(bar(&case, [0, 1], 0.0));
    case.artefact.balls[1].nominal = case.artefact.balls[0].nominal;
    let error = case
        .tried("10", &measured, IdentifyOptions::default())
        .unwrap_err();
    assert!(matches!(error, IdentifyError::SamePlace { .. }), "{error}");
}

#[test]
fn positions_in_metres_or_inches_are_told_by_what_is_known() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    for with_bar in [false, true] {
        if with_bar {
            case.artefact.bars.push(bar(&case, [0, 2], 0.0));
        }
        for (unit, mm) in [("metres", 1000.0), ("inches", 25.4)] {
            let mut other = measured.clone();
            for row in &mut other.rows {
                for (position, axis) in row.position.iter_mut().zip(&case.machine.axes) {
                    *position /= if axis.letter.is_rotary() { 1.0 } else { mm };
                }
            }
            let error = case
                .tried("10", &other, IdentifyOptions::default())
                .unwrap_err();
            let message = error.to_string();
            assert!(
                message.contains(unit) && error.remedy().contains("mm"),
                "{message}"
            );
        }
        assert!(
            case.tried("10", &measured, IdentifyOptions::default())
                .is_ok()
        );
    }
}

#[test]
fn a_wrong_bar_is_named_if_others_tell() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    let all = "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EXX1,EYY1,EZZ1";
    for ends in [[0, 1], [0, 2], [1, 3], [2, 3]] {
        let longer = if ends == [1, 3] { 0.02 } else { 0.0 };
        case.artefact.bars.push(bar(&case, ends, longer));
    }
    let identified = case.found(all, &measured, IdentifyOptions::default());
    let sizes: Vec<f64> = (identified.bars.iter())
        .map(|bar| bar.others.unwrap().normalised.abs())
        .collect();
    // It distorts the others, but is the worst.
    assert!(identified.bars[2].is_doubtful(), "{:?}", identified.bars);
    assert!(
        sizes
            .iter()
            .enumerate()
            .all(|(i, s)| i == 2 || *s < sizes[2]),
        "{sizes:?}"
    );
    // The others determine its actual length, to four standard uncertainties.
    let others = identified.bars[2].others.unwrap();
    let off = others.length - (case.ball(1) - case.ball(3)).norm();
    assert!(off.abs() < 4.0 * others.uncertainty, "{off} {others:?}");
    // Correct ones are not doubted.
    case.artefact.bars.remove(2);
    let identified = case.found(all, &measured, IdentifyOptions::default());
    assert!(
        identified
            .bars
            .iter()
            .all(|bar| bar.others.is_some() && !bar.is_doubtful())
    );
    // A single one defines the scales.
    case.artefact.bars.truncate(1);
    let identified = case.found(all, &measured, IdentifyOptions::default());
    assert!(identified.bars[0].others.is_none(), "{:?}", identified.bars);
    // But if no scale is identified, the machine reveals it.
    case.artefact.bars[0].length += 0.02;
    match case.tried("10", &measured, IdentifyOptions::default()) {
        Ok(identified) => assert!(identified.bars[0].is_doubtful(), "{:?}", identified.bars),
        Err(error) => assert!(matches!(error, IdentifyError::Bars { .. }), "{error}"),
    }
}

#[test]
fn a_bar_of_another_length_altogether_is_an_error() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    case.artefact.bars.push(bar(&case, [0, 1], 30.0));
    let error = case
        .tried("10", &measured, IdentifyOptions::default())
        .unwrap_err();
    assert!(matches!(error, IdentifyError::Bars { .. }), "{error}");
    assert!(error.to_string().contains("1 to 2 is"), "{error}");
}

fn honest(case: &Case, measured: &Probings, model: &str) -> Honesty {
    let identified = case.found(model, measured, IdentifyOptions::default());
    let perfect = ErrorModel::perfect(&case.machine);
    let parameters = &identified.looked_for;
    let problem = Problem::new(
        &case.machine,
        measured,
        &case.artefact,
        parameters,
        &perfect,
    );
    honesty(&problem, measured, &identified)
}

fn checks(case: &Case, measured: &Probings, model: &str) -> Vec<Checked> {
    honest(case, measured, model).checks
}

/// Visits the balls in turn, so that drift does not resemble a displaced ball.
fn in_turn(case: &mut Case) {
    let rows = case.plan.rows.clone();
    let quarter = rows.len() / 4;
    case.plan.rows = (0..rows.len())
        .map(|k| rows[k % 4 * quarter + k / 4].clone())
        .collect();
}

#[test]
fn drift_is_estimated_with_its_uncertainty_where_balls_repeat() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    in_turn(&mut case);
    let mut squares = 0.0;
    for seed in 0..20 {
        let drift = [8e-3, 0.0, -5e-3];
        let mut measured = case.measured(&Disturbances {
            noise: 1e-3,
            drift,
            seed,
            ..Disturbances::default()
        });
        for (k, row) in measured.rows.iter_mut().enumerate() {
            row.time = Some(60.0 * k as f64);
        }
        let found = checks(&case, &measured, "10")[0];
        assert_eq!(found.along, TrendAlong::Time(60.0 * 167.0));
        let trend = found.trend.unwrap();
        assert!(found.warning().unwrap().contains("drifts"), "{trend:?}");
        let off = trend.change - Vector3::from(drift);
        squares += off.component_div(&trend.uncertainty).norm_squared() / 60.0;
    }
    // 60 squares, each 1 with a standard deviation of √2: 0.18 for their mean, times four.
    assert!((0.27..1.73).contains(&squares), "{squares}");
    // Without drift it stays within chance in all but one of a thousand cases: none of 20.
    let is_significant = |seed| {
        checks(&case, &case.noisy(seed), "10")[0]
            .warning()
            .is_some()
    };
    assert_eq!((0..20).filter(|seed| is_significant(*seed)).count(), 0);
}

#[test]
fn neighbouring_rows_are_alike_where_the_machine_drifts_to_and_fro() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    in_turn(&mut case);
    // Whether rows are alike, and whether that or a trend is said.
    let said = |measured: &Probings| {
        let found = honest(&case, measured, "10");
        let trend = found.checks.iter().any(|check| check.warning().is_some());
        (
            found.alike.is_some(),
            trend || found.alike_warning().is_some(),
        )
    };
    let linear: Vec<usize> = "XYZ"
        .chars()
        .filter_map(|l| case.machine.index(l))
        .collect();
    let rows = case.plan.rows.len() as f64;
    let mut false_alarms = 0;
    for seed in 0..20 {
        false_alarms += u32::from(said(&case.noisy(seed)).0);
        // A hall whose temperature is regulated: 2 µm to and fro, a little more than three times.
        let mut measured = case.noisy(seed);
        for (k, row) in measured.rows.iter_mut().enumerate() {
            for axis in &linear {
                let phase = seed as f64 + *axis as f64;
                row.position[*axis] += 2e-3 * libm::sin(TAU * 3.3 * k as f64 / rows + phase);
            }
        }
        assert!(said(&measured).1, "{seed}");
    }
    // Chance gives one in a thousand: two of twenty, once in five thousand times.
    assert!(false_alarms < 2, "{false_alarms}");
}

#[test]
fn a_stated_noise_that_is_too_large_hides_no_misfit() {
    let case = Case::new("kolibri", "errors-10.toml");
    for (sigma, least) in [(1e-3, 0.0), (3e-3, 0.9e-3)] {
        let mut measured = case.noisy(1);
        for row in &mut measured.rows {
            row.sigma = Some(sigma);
        }
        let identified = case.found("10", &measured, IdentifyOptions::default());
        let written = case.written(&measured, &Observations::default(), &identified, None);
        // All of the 1 µm of residuals, as if nothing were stated; what is stated rightly leaves little of it.
        let misfit = written.misfit.unwrap();
        assert!((least..1.1e-3).contains(&misfit), "{sigma}: {misfit}");
        assert!(least > 0.0 || misfit < 0.5e-3, "{sigma}: {misfit}");
    }
}

#[test]
fn temperature_runs_and_directions_are_looked_at() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let backlash = Parameter::parse("EAAb").unwrap();
    assert!(case.errors.set(&case.machine, backlash, 30e-6));
    let a = case.machine.index('A').unwrap();
    for (k, row) in case.plan.rows.iter_mut().enumerate() {
        row.direction[a] = if k % 3 == 0 { -1.0 } else { 1.0 };
        row.run = Some((k % 2) as f64);
        row.temperature = Some(20.0 + (k % 5) as f64);
    }
    let mut measured = case.noisy(1);
    let x = case.machine.index('X').unwrap();
    for row in &mut measured.rows {
        // The whole artefact moved between the runs, if C stands still.
        row.position[x] += 5e-3 * row.run.unwrap();
    }
    let found = checks(&case, &measured, "10");
    let kinds: Vec<TrendAlong> = found.iter().map(|c| c.along).collect();
    let expected = [
        TrendAlong::Order,
        TrendAlong::Temperature(4.0),
        TrendAlong::Run(1.0),
        TrendAlong::Direction('A'),
    ];
    assert_eq!(kinds, expected);
    assert!(found[1].warning().is_none(), "{:?}", found[1]);
    assert!(
        found[3].warning().unwrap().contains("add its backlash"),
        "{:?}",
        found[3]
    );
    // With the backlash in the model it disappears.
    let model = "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EYY1,EZZ1,EAAb";
    let found = checks(&case, &case.noisy(1), model);
    assert!(found.iter().all(|c| c.warning().is_none()), "{found:?}");
}

#[test]
fn what_repeats_is_less_than_what_is_left_if_the_model_lacks_something() {
    let mut case = Case::new("kolibri", "errors-12.toml");
    for (k, row) in case.plan.rows.clone().into_iter().enumerate() {
        if k % 4 == 0 {
            case.plan.rows.push(row);
        }
    }
    let bend = Parameter::parse("EZX2").unwrap();
    for (size, is_less) in [(0.0, false), (2e-6, true)] {
        assert!(case.errors.set(&case.machine, bend, size));
        let measured = case.noisy(3);
        let found = honest(&case, &measured, "10");
        let repeats = found.repeats.unwrap();
        assert_eq!((repeats.places, repeats.freedom), (42, 126));
        // A standard deviation with 126 degrees of freedom is known to 6 %: four times that.
        assert!((repeats.deviation - 1e-3).abs() < 0.25e-3, "{repeats:?}");
        assert_eq!(repeats.is_less, is_less, "{repeats:?}");
    }
}

#[test]
fn balls_that_were_left_out_are_predicted_as_well_as_noise_lets_them() {
    let case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    let none = Observations::default();
    let found = case
        .held_out(&measured, &none, &case.parameters("10"))
        .unwrap();
    assert_eq!(found.balls.len(), 4);
    // √3 µm of noise, and little more for the uncertainty of the machine.
    assert!((1.6e-3..2.0e-3).contains(&found.rms), "{found:?}");
}

#[test]
fn what_was_known_before_makes_what_is_found_with_it_uncertain() {
    // EXX1 is known in advance, but not accurately: relative scales follow it.
    let case = Case::new("kolibri", "errors-10.toml");
    let measured = case.noisy(1);
    let scale = Parameter::parse("EXX1").unwrap();
    let mut base = ErrorModel::perfect(&case.machine);
    assert!(base.set(&case.machine, scale, 0.0));
    base.standard_uncertainty.insert(scale, 1e-5);
    let parameters = case.parameters("10");
    let problem = Problem::new(&case.machine, &measured, &case.artefact, &parameters, &base);
    let identified = identify(&problem, IdentifyOptions::default()).unwrap();
    let free = case.found("10", &measured, IdentifyOptions::default());
    assert_eq!(identified.known.parameters.len(), 11);
    let place = |name: &str| {
        let parameter = Parameter::parse(name).unwrap();
        let all = &identified.known.parameters;
        all.iter().position(|p| *p == parameter).unwrap()
    };
    let Covariance { matrix, .. } = &identified.known;
    for (found, alone) in identified.parameters.iter().zip(&free.parameters) {
        let name = found.parameter.to_string();
        let is_scale = ["EYY1", "EZZ1"].contains(&name.as_str());
        let both = alone.uncertainty.hypot(if is_scale { 1e-5 } else { 0.0 });
        // Scales change by the same amount as EXX1, to within the size of the errors.
        assert!((found.uncertainty / both - 1.0).abs() < 0.01, "{name}");
        if is_scale {
            let covariance = matrix[(place(&name), place("EXX1"))];
            assert!(
                (covariance / 1e-10 - 1.0).abs() < 0.01,
                "{name}: {covariance}"
            );
        }
    }
    // As if EXX1 were found to be larger by this amount.
    assert!(base.set(&case.machine, scale, 1e-5));
    let problem = Problem::new(&case.machine, &measured, &case.artefact, &parameters, &base);
    let moved = identify(&problem, IdentifyOptions::default()).unwrap();
    for (moved, found) in moved.parameters.iter().zip(&identified.parameters) {
        let place = place(&moved.parameter.to_string());
        let expected = matrix[(place, 10)] / 1e-10 * 1e-5;
        let off = moved.value - found.value - expected;
        // A hundredth of their uncertainty.
        assert!(
            off.abs() < 0.01 * found.uncertainty,
            "{}: {off}",
            moved.parameter
        );
    }
}

#[test]
fn good_probings_are_hardly_ever_outliers() {
    let perfect = |case: &Case| ErrorModel::perfect(&case.machine);
    let mut alarms = 0;
    let share = usual_or_all(5, 1);
    for (folder, errors, model, seeds) in [
        ("kolibri", "errors-10.toml", "10", 200),
        ("hu40", "errors-13.toml", "13", 100),
        ("kolibri", "errors-81.toml", "81", 50),
    ] {
        let case = Case::new(folder, errors);
        let (parameters, perfect) = (case.parameters(model), perfect(&case));
        for seed in 0..seeds / share {
            let measured = case.noisy(seed);
            let problem = Problem::new(
                &case.machine,
                &measured,
                &case.artefact,
                &parameters,
                &perfect,
            );
            let found = identify(&problem, IdentifyOptions::default()).unwrap();
            alarms += usize::from(!snoop(&problem, &found).is_empty());
        }
    }
    // One file in a thousand: the probability of more than one in 70 is 1 in 400, of more than three in 350 1 in 2000.
    assert!(alarms <= usual_or_all(1, 3), "{alarms}");
    println!("{alarms} alarms");
}
