//! The examples with measured error motions equal the generator's output, and their results.

use trueaxis_model::kinematics::Policy;
use trueaxis_tables::compile::{self, Options};
use trueaxis_tests::measured::{five_axis_30, mill_21};
use trueaxis_tests::{errors, machine, read};

#[test]
fn the_measured_examples_are_what_the_generator_writes() {
    for (file, text) in [
        ("mill-21/errors-21", mill_21()),
        ("five-axis-30/errors-30", five_axis_30()),
    ] {
        assert!(
            read(&format!("examples/{file}.toml")) == text,
            "examples/{file}.toml differs: run the example measured-examples again"
        );
    }
}

#[test]
fn all_six_motions_of_every_axis_are_measured_over_the_whole_travel() {
    for (folder, number, points) in [
        ("mill-21", 21, &[('X', 51), ('Y', 61), ('Z', 81)][..]),
        (
            "five-axis-30",
            30,
            &[('X', 50), ('Y', 50), ('Z', 50), ('A', 50), ('C', 51)],
        ),
    ] {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let path = format!("examples/{folder}/errors-{number}.toml");
        let errors = errors(&path, &machine);
        let mut motions = 0;
        for &(letter, points) in points {
            let index = machine.index(letter).unwrap();
            let axis = &machine.axes[index];
            for motion in &errors.motions[index] {
                let table = motion.table.as_ref().unwrap();
                let (at, value) = (&table.at, &table.positive);
                assert_eq!(at.len(), points);
                assert_eq!(at[0], axis.to_kinematic(axis.travel[0]));
                assert_eq!(at[points - 1], axis.to_kinematic(axis.travel[1]));
                if axis.modulo {
                    assert_eq!(value[0], value[points - 1], "{letter} does not close");
                }
                motions += 1;
            }
        }
        assert_eq!(motions + errors.parameters.len(), number);
    }
}

#[test]
fn the_measured_examples_meet_their_tolerances_with_few_samples() {
    // µm, and maximum size in bytes: 8 kB for the mill at 0.05 µm and 30 kB for five axes at 1 µm are needed for
    // measured points; the rest is as stated in the manual, plus a tenth.
    for (folder, number, limits) in [
        (
            "mill-21",
            21,
            &[0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0].map(|um| (um, 8000))[..],
        ),
        (
            "five-axis-30",
            30,
            &[(0.05, 56_000), (1.0, 15_400), (5.0, 15_400)],
        ),
    ] {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let path = format!("examples/{folder}/errors-{number}.toml");
        let errors = errors(&path, &machine);
        for &(um, bytes) in limits {
            let mut options = Options {
                random: 5000,
                ..Options::default()
            };
            options.tables.policy = Policy::Orientation;
            options.tables.tolerance = um * 1e-3;
            let compiled = compile::compile(&machine, &errors, &options, &()).unwrap();
            let (built, verification) = (compiled.built, compiled.verification);
            assert!(
                verification.meets(um),
                "{folder} at {um} µm: {:?}",
                verification.inside()
            );
            assert!(
                built.size.bytes <= bytes,
                "{folder} at {um} µm: {} bytes",
                built.size.bytes
            );
        }
    }
}
