//! The linearised model compared with central differences of the exact one: every parameter of every axis, on the
//! golden machines and on random ones.

use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::{Kinematics, Linearised};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_tests::{Fixed, machine, random_machines};

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
fn the_columns_are_the_derivatives() {
    for (name, seed) in [("huron-13", 1), ("kolibri-10", 2), ("tilted-split", 3)] {
        compare(&machine(&format!("tests/golden/{name}.machine.toml")), seed);
    }
    // Up to six axes in any order, rotary ones tilted, in both branches.
    for case in random_machines::cases(10) {
        compare(&case.machine, case.seed);
    }
}
