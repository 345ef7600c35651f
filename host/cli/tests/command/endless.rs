//! Whether an axis rotates without limits follows from the machine file, whatever tables its compensation has.

use crate::program::{Folder, answer, example};
use serde_json::Value;

/// C turns in steps of 0.2° across the end of the turn, then back across it.
const TURNING: &str = "Y,C,X,Z,B\n0,359.5,0,0,0\n0,359.7,0,0,0\n0,359.9,0,0,0\n0,0.1,0,0,0\n\
    0,0.3,0,0,0\n0,0.1,0,0,0\n0,359.9,0,0,0\n0,359.7,0,0,0\n";
/// Direction of travel of C in each row.
const SIGNS: [f64; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0];

/// A column from the output of `eval` or `correct`.
fn column(csv: &str, name: &str) -> Vec<f64> {
    let (header, body) = csv.split_once('\n').unwrap();
    let place = header.split(',').position(|n| n == name).unwrap();
    body.lines()
        .map(|line| line.split(',').nth(place).unwrap().parse().unwrap())
        .collect()
}

/// The table-head machine, whose C has no limits, with these errors: machine, errors, blob.
fn compiled(folder: &Folder, errors: &str) -> [String; 3] {
    let machine = example("table-head/machine.toml");
    let errors = folder.file(
        "errors.toml",
        format!("machine = \"Table and head\"\n[parameters]\n{errors}"),
    );
    let blob = folder.at("out.trax");
    answer(
        0,
        &[
            "compile",
            &machine,
            &errors,
            "-o",
            &blob,
            "--random",
            "200",
            "--policy",
            "orientation",
        ],
    );
    [machine, errors, blob]
}

#[test]
fn an_endless_axis_with_only_a_backlash_keeps_its_direction_over_the_turn() {
    let folder = Folder::new();
    let [machine, errors, blob] = compiled(&folder, "ECCb = 20.0e-6\n");
    let listed: Value = serde_json::from_str(&answer(0, &["inspect", &blob, "--json"])).unwrap();
    let wraps = |bank: &Value| bank["modulo"] == Value::Bool(true);
    assert!(
        !listed["bank_list"].as_array().unwrap().iter().any(wraps),
        "no modulo table may tell that C is endless here"
    );
    let positions = folder.file("p.csv", TURNING);
    let found = column(
        &answer(0, &["eval", &blob, "--positions", &positions]),
        "dC",
    );
    let exact = answer(
        0,
        &[
            "correct",
            &machine,
            &errors,
            "--positions",
            &positions,
            "--policy",
            "orientation",
        ],
    );
    let half = 20.0e-6_f64.to_degrees();
    for ((found, exact), sign) in found.iter().zip(column(&exact, "dC")).zip(SIGNS) {
        assert!((found + sign * half).abs() < 1e-7, "{found} {sign}");
        assert!((found - exact).abs() < 1e-7, "{found} {exact}");
    }
}

#[test]
fn so_does_one_with_tables_beside_its_backlash() {
    let folder = Folder::new();
    let [_, _, blob] = compiled(&folder, "ECCb = 20.0e-6\nEX0C = 0.03\nEB0C = 50.0e-6\n");
    let positions = folder.file("p.csv", TURNING);
    let found = column(
        &answer(0, &["eval", &blob, "--positions", &positions]),
        "dC",
    );
    let half = 20.0e-6_f64.to_degrees();
    for (found, sign) in found.iter().zip(SIGNS) {
        assert!((found + sign * half).abs() < 0.2 * half, "{found} {sign}");
    }
}

#[test]
fn inspect_shows_the_turn_of_an_endless_axis() {
    let folder = Folder::new();
    let [_, _, blob] = compiled(&folder, "ECCb = 20.0e-6\n");
    let text = answer(0, &["inspect", &blob]);
    assert!(
        text.contains("\n  C  endless (360 deg)    correction"),
        "{text}"
    );
    let listed: Value = serde_json::from_str(&answer(0, &["inspect", &blob, "--json"])).unwrap();
    let axes = listed["axes"].as_array().unwrap();
    assert_eq!(axes[1]["period"], 360.0);
    assert_eq!(axes[1]["travel"], Value::Null);
    assert_eq!(axes[0]["period"], Value::Null);
}
