//! The linearised model compared with central differences of the exact one: every parameter of every axis, on the
//! golden machines and on a tilted machine with three rotary axes.

use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::{Kinematics, Linearised};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_tests::{Fixed, machine};

/// Six axes, no two frames aligned, rotary axes in both branches.
const TILTED: &str = r#"
name = "tilted"
topology = "wCXBFZAYSt"
[[axis]]
name = "B"
branch = "workpiece"
origin_mm = [20.0, -31.0, 44.0]
orientation_deg = [10.0, 20.0, -30.0]
range = [-40.0, 50.0]
[[axis]]
name = "X"
branch = "workpiece"
orientation_deg = [0.0, 5.0, 8.0]
range = [-200.0, 300.0]
reversed = true
[[axis]]
name = "C"
branch = "workpiece"
origin_mm = [-12.0, 9.0, 61.0]
orientation_deg = [-7.0, 0.0, 0.0]
range = [-180.0, 180.0]
[[axis]]
name = "Z"
branch = "tool"
orientation_deg = [3.0, -4.0, 0.0]
range = [0.0, 400.0]
[[axis]]
name = "A"
branch = "tool"
origin_mm = [5.0, 6.0, 150.0]
orientation_deg = [0.0, 0.0, 15.0]
range = [-30.0, 35.0]
reversed = true
[[axis]]
name = "Y"
branch = "tool"
orientation_deg = [0.0, 12.0, 0.0]
range = [-150.0, 150.0]
[spindle]
origin_mm = [1.0, 2.0, 140.0]
orientation_deg = [20.0, 0.0, 5.0]
axis = "z"
[tool]
tip_mm = [0.0, 3.0, -90.0]
[workpiece]
origin_mm = [30.0, 20.0, 50.0]
orientation_deg = [0.0, 0.0, 25.0]
"#;

/// Inter-axis errors, degrees 0 to 3 and backlash of every axis, and the spindle's location.
fn parameters(machine: &Machine) -> Vec<Parameter> {
    let mut all = Vec::new();
    for component in 0..6 {
        all.push(Parameter {
            component,
            axis: 'S',
            kind: ParameterKind::Inter,
        });
        for axis in machine.axes.iter().map(|a| a.letter.char()) {
            let kinds = [ParameterKind::Inter, ParameterKind::Backlash];
            let degrees = (0..4).map(ParameterKind::Degree);
            for kind in kinds.into_iter().chain(degrees) {
                all.push(Parameter {
                    component,
                    axis,
                    kind,
                });
            }
        }
    }
    all
}

/// The twist per unit of a parameter, by central differences.
fn difference(
    machine: &Machine,
    parameter: Parameter,
    h: f64,
    q: &PerAxis,
    situation: &Situation,
) -> [f64; 6] {
    let twist = |value: f64| {
        let mut errors = ErrorModel::perfect(machine);
        assert!(errors.set(machine, parameter, value));
        let kinematics = Kinematics::new(machine, &errors);
        kinematics
            .volumetric_error(q, &PerAxis::default(), situation)
            .to_array()
    };
    let (plus, minus) = (twist(h), twist(-h));
    std::array::from_fn(|i| (plus[i] - minus[i]) / (2.0 * h))
}

fn compare(machine: &Machine, seed: u64) {
    let mut random = Fixed::new(seed);
    let parameters = parameters(machine);
    for _ in 0..12 {
        let q = random.position(machine);
        let mut situation = Situation::default();
        for sign in &mut situation.sign[..machine.axes.len()] {
            *sign = if random.bits() & 1 == 0 { 1.0 } else { -1.0 };
        }
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        let linearised = Linearised::new(&kinematics, &q, &situation);
        for &parameter in &parameters {
            let found = linearised.column(parameter).unwrap().to_array();
            let largest = found.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            if largest == 0.0 {
                continue;
            }
            // Chosen so that the error itself is 1e-4 mm or rad: the cubic term of a rotation is then 1e-8 / 6 of it,
            // the rounding of 1 m in f64 1e-13 / 1e-4.
            let size = match parameter.kind {
                ParameterKind::Degree(k) => q[machine.index(parameter.axis).unwrap()]
                    .powi(i32::from(k))
                    .abs(),
                _ => 1.0,
            };
            let expected = difference(machine, parameter, 1e-4 / size, &q, &situation);
            for (f, e) in found.iter().zip(expected) {
                let allowed = 1e-8 * largest.max(size);
                assert!(
                    (f - e).abs() <= allowed,
                    "{}: {parameter}: {found:?} instead of {expected:?}",
                    machine.name
                );
            }
        }
    }
}

#[test]
fn the_columns_are_the_derivatives_on_the_huron() {
    compare(&machine("tests/golden/huron-13.machine.toml"), 1);
}

#[test]
fn the_columns_are_the_derivatives_on_the_kolibri() {
    compare(&machine("tests/golden/kolibri-10.machine.toml"), 2);
}

#[test]
fn the_columns_are_the_derivatives_with_an_axis_in_each_branch() {
    compare(&machine("tests/golden/tilted-split.machine.toml"), 3);
}

#[test]
fn the_columns_are_the_derivatives_on_a_tilted_machine_of_six_axes() {
    compare(&Machine::from_toml(TILTED).unwrap(), 4);
}
