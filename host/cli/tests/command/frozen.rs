//! Files of version 0.1 (`tests/frozen/0.1`) are still read, and give what they gave then.

use crate::program::{Folder, answer, refused};
use std::collections::BTreeMap;

fn frozen(name: &str) -> String {
    format!(
        "{}/../../tests/frozen/0.1/{name}",
        env!("CARGO_MANIFEST_DIR")
    )
}

/// The numbers of a table under its header line.
fn numbers(csv: &str) -> (&str, Vec<Vec<f64>>) {
    let mut lines = csv.lines();
    let header = lines.next().unwrap();
    let row = |line: &str| line.split(',').map(|n| n.parse().unwrap()).collect();
    (header, lines.map(row).collect())
}

/// What the command prints is the frozen table, up to this difference.
fn gives(arguments: &[&str], table: &str, tolerance: f64) {
    let (now, was) = (
        answer(0, arguments),
        std::fs::read_to_string(frozen(table)).unwrap(),
    );
    let ((header, now), (then, was)) = (numbers(&now), numbers(&was));
    assert_eq!(header, then);
    assert_eq!((now.len(), was.len()), (24, 24));
    for (now, was) in now.iter().flatten().zip(was.iter().flatten()) {
        assert!((now - was).abs() <= tolerance, "{now} in place of {was}");
    }
}

#[test]
fn a_blob_of_version_0_1_gives_the_same_corrections() {
    let (blob, positions) = (frozen("machine.trax"), frozen("positions.csv"));
    let eval = ["eval", &blob, "--positions", &positions];
    // Whatever computes them: the same bits.
    gives(&eval, "corrections.csv", 0.0);
}

#[test]
fn files_of_version_0_1_describe_the_same_machine() {
    let (machine, errors) = (frozen("machine.toml"), frozen("errors.toml"));
    let positions = frozen("positions.csv");
    let inputs = [&*machine, &errors, "--positions", &positions];
    // One unit of the last printed digit: systems have sines of their own.
    gives(
        &[&["correct"], &inputs[..]].concat(),
        "kinematic.csv",
        1.01e-10,
    );
    gives(&[&["pose"], &inputs[..]].concat(), "poses.csv", 1.01e-7);
}

#[test]
fn errors_of_version_0_1_still_have_the_blob_that_they_had() {
    let [machine, errors, blob] = ["machine.toml", "errors.toml", "machine.trax"].map(frozen);
    // At the tolerance that it was compiled with.
    let tolerance = ["--tolerance", "0.5", "--random", "500"];
    let verify = [&["verify", &machine, &errors, &blob][..], &tolerance].concat();
    answer(0, &verify);
}

/// `name = value` below `[parameters]`.
fn parameters(errors: &str) -> BTreeMap<String, f64> {
    let file: toml::Table = std::fs::read_to_string(errors).unwrap().parse().unwrap();
    let entries = file["parameters"].as_table().unwrap().iter();
    entries
        .map(|(name, value)| (name.clone(), value.as_float().unwrap()))
        .collect()
}

#[test]
fn readings_of_version_0_1_still_show_the_errors_that_they_were_made_with() {
    let files = [
        "machine.toml",
        "probings.csv",
        "artefact.toml",
        "observations.csv",
    ];
    let [machine, probings, artefact, observations] =
        files.map(|name| frozen(&format!("measured/{name}")));
    let folder = Folder::new();
    let found = folder.at("found.toml");
    let identify = ["identify", &machine, &probings, "--artefact", &artefact];
    let with = ["--observations", &observations, "-o", &found];
    answer(0, &[&identify[..], &with].concat());
    let mut found = parameters(&found);
    // The readings have no noise, but 9 decimals, and parameters 7 digits: 2 nm in 42 µm.
    let mut is_close = |name: &str, value: f64| {
        let found = found.remove(name).unwrap_or_else(|| panic!("no {name}"));
        assert!((found - value).abs() < 5e-9, "{name} = {found}");
    };
    for (name, value) in parameters(&frozen("measured/errors.toml")) {
        is_close(&name, value);
    }
    // The laser shows a scale that the machine does not have.
    is_close("EXX1", 0.0);
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn keys_of_a_later_version_are_refused_by_name() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine.toml", "errors.toml"].map(|name| std::fs::read_to_string(frozen(name)).unwrap());
    let later = |text: &str, key: &str| folder.file("later.toml", format!("{key} = 1\n{text}"));
    let newer = ["unknown field `colour`", "a later version of trueaxis"];
    let path = later(&machine, "colour");
    refused(&["pose", &path], &newer);
    let path = later(&errors, "colour");
    refused(&["pose", &frozen("machine.toml"), &path], &newer);
}
