//! The conventions of the kinematics, compared with cases computed by another program.

use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};

fn case(name: &str) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/");
    let read = |end: &str| std::fs::read_to_string(format!("{folder}{name}.{end}")).unwrap();
    let machine = Machine::from_toml(&read("machine.toml")).unwrap();
    let errors = ErrorModel::from_toml(&read("errors.toml"), &machine).unwrap();
    let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Orientation);
    let situation = Situation::default();
    let n = machine.axes.len();
    let mut worst = [0.0_f64; 2];
    let csv = read("csv");
    for line in csv.lines().skip(1) {
        let v: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        let q = machine.to_kinematic(&v[..n]);
        let correction = kinematics
            .correction(&q, &situation, &Switches::ALL)
            .unwrap();
        let dq = machine.to_command(&correction.dq);
        for i in 0..n {
            worst[0] = worst[0].max((dq[i] - v[n + i]).abs());
        }
        let twist = kinematics.volumetric_error(&q, &PerAxis::default(), &situation);
        for (e, expected) in twist.to_array().iter().zip(&v[2 * n..]) {
            worst[1] = worst[1].max((e - expected).abs());
        }
    }
    assert_eq!(csv.lines().count(), 41);
    println!(
        "{name}: corrections agree to {:.1e}, twists to {:.1e}",
        worst[0], worst[1]
    );
    assert!(
        worst[0] < 1e-9,
        "corrections differ by {:e} mm or deg",
        worst[0]
    );
    assert!(
        worst[1] < 1e-11,
        "twists differ by {:e} mm or rad",
        worst[1]
    );
}

#[test]
fn huron_with_13_errors_agrees() {
    case("huron-13");
}

#[test]
fn kolibri_with_10_errors_agrees() {
    case("kolibri-10");
}

#[test]
fn a_tilted_machine_with_an_axis_in_each_branch_agrees() {
    case("tilted-split");
}
