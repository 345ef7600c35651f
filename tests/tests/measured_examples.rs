//! The examples with measured error motions are those that the generator makes, and what they say.

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
