use super::super::components::first_order;
use super::super::specimen::{errors, with_rotary};
use super::super::variables::variables;
use super::*;
use trueaxis_model::kinematics::Kinematics;

const CHOICE: Choice = Choice {
    degree: 4,
    leave: 0.02,
};
const TOLERANCE: PerAxis = [5e-5, 5e-5, 5e-5, 5e-8, 5e-8, 5e-8];

#[test]
fn as_many_functions_are_leading_as_there_are() {
    let samples = DMatrix::from_fn(12, 40, |i, k| {
        let x = i as f64 / 11.0;
        libm::sin(k as f64) * x + libm::cos(k as f64) * x * x * x
    });
    let (functions, count) = leading(&samples, 1e-9);
    assert_eq!(count, 2);
    let (rest, _) = residual(&samples, &functions).unwrap();
    assert!(rest.amax() < 1e-12);
}

#[test]
fn numerical_functions_span_the_correction_between_their_nodes() {
    let machine = with_rotary(&[('C', [-20.0, 35.0])]);
    let table = "[tabulated.EXC]\nat = [-20.0, -7.0, 3.0, 35.0]\n\
            value = [1e-3, -2e-3, 4e-3, 0.0]\n[parameters]\nEBC3 = 2e-4\n";
    let errors = errors(&machine, table);
    let kinematics = Kinematics::new(&machine, &errors);
    let variables = variables(&kinematics, 1e-6);
    let sampler = Sampler::new(&kinematics, variables.clone(), PerAxis::default());
    let components = first_order(&sampler).unwrap();
    let along = Along::all(3, &components, &TOLERANCE[..4]);
    let basis = Basis::find(3, &along, &sampler, &components, &TOLERANCE, CHOICE).unwrap();
    assert!(basis.len() > basis.products.len());
    // Any position along the axis, also between nodes and beside a measured point.
    let at: Vec<f64> = (0..50).map(|i| -0.349 + 0.0191 * f64::from(i)).collect();
    let values = basis
        .values(3, &sampler, &components, &TOLERANCE, &at)
        .unwrap();
    let moving = components.iter().position(|c| c.on == 1 << 3).unwrap();
    let columns: Vec<Column> = (0..4)
        .map(|output| Column {
            component: moving,
            monomial: 1,
            node: 0,
            output,
        })
        .collect();
    let samples = sampled(&columns, 3, &sampler, &components, &TOLERANCE, &at).unwrap();
    let (rest, _) = residual(&samples, &values).unwrap();
    // At the nodes no more than the choice leaves out; between them up to the same amount again.
    assert!(rest.amax() < 2.0 * CHOICE.leave, "{}", rest.amax());
}

#[test]
fn functions_explain_samples_of_which_they_leave_little() {
    let at = |i: usize| i as f64 / 4.0 - 1.0;
    let values = DMatrix::from_fn(9, 3, |i, k| at(i).powi(k as i32));
    // The cube leaves up to 0.26 of its coefficient.
    let samples = DMatrix::from_fn(9, 2, |i, k| at(i).powi(2) + 1e-3 * k as f64 * at(i).powi(3));
    assert!(explain(&samples, &values, 1e-3));
    assert!(!explain(&samples, &values, 1e-4));
    assert!(explain(&samples.columns(0, 1).into_owned(), &values, 1e-12));
}

#[test]
fn a_sum_is_no_larger_than_its_parts() {
    let machine = with_rotary(&[]);
    let errors = errors(&machine, "");
    let variables = variables(&Kinematics::new(&machine, &errors), 1e-6);
    let basis = Basis::of_lever(&variables[0]);
    assert_eq!(basis.peak_of(&[1.0, -0.5, 0.0]), 1.5);
    assert_eq!(basis.peak_of(&[1.0, 0.0, -1.0]), 0.0);
}
