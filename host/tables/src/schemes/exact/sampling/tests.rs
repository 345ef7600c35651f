use super::super::components::{Joint, first_order, second_order};
use super::super::specimen::{errors, with_rotary};
use super::super::variables::{MAX_VARIABLES, variables};
use super::*;

const RICH: &str = "[parameters]\nEYX2 = 2e-7\nECX1 = 1e-6\nEAY3 = 1e-12\nEXYb = 2e-3\n\
        EB0A = 50e-6\nEZA2 = 5e-3\nEXCc2 = 4e-3\nEXX1 = 3e-5\n";

#[test]
fn what_is_filled_in_is_what_is_sampled_one_by_one() {
    let machine = with_rotary(&[('A', [-60.0, 60.0]), ('C', [-180.0, 180.0])]);
    let change = "per_kelvin = 1e-8, sensor = \"bed\", reference_celsius = 20.0";
    let warm = format!("{RICH}[thermal]\nEYX2 = {{ {change} }}\nEC0A = {{ {change} }}\n");
    let errors = errors(&machine, &warm);
    let kinematics = Kinematics::new(&machine, &errors);
    let variables = variables(&kinematics, 1e-6);
    let zero = [1e-3, -2e-3, 3e-3, 1e-5, -2e-5, 0.0];
    let sampler = Sampler::new(&kinematics, variables.clone(), zero);
    let mut components = first_order(&sampler).unwrap();
    assert_eq!(components.iter().filter(|c| c.even).count(), 2);
    components
        .extend(second_order(&sampler, &Joint::default(), &[1e-6; MAX_AXES], 600_000).unwrap());
    assert!(components.len() > 6);
    for component in &components {
        for monomial in 0..component.monomials.len() {
            for node in (0..component.nodes()).step_by(component.nodes() / 7 + 1) {
                let place = component.place(node);
                let one = sampler
                    .coefficients(component, &[monomial], &place)
                    .unwrap()[0];
                let filled = component.values[monomial * component.nodes() + node];
                for (one, filled) in one.iter().zip(filled) {
                    // The iteration for samples ends at 5e-11; this is a second difference of three of them,
                    // times four subsets.
                    assert!((one - filled).abs() < 5e-9, "{one} and {filled}");
                }
            }
        }
    }
}

#[test]
fn the_parts_add_up_to_the_whole() {
    let machine = with_rotary(&[('A', [-60.0, 60.0])]);
    let errors = errors(
        &machine,
        "[parameters]\nEYX2 = 2e-7\nEAY3 = 1e-12\nEB0A = 50e-6\n",
    );
    let kinematics = Kinematics::new(&machine, &errors);
    let variables = variables(&kinematics, 1e-6);
    let sampler = Sampler::new(&kinematics, variables.clone(), PerAxis::default());
    let switches = (0..variables.len()).filter(|v| variables[*v].is_switch());
    let all: u32 = switches.map(|v| 1 << v).sum();
    let mut place = [0.0; MAX_VARIABLES];
    place[..4].copy_from_slice(&[120.0, -80.0, 45.0, 0.7]);
    let mut sum = PerAxis::default();
    for on in 0..=all {
        if on & !all == 0 {
            for (s, a) in sum.iter_mut().zip(sampler.added(&place, on).unwrap()) {
                *s += a;
            }
        }
    }
    let whole = sampler.exact(&place, all).unwrap();
    for (s, w) in sum.iter().zip(whole) {
        assert!((s - w).abs() < 1e-12);
    }
}
