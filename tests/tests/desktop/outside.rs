//! The automatic choice on machines with error motions outside every model, compared with locations and scales alone.

use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueaxis_identify::IdentifyOptions;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::MAX_AXES;
use trueaxis_tests::probed::Case;
use trueaxis_tests::{Fixed, usual_or_all};

/// Largest amplitudes of the waves of a machine (mm, rad): from about the noise of 1 µm to well above it, and of one kind
/// only.
const AMPLITUDES: [[f64; 2]; 5] = [
    [4.5e-3, 1.5e-5],
    [1.5e-3, 5e-6],
    [12e-3, 4.5e-5],
    [4.5e-3, 0.0],
    [0.0, 1.5e-5],
];
const ROWS: usize = 120;
const POSITIONS: usize = 300;

/// Adds waves of one to four periods to all six error motions of every axis.
fn add_waves(case: &mut Case, largest: [f64; 2], random: &mut Fixed) {
    for axis in 0..case.machine.axes.len() {
        let [low, high] = case.travel(axis);
        for component in 0..6 {
            let amplitude = random.within(0.0, largest[component / 3]);
            let (periods, phase) = (random.within(1.0, 4.0), random.within(0.0, TAU));
            let is_round = case.machine.axes[axis].letter.is_rotary() && high - low >= TAU;
            let periods = match is_round {
                true => periods.floor() * (high - low) / TAU,
                false => periods,
            };
            case.add_wave((axis, component), amplitude, periods, phase);
        }
    }
}

/// `None` if the balls drawn are out of reach.
fn drawn(number: usize, random: &mut Fixed) -> Option<Case> {
    let mut case = Case::of_model_12(number, ROWS, random)?;
    // Each layout has each of them.
    let largest = AMPLITUDES[number / AMPLITUDES.len() % AMPLITUDES.len()];
    add_waves(&mut case, largest, random);
    case.reached().map(|_| case)
}

/// Mean distance (mm) of the tip from where `found` puts it over the whole travel, with the zero of the workpiece set
/// there.
fn off(case: &Case, found: &ErrorModel, seed: u64) -> f64 {
    let mut random = Fixed::new(seed);
    let [truth, found] = [&case.errors, found].map(|errors| Kinematics::new(&case.machine, errors));
    let one = |_| {
        let mut q = [0.0; MAX_AXES];
        for (axis, q) in q.iter_mut().enumerate().take(case.machine.axes.len()) {
            let [low, high] = case.travel(axis);
            *q = random.within(low, high);
        }
        let situation = Situation::default();
        let tip = |machine: &Kinematics<'_>| machine.actual(&q, &situation, &Switches::ALL).t;
        tip(&truth) - tip(&found)
    };
    let all: Vec<Vector3<f64>> = (0..POSITIONS).map(one).collect();
    let zero = all.iter().sum::<Vector3<f64>>() / POSITIONS as f64;
    all.iter().map(|off| (off - zero).norm()).sum::<f64>() / POSITIONS as f64
}

#[test]
fn over_the_travel_the_choice_is_no_worse_than_locations_and_scales() {
    // Random positions and the choice of zones let means differ by a few per cent.
    const WORSE: f64 = 1.1;
    let count = usual_or_all(10, 100);
    let mut random = Fixed::new(3);
    let cases = (0..).filter_map(|number| Some((number, drawn(number, &mut random)?)));
    let mut sums = [0.0; 3];
    let mut worse = Vec::new();
    for (number, case) in cases.take(count) {
        let seed = number as u64 + 1;
        let measured = case.noisy(seed);
        let perfect = ErrorModel::perfect(&case.machine);
        let twelve = case.found("12", &measured, IdentifyOptions::default());
        let chosen = case.chosen(&measured, &Observations::default());
        let found = [&twelve, &chosen.identified]
            .map(|found| case.written(&measured, &Observations::default(), found, None));
        let all = [&perfect, &found[0], &found[1]].map(|errors| off(&case, errors, seed));
        for (sum, off) in sums.iter_mut().zip(all) {
            *sum += off / count as f64 * 1e3;
        }
        if all[2] > WORSE * all[1] {
            worse.push(format!(
                "{} {number}: {:.1} instead of {:.1} µm with {}",
                case.machine.name,
                all[2] * 1e3,
                all[1] * 1e3,
                chosen.levels[chosen.chosen].tried
            ));
        }
    }
    eprintln!(
        "mean of {count}: none {:.1}, model 12 {:.1}, auto {:.1} µm",
        sums[0], sums[1], sums[2]
    );
    assert!(worse.is_empty(), "{worse:#?}");
}
