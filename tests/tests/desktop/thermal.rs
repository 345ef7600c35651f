//! Thermal terms: from temperatures and points of a machine with finite-difference temperature fields to the servo.

use trueaxis::{Inputs, Servo};
use trueaxis_identify::FoundChange;
use trueaxis_identify::formats::{observations, temperatures};
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_tables::compile::{Options, build};
use trueaxis_tests::golden::load;
use trueaxis_tests::thermal_field::SENSORS;
use trueaxis_tests::thermal_goal::{
    Measurement, learnt, learnt_from, machine, measured, reached, tip,
};
use trueaxis_tests::usual_or_all;

/// The measurement of the goal with half the points, for the usual tests.
const SHORT: Measurement = Measurement {
    every: 600.0,
    log: 30.0,
    seed: 7,
    ..Measurement::EIGHT_HOURS
};

#[test]
fn four_sensors_and_eight_hours_leave_less_than_a_fifth_of_the_drift_of_other_duty_cycles() {
    let whole = |seed| Measurement {
        seed,
        ..Measurement::EIGHT_HOURS
    };
    let usual = vec![(SHORT, 4)];
    let whole = (1..=5).map(|seed| (whole(seed), 20));
    let all = usual.iter().copied().chain(whole).collect();
    for (measurement, count) in usual_or_all(usual, all) {
        let found = reached(&measurement, count);
        let sensors = &found.sensors;
        assert!(found.hours <= 8.0 && sensors.len() <= 4, "{sensors:?}");
        let (without, with) = (found.without.rms, found.with.rms);
        assert!(
            without > 5.0 && with < 0.2 * without,
            "{with} of {without} µm"
        );
        assert!(found.covered >= 0.95, "{}", found.covered);
        // The cabinet has nothing to do with the machine.
        assert!(!sensors.contains(&"cabinet".to_owned()));
    }
}

#[test]
fn a_machine_that_does_not_move_with_temperature_gets_no_terms() {
    let machine = machine();
    for seed in [1, 2, 3] {
        let still = Measurement {
            effect: 0.0,
            seed,
            ..SHORT
        };
        let (identified, warmed, text) = learnt(&machine, &measured(&machine, &still));
        assert!(warmed.model.terms.is_empty(), "{:?}", warmed.model.terms);
        assert!(identified.thermal.is_empty() && !text.contains("[thermal]"));
        assert!(!warmed.dropped.is_empty());
    }
}

#[test]
fn coefficients_and_lags_that_the_model_contains_are_found_within_their_uncertainties() {
    let machine = machine();
    let still = Measurement {
        effect: 0.0,
        ..SHORT
    };
    let files = measured(&machine, &still);
    let log = temperatures::read(&files.temperatures).unwrap();
    let mut observations = observations::read(&files.points, "points.csv", &machine).unwrap();
    let text = "machine = \"Mill that warms up\"\n[thermal]\n\
        EZ0S = { per_kelvin = -3e-3, sensor = \"bearing\", lag_s = 1500.0, reference_celsius = 21.0 }\n\
        EXX1 = { per_kelvin = 8e-6, sensor = \"bed\", reference_celsius = 21.0 }\n";
    let warm = ErrorModel::from_toml(text, &machine).unwrap();
    let kelvin: Vec<Vec<f64>> = (warm.sensors.iter())
        .map(|input| {
            let sensor = log.sensors.iter().position(|s| *s == input.sensor).unwrap();
            log.kelvin(sensor, input.reference_celsius, input.lag)
        })
        .collect();
    for row in &mut observations.rows {
        let mut situation = Situation::default();
        for (k, values) in situation.kelvin.iter_mut().zip(&kelvin) {
            *k = log.at(values, row.time.unwrap()).unwrap();
        }
        let place = [0, 1, 2].map(|i| row.position[i]);
        let [hot, cold] =
            [situation, Situation::default()].map(|s| tip(&machine, &warm, &place, &s));
        row.value += hot - cold;
    }
    let (identified, warmed, _) = learnt_from(&machine, observations, &log).unwrap();
    let found = |name: &str, sensor: &str| {
        let is_it = |c: &&FoundChange| {
            let input = &warmed.model.inputs[c.input];
            c.parameter.to_string() == name && input.sensor == sensor
        };
        let change = identified.thermal.iter().find(is_it).unwrap();
        (
            *change,
            &warmed.model.inputs[change.input],
            warmed.lag_uncertainty[change.input],
        )
    };
    let (growth, input, of_lag) = found("EZ0S", "bearing");
    let of_lag = of_lag.unwrap();
    // Four standard uncertainties: chance exceeds them once in 16 000.
    assert!(
        (input.lag / 1500.0).ln().abs() < 4.0 * of_lag && of_lag < 0.05,
        "{input:?} {of_lag}"
    );
    // The lag is uncertain, and the growth with it.
    let u = growth.uncertainty.hypot(3e-3 * of_lag);
    assert!(
        (growth.per_kelvin + 3e-3).abs() < 4.0 * u && u < 1e-4,
        "{growth:?}"
    );
    let (scale, input, _) = found("EXX1", "bed");
    assert_eq!(input.lag, 0.0);
    let u = scale.uncertainty;
    assert!(
        (scale.per_kelvin - 8e-6).abs() < 4.0 * u && u < 1e-6,
        "{scale:?}"
    );
    assert!(
        warmed.left_out[1] < 0.7e-3 && warmed.left_out[0] > 5e-3,
        "{:?}",
        warmed.left_out
    );
}

#[test]
fn the_servo_follows_the_exact_correction_with_all_lags_through_a_warm_up() {
    let machine = machine();
    let (identified, ..) = learnt(&machine, &measured(&machine, &SHORT));
    let errors: &ErrorModel = &identified.errors;
    assert!(errors.sensors.iter().any(|s| s.lag > 0.0));
    let compiled = build(&machine, errors, &Options::default(), &()).unwrap();
    let compensation = load(&compiled.blob);
    let names: Vec<&str> = compensation
        .auxiliaries()
        .iter()
        .map(|a| a.name.as_str())
        .collect();
    let mut servo = Servo::new(&*compensation);
    servo.enable();
    let kinematics = Kinematics::new(&machine, errors);
    let place = [120.0, -80.0, -200.0];
    let letters: Vec<char> = machine.axes.iter().map(|a| a.letter.char()).collect();
    let mut inputs = Inputs::at([0.0; 16]);
    for (axis, q) in compensation.axes().iter().zip(&mut inputs.axes) {
        let k = letters
            .iter()
            .position(|l| *l == char::from(axis.name))
            .unwrap();
        *q = place[k] as f32;
    }
    // Exact first-order lags of a temperature that rises steadily for an hour from the reference.
    let rate = [1e-3, 8e-4, 3e-4, 1e-3, 2e-4, 0.0];
    for step in 0..=360_000_u32 {
        let time = f64::from(step) * 0.01;
        for (value, name) in inputs.auxiliaries.iter_mut().zip(&names) {
            let sensor = SENSORS.iter().position(|s| s == name).unwrap();
            *value = (rate[sensor] * time) as f32;
        }
        let correction = servo.update(&inputs, u16::MAX, 0.01);
        if step % 30_000 == 0 && step > 0 {
            let mut situation = Situation::default();
            for (kelvin, input) in situation.kelvin.iter_mut().zip(&errors.sensors) {
                let sensor = SENSORS.iter().position(|s| *s == input.sensor).unwrap();
                let late = match input.lag {
                    0.0 => 0.0,
                    tau => tau * (1.0 - (-time / tau).exp()),
                };
                let [low, high] = input.range_kelvin;
                *kelvin = (rate[sensor] * (time - late)).clamp(low, high);
            }
            let q = machine.to_kinematic(&place);
            let exact = kinematics
                .correction(&q, &situation, &Switches::ALL)
                .unwrap();
            let exact = machine.to_command(&exact.dq);
            for (k, axis) in compensation.axes().iter().enumerate() {
                let own = letters
                    .iter()
                    .position(|l| *l == char::from(axis.name))
                    .unwrap();
                let off = (f64::from(correction.dq[k]) - exact[own]).abs();
                // The tolerance of the tables is 0.05 µm, f32 adds 0.01 µm.
                assert!(off < 6e-5, "{time} s: {off}");
            }
        }
    }
}
