//! Thermal terms: from temperatures and points of a machine with finite-difference temperature fields to the servo.

use trueaxis::{Inputs, Servo};
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_tables::compile::{Options, build};
use trueaxis_tests::golden::load;
use trueaxis_tests::thermal_field::SENSORS;
use trueaxis_tests::thermal_goal::{Measurement, learnt, machine, measured, reached};
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
    let found = reached(&SHORT, 4);
    assert!(
        found.hours <= 8.0 && found.sensors.len() <= 4,
        "{:?}",
        found.sensors
    );
    let (without, with) = (found.without.rms, found.with.rms);
    assert!(
        without > 5.0 && with < 0.2 * without,
        "{with} of {without} µm"
    );
    assert!(found.covered >= 0.95, "{}", found.covered);
    // The cabinet has nothing to do with the machine.
    assert!(!found.sensors.contains(&"cabinet".to_owned()));
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
