//! The effect of `--zero-at`: the same reference before and after, and a part that is set up at another rotary
//! position.

use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::prove;
use trueaxis_tables::schemes::{self, Options, Scheme};
use trueaxis_tests::{errors, machine, read};

fn kolibri() -> (Machine, ErrorModel) {
    let machine = machine("examples/kolibri/machine.toml");
    let errors = errors("examples/kolibri/errors-10.toml", &machine);
    (machine, errors)
}

fn zero(machine: &Machine, errors: &ErrorModel) -> PerAxis {
    let options = Options {
        // Y, A, C, X, Z.
        zero_at: Some(vec![0.0, 0.0, 0.0, 0.0, 74.0]),
        ..Options::default()
    };
    options.zero(machine, errors).unwrap()
}

#[test]
fn tables_of_zeros_show_the_same_before_and_after() {
    let (machine, errors) = kolibri();
    let perfect = ErrorModel::perfect(&machine);
    let found = schemes::find(&machine, &perfect, &Scheme::default(), &Options::default()).unwrap();
    let mut draft = found.draft;
    for axis in &mut draft.axes {
        (axis.value_bound, axis.rate_bound, axis.ramp_rate) = (1.0, 1.0, 1.0);
    }
    let blob = draft.encode().unwrap();
    let runtime = Runtime::load(&blob).unwrap();
    let zero = zero(&machine, &errors);
    assert!(zero.iter().any(|z| z.abs() > 1e-3));
    let verification = prove(&machine, &errors, &runtime, &zero, 500, 1, &()).unwrap();
    assert_eq!(verification.travel.before, verification.travel.after);
    assert!(verification.travel.before.translation_um.mean > 10.0);
}

/// Error (µm) at a rotary position of C (deg) of a part set up at another, with its tip at the centre of the table and
/// `left_out` omitted from all corrections.
fn off(picked_up: f64, machined: f64, left_out: &PerAxis) -> f64 {
    let (machine, errors) = kolibri();
    let kinematics = Kinematics::new(&machine, &errors);
    let situation = Situation::default();
    let tip = |c: f64| {
        let q = machine.to_kinematic(&[0.0, 0.0, c, 0.0, 74.0]);
        let dq = kinematics
            .correction(&q, &situation, &Switches::ALL)
            .unwrap()
            .dq;
        let corrected = std::array::from_fn(|i| q[i] + dq[i] - left_out[i]);
        let actual = kinematics.actual(&corrected, &situation, &Switches::ALL);
        actual.t - kinematics.nominal(&q, None).t
    };
    let off: Vector3<f64> = tip(machined) - tip(picked_up);
    off.norm() * 1e3
}

#[test]
fn a_part_that_is_turned_from_where_it_was_picked_up_is_off_by_what_is_left_out() {
    let (machine, errors) = kolibri();
    let zero = zero(&machine, &errors);
    let text = read("docs/src/compile-output.md");
    let row = |name: &str, c: f64, left_out: &PerAxis| {
        let [a, b] = [0.0, 180.0].map(|machined| off(c, machined, left_out));
        let row = format!("| {name} | {a:.1} µm | {b:.1} µm |");
        assert!(
            text.lines().any(|line| line == row),
            "the manual does not show {row}"
        );
    };
    row("with `--zero-at`, picked up at A = 0, C = 0", 0.0, &zero);
    row(
        "with `--zero-at`, picked up at A = 0, C = 180",
        180.0,
        &zero,
    );
    for c in [0.0, 180.0] {
        row("without, picked up at either", c, &[0.0; 6]);
    }
}
