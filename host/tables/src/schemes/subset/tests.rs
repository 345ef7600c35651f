//! Compares the search with an exhaustive one.

use super::candidates::Functions;
use super::remains::Remains;
use super::{remaining, search};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::Machine;
use trueaxis_model::parallel;

/// An example, by its name and that of its errors.
macro_rules! example {
    ($machine:literal, $errors:literal) => {{
        let machine = include_str!(concat!(
            "../../../../../examples/",
            $machine,
            "/machine.toml"
        ));
        let errors = include_str!(concat!(
            "../../../../../examples/",
            $machine,
            "/",
            $errors,
            ".toml"
        ));
        let machine = Machine::from_toml(machine).unwrap();
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        (machine, errors)
    }};
}

fn remains((machine, errors): &(Machine, ErrorModel), policy: Policy) -> Remains {
    let kinematics = Kinematics::new(machine, errors).with_policy(policy);
    remaining(&kinematics, &Functions::new(&kinematics)).unwrap()
}

/// The best of all sets with at most `most` tables, and their number.
fn exhaustive(remains: &Remains, most: usize) -> (f64, usize) {
    let sets = search::all(remains, most, usize::MAX).unwrap();
    let left = parallel::map(&sets, |set| remains.left(set));
    (left.into_iter().fold(f64::INFINITY, f64::min), sets.len())
}

#[test]
fn the_search_finds_the_best_of_all_sets() {
    let direction = Policy::default();
    let mut rows = Vec::new();
    for (name, example, policy) in [
        (
            "Kolibri",
            example!("kolibri", "errors-10"),
            Policy::Orientation,
        ),
        (
            "Kolibri, direction",
            example!("kolibri", "errors-10"),
            direction,
        ),
        (
            "Huron",
            example!("huron-k2x8", "errors-13"),
            Policy::Orientation,
        ),
        ("fork head", example!("fork-head", "errors-13"), direction),
        (
            "table and head",
            example!("table-head", "errors-13"),
            direction,
        ),
    ] {
        let remains = remains(&example, policy);
        for most in [1, 2, 3, 4, 5, 10] {
            let chosen = search::best(&remains, most);
            assert!(search::size(&remains, &chosen) <= most);
            let ours = remains.left(&chosen);
            let um = |square: f64| format!("{:.4}", 1e3 * square.sqrt());
            rows.push(format!("{name}, {most}: {}", um(ours)));
            // With 4 tables or fewer the search is exhaustive; 5 test its exchanges. The difference permitted is
            // rounding.
            if most <= 5 {
                let (least, sets) = exhaustive(&remains, most);
                let said = format!("best of all {sets} sets {}\n{}", um(least), rows.join("\n"));
                assert!(ours <= least + 1e-11 * remains.before, "{said}");
            }
        }
    }
    println!("{}", rows.join("\n"));
}
