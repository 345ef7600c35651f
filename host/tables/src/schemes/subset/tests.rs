//! Compares the search with an exhaustive and a genetic search.

use super::candidates::Functions;
use super::remains::Remains;
use super::{remaining, search};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
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

/// A conventional genetic search: sets as bits, tournaments of three, each bit from either parent with equal
/// probability, one bit flipped on average, excess terms removed at random. Returns the best set's error and the
/// number of sets evaluated.
fn genetic(remains: &Remains, most: usize, seed: u64) -> (f64, usize) {
    const SETS: usize = 60;
    const GENERATIONS: usize = 50;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let count = remains.candidates.len();
    let repaired = |mut bits: Vec<bool>, random: &mut Pcg64Mcg| {
        loop {
            let set: Vec<usize> = (0..count).filter(|i| bits[*i]).collect();
            if search::size(remains, &set) <= most {
                return set;
            }
            bits[set[random.random_range(0..set.len())]] = false;
        }
    };
    let mut sets: Vec<Vec<usize>> = (0..SETS)
        .map(|_| {
            let bits = (0..count)
                .map(|_| random.random_range(0..count) < most)
                .collect();
            repaired(bits, &mut random)
        })
        .collect();
    let mut least = f64::INFINITY;
    for _ in 0..GENERATIONS {
        let left = parallel::map(&sets, |set| remains.left(set));
        let best = (0..SETS)
            .min_by(|a, b| left[*a].total_cmp(&left[*b]))
            .unwrap();
        least = least.min(left[best]);
        let mut next = vec![sets[best].clone()];
        while next.len() < SETS {
            let mut parent = || {
                let three = [0; 3].map(|_| random.random_range(0..SETS));
                three
                    .into_iter()
                    .min_by(|a, b| left[*a].total_cmp(&left[*b]))
                    .unwrap()
            };
            let parents = [parent(), parent()];
            let bit = |i: usize| {
                let from = &sets[parents[random.random_range(0..2)]];
                from.contains(&i) != (random.random_range(0..count) == 0)
            };
            let bits: Vec<bool> = (0..count).map(bit).collect();
            next.push(repaired(bits, &mut random));
        }
        sets = next;
    }
    (least, SETS * GENERATIONS)
}

#[test]
fn the_search_finds_the_best_of_all_sets_and_a_genetic_search_none_that_is_better() {
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
            let (theirs, looked) = genetic(&remains, most, 1);
            let um = |square: f64| format!("{:.4}", 1e3 * square.sqrt());
            let all = (most <= 5).then(|| exhaustive(&remains, most));
            let all_said = all.map_or_else(
                || "too many sets".to_owned(),
                |(least, sets)| format!("all {sets} sets {}", um(least)),
            );
            rows.push(format!(
                "{name}, {most}: {all_said}, ours {}, genetic ({looked}) {}",
                um(ours),
                um(theirs)
            ));
            // With 4 tables or fewer the search is exhaustive; 5 test its exchanges. The difference permitted is
            // rounding.
            let as_good = 1e-11 * remains.before;
            if let Some((least, _)) = all {
                assert!(ours <= least + as_good, "{}", rows.join("\n"));
            }
            assert!(theirs >= ours - as_good, "{}", rows.join("\n"));
        }
    }
    println!("{}", rows.join("\n"));
}
