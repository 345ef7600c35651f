//! `eval` and `correct` report axes outside their travel, and still print results.

use crate::program::{Folder, answer, blob, example, plain, trueaxis};
use serde_json::{Value, json};

const HEADER: &str = "Y,A,C,X,Z\n";

/// Arguments of `eval` with the Kolibri's blob and of `correct` with its files.
fn both(positions: &str) -> [Vec<String>; 2] {
    let files = [
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    ];
    let [eval, correct] = [
        vec!["eval".to_owned(), blob("kolibri")],
        ["correct".to_owned()].into_iter().chain(files).collect(),
    ];
    [eval, correct].map(|start| {
        let rest = ["--positions", positions].map(str::to_owned);
        start.into_iter().chain(rest).collect()
    })
}

/// Number of rows on standard output, and the text on standard error.
fn said(arguments: &[String]) -> (usize, String) {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let output = trueaxis(&arguments);
    assert_eq!(output.status.code(), Some(0));
    let rows = String::from_utf8(output.stdout).unwrap().lines().count() - 1;
    (rows, plain(&output.stderr))
}

/// The policy printed by `eval` on standard error; for `correct` it is an argument.
fn policy(arguments: &[String]) -> String {
    match arguments[0] == "eval" {
        true => "policy: direction, damping 0.1".to_owned(),
        false => String::new(),
    }
}

#[test]
fn each_axis_outside_its_travel_is_named_once_with_its_limits_and_a_count() {
    let folder = Folder::new();
    let rows =
        "0,0,0,0,100\n0,120.5,0,-131,100\n0,0,0,200,100\n\n0,0,0,130.25,100\n0,0,0,130,240\n";
    let positions = folder.file("p.csv", HEADER.to_owned() + rows);
    for arguments in both(&positions) {
        let (rows, text) = said(&arguments);
        assert_eq!(rows, 5);
        for part in [
            "p.csv: A is outside its travel of -120 to 120 deg at position 2 (120.5 deg)",
            "p.csv: X is outside its travel of -130 to 130 mm at position 2 (-131 mm) and at 2 more",
        ] {
            assert!(text.contains(part), "`{part}` is not in:\n{text}");
        }
        assert_eq!(text.matches("warning:").count(), 2, "{text}");
    }
}

#[test]
fn the_ends_of_the_travel_are_inside() {
    let folder = Folder::new();
    let ends = "-210,-120,-360,-130,0\n210,120,360,130,240\n";
    let positions = folder.file("p.csv", HEADER.to_owned() + ends);
    for arguments in both(&positions) {
        assert_eq!(said(&arguments), (2, policy(&arguments)));
    }
}

#[test]
fn json_lists_them_too() {
    let folder = Folder::new();
    let rows = "0,0,0,0,-1.5\n0,0,0,0,0\n0,0,0,0,250\n";
    let positions = folder.file("p.csv", HEADER.to_owned() + rows);
    let out = folder.at("out.csv");
    for arguments in both(&positions) {
        for end in [&["--json"][..], &["--json", "-o", &out]] {
            let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            let output = trueaxis(&[&arguments, end].concat());
            assert_eq!(output.status.code(), Some(0));
            assert!(plain(&output.stderr).contains("at position 1 (-1.5 mm) and at one more"));
            let found: Value = serde_json::from_slice(&output.stdout).unwrap();
            assert_eq!(
                found["outside"],
                json!([{
                    "axis": "Z", "unit": "mm", "limits": [0.0, 240.0],
                    "first": 1, "value": -1.5, "count": 2
                }])
            );
        }
    }
}

#[test]
fn an_endless_axis_has_no_outside() {
    let folder = Folder::new();
    let machine = example("table-head/machine.toml");
    let errors = example("table-head/errors-13.toml");
    let blob = folder.at("out.trax");
    answer(
        0,
        &["compile", &machine, &errors, "-o", &blob, "--random", "200"],
    );
    let positions = folder.file("p.csv", "Y,C,X,Z,B\n0,-30,0,0,0\n0,4000,0,0,0\n");
    let tail = ["--positions", &positions];
    for head in [&["eval", &blob][..], &["correct", &machine, &errors]] {
        let arguments: Vec<String> = head.iter().chain(&tail).map(|a| (*a).to_owned()).collect();
        assert_eq!(said(&arguments), (2, policy(&arguments)));
    }
}
