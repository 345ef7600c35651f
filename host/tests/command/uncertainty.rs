//! Covariances: written, read, merged, and what they leave.

use crate::identify::probings;
use crate::program::{Folder, answer, example, plain, refused, trueaxis};

/// Identifies the Kolibri's ten errors into `errors.toml`.
fn identified(folder: &Folder) -> String {
    let (out, machine) = (folder.at("errors.toml"), example("kolibri/machine.toml"));
    let probings = probings(folder, &[]);
    answer(
        0,
        &["identify", &machine, &probings, "--model", "10", "-o", &out],
    );
    out
}

fn compiled(folder: &Folder, errors: &str, more: &[&str]) -> String {
    let (machine, out) = (example("kolibri/machine.toml"), folder.at("k.trax"));
    let mut arguments = vec!["compile", &machine, errors, "-o", &out, "--random", "1000"];
    arguments.extend(more);
    answer(0, &arguments)
}

#[test]
fn compile_and_verify_print_what_uncertain_parameters_leave() {
    let folder = Folder::new();
    let errors = identified(&folder);
    let said = compiled(&folder, &errors, &[]);
    assert!(
        said.contains("95 % band of what uncertain parameters leave"),
        "{said}"
    );
    assert!(!said.contains("uncorrelated"), "{said}");
    let json = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let with = json(&compiled(&folder, &errors, &["--json"]));
    assert_eq!(with["uncertainty"]["correlated"], 10);
    let verified = [
        "verify",
        &example("kolibri/machine.toml"),
        &errors,
        &folder.at("k.trax"),
    ];
    let verified = json(&answer(
        0,
        &[&verified[..], &["--random", "1000", "--json"]].concat(),
    ));
    assert_eq!(verified["uncertainty"], with["uncertainty"]);
    // The same without correlations is told so, and another band.
    let text = std::fs::read_to_string(&errors).unwrap();
    let alone = text.replace(
        "[uncertainty]\ncovariance = \"errors.covariance.csv\"\n",
        "",
    );
    let alone = folder.file("alone.toml", &alone);
    let said = compiled(&folder, &alone, &[]);
    assert!(
        said.contains("10 of 10 parameters are taken as uncorrelated"),
        "{said}"
    );
    let without = json(&compiled(&folder, &alone, &["--json"]));
    let mean = |answer: &serde_json::Value| {
        let mean = &answer["uncertainty"]["travel"]["translation_um"]["mean"];
        mean.as_f64().unwrap()
    };
    let (with, without) = (mean(&with), mean(&without));
    assert!((with / without - 1.0).abs() > 0.05, "{with} {without}");
    // Nothing is said where nothing is known.
    let errors = example("kolibri/errors-10.toml");
    let none = json(&compiled(&folder, &errors, &["--json"]));
    assert!(none["uncertainty"].is_null());
}

#[test]
fn covariances_that_do_not_belong_to_the_errors_are_refused() {
    let folder = Folder::new();
    let errors = identified(&folder);
    let covariances = folder.at("errors.covariance.csv");
    let text = std::fs::read_to_string(&covariances).unwrap();
    let machine = example("kolibri/machine.toml");
    let out = folder.at("never.trax");
    for (from, to, parts) in [
        (
            "EB0A",
            "EB0Y",
            [
                "EB0Y has no value under [parameters]",
                "one run of identify",
            ],
        ),
        (
            "parameter,",
            "name,",
            ["does not begin with `parameter`", "header"],
        ),
        (
            "\nEC0A,",
            "\nEC0A,0,",
            ["the row has 12 columns, the header has 11", "one row"],
        ),
    ] {
        std::fs::write(&covariances, text.replace(from, to)).unwrap();
        refused(&["compile", &machine, &errors, "-o", &out], &parts);
    }
    // Of another run, with twice the uncertainty.
    let scaled: Vec<String> = text
        .lines()
        .map(|line| {
            let cells = line.split(',').map(|cell| match cell.parse::<f64>() {
                Ok(value) => format!("{:e}", 4.0 * value),
                Err(_) => cell.to_owned(),
            });
            cells.collect::<Vec<_>>().join(",")
        })
        .collect();
    std::fs::write(&covariances, scaled.join("\n")).unwrap();
    let parts = ["the standard uncertainty of EB0A is", "one run of identify"];
    refused(&["compile", &machine, &errors, "-o", &out], &parts);
    std::fs::remove_file(&covariances).unwrap();
    refused(
        &["compile", &machine, &errors, "-o", &out],
        &["errors.covariance.csv: cannot be read", "CSV file"],
    );
}

#[test]
fn what_is_known_already_is_merged_with_its_covariances() {
    let folder = Folder::new();
    let errors = identified(&folder);
    let probings = folder.at("probings.csv");
    let out = folder.at("new.toml");
    let machine = example("kolibri/machine.toml");
    let names = "EB0A,EC0A,EY0C,EA0C,EB0C";
    answer(
        0,
        &[
            "identify", &machine, &probings, "--model", names, "--update", &errors, "-o", &out,
        ],
    );
    let merged = std::fs::read_to_string(folder.at("new.covariance.csv")).unwrap();
    let header = merged.lines().next().unwrap();
    assert_eq!(
        header,
        format!("parameter,{names},EC0X,EA0Z,EB0Z,EYY1,EZZ1")
    );
    // What the rows say of the first five if the others are exact is less than what is not known: with what
    // is not known of the others they are as uncertain as before.
    let old = std::fs::read_to_string(&errors).unwrap();
    let new = std::fs::read_to_string(&out).unwrap();
    let of = |text: &str, name: &str| -> f64 {
        let part = text.split("[standard_uncertainty]").nth(1).unwrap();
        let line = part.lines().find(|l| l.starts_with(name)).unwrap();
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    for name in names.split(',') {
        let ratio = of(&new, name) / of(&old, name);
        // The same rows, used twice.
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
    }
    // It is read again.
    compiled(&folder, &out, &[]);
}

#[test]
fn a_bar_to_a_ball_that_was_not_probed_is_told() {
    let folder = Folder::new();
    let probings = probings(&folder, &[]);
    let artefact = folder.file(
        "a.toml",
        "[[ball]]\nname = \"1\"\n[[ball]]\nname = \"one\"\n[[bar]]\nballs = [\"1\", \"one\"]\nlength_mm = 100.0\nstandard_uncertainty_mm = 0.001\n",
    );
    let machine = example("kolibri/machine.toml");
    let output = trueaxis(&[
        "identify",
        &machine,
        &probings,
        "--model",
        "10",
        "--artefact",
        &artefact,
    ]);
    assert_eq!(output.status.code(), Some(0));
    let said = plain(&output.stderr);
    assert!(
        said.contains("ball one was not probed under this name"),
        "{said}"
    );
}

#[test]
fn identifications_are_repeated_for_anyone() {
    let files = [
        "machine.toml",
        "errors-10.toml",
        "artefact.toml",
        "strategy.csv",
    ];
    let [machine, errors, artefact, strategy] = files.map(|f| example(&format!("kolibri/{f}")));
    let said = answer(
        0,
        &[
            "simulate",
            "identifications",
            &machine,
            &errors,
            "--artefact",
            &artefact,
            "--strategy",
            &strategy,
            "--model",
            "10",
            "--seeds",
            "20",
            "--json",
        ],
    );
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["identifications"], 20);
    assert_eq!(said["parameters"].as_array().unwrap().len(), 10);
    let inside = said["tips_inside"].as_f64().unwrap();
    assert!((0.8..=1.0).contains(&inside), "{inside}");
}
