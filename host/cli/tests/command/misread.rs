//! Readings of instruments that are another quantity than declared, copied, or against what was stated beforehand.

use crate::identify::probings;
use crate::observations::observations;
use crate::program::{Folder, example, plain, trueaxis};

/// The observations with one column of the rows of a set-up changed, and the answer of `identify` to them: exit code,
/// output and warnings.
fn with(setup: &str, column: &str, change: &dyn Fn(f64, f64) -> f64) -> (i32, String) {
    let folder = Folder::new();
    let observed = std::fs::read_to_string(observations(&folder, &[])).unwrap();
    let mut places: Option<[usize; 3]> = None;
    let changed: String = (observed.lines())
        .map(|line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if line.starts_with("kind") {
                let place = |name: &str| cells.iter().position(|cell| cell == name).unwrap();
                places = Some(["setup", column, "X"].map(place));
            } else if let Some([own, value, x]) = places
                && cells[own] == setup
            {
                let [read, x]: [f64; 2] = [value, x].map(|k| cells[k].parse().unwrap());
                cells[value] = format!("{:.9}", change(read, x));
            }
            cells.join(",") + "\n"
        })
        .collect();
    identified(&folder, &changed)
}

/// The answer to a file of observations, beside probings.
fn identified(folder: &Folder, observed: &str) -> (i32, String) {
    let probed = probings(folder, &[]);
    let file = folder.file("changed.csv", observed);
    let machine = example("kolibri/machine.toml");
    let output = trueaxis(&["identify", &machine, &probed, "--observations", &file]);
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    (output.status.code().unwrap(), plain(&said))
}

fn named(what: &str, (code, said): (i32, String), parts: &[&str]) {
    assert_eq!(code, 1, "{what}: {said}");
    for part in parts {
        assert!(said.contains(part), "{what}: `{part}` is not in\n{said}");
    }
}

#[test]
fn readings_as_they_are_contradict_nothing_and_show_the_deviation_of_each_prior() {
    let (code, said) = with("bar", "length_mm", &|read, _| read);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("stated as 0.0000 ± 0.0005 (|z| = "), "{said}");
    for word in ["z = ", "look ", "equal to the last digit"] {
        assert!(!said.replace("|z| = ", "").contains(word), "`{word}` in\n{said}");
    }
}

#[test]
fn lengths_in_another_unit_are_named() {
    for (factor, unit) in [(1.0 / 25.4, "inches"), (1e-3, "metres"), (1e3, "µm")] {
        let found = with("bar", "length_mm", &|read, _| read * factor);
        named(unit, found, &[&format!("the readings of bar fit if they are in {unit}")]);
    }
}

#[test]
fn deviations_in_place_of_lengths_are_named_and_so_is_another_dead_length() {
    let found = with("bar", "length_mm", &|read, _| read - 100.0);
    let parts = ["the readings of bar fit if they are deviations of a length of 100.0"];
    named("deviations", found, &parts);
    let found = with("bar", "length_mm", &|read, _| read - 30.0);
    let parts = ["the readings of bar fit with a dead length of 30.0"];
    named("without its extension", found, &parts);
}

#[test]
fn positions_in_place_of_deviations_are_named() {
    for (factor, unit) in [(1.0, "mm"), (1e3, "µm")] {
        let found = with("laser", "displacement_um", &|read, x| factor * (x + 1e-3 * read));
        let said = format!("the readings of laser fit if they are positions in {unit}");
        named(unit, found, &[&said]);
    }
}

#[test]
fn displacements_in_another_unit_or_sense_are_named() {
    let found = with("laser", "displacement_um", &|read, _| -read);
    named("sign", found, &["the readings of laser look as if they count the other way"]);
    let found = with("laser", "displacement_um", &|read, _| read / 1e3);
    named("mm", found, &["the readings of laser look to be in mm instead of µm"]);
}

#[test]
fn a_stated_dead_length_that_other_readings_contradict_is_named() {
    let found = with("bar", "length_mm", &|read, _| read - 0.05);
    let parts = [
        "bar: the dead length was stated as 0.0000 ± 0.0005 mm (standard uncertainty)",
        "z = ",
        "chance gives among 1 stated values with a probability of",
    ];
    named("dead length", found, &parts);
}

#[test]
fn copied_rows_are_named() {
    let folder = Folder::new();
    let observed = std::fs::read_to_string(observations(&folder, &[])).unwrap();
    let copies: Vec<&str> = (observed.lines())
        .filter(|line| line.starts_with("displacement,laser"))
        .collect();
    let (_, said) = identified(&folder, &(observed.clone() + &copies.join("\n") + "\n"));
    assert!(said.contains("equal to the last digit"), "{said}");
    // A repeated measurement is no copy.
    let (_, said) = identified(&folder, &observed);
    assert!(!said.contains("equal to the last digit"), "{said}");
}
