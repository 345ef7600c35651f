//! Named position sets: `trueaxis plan --set`.

use crate::program::{Folder, answer, done, example, json, refused};
use serde_json::Value;

/// Plans a set and returns the prediction.
fn planned(machine: &str, artefact: &str, model: &str, set: &str, more: &[&str]) -> Value {
    let mut arguments = vec![
        "plan",
        machine,
        "--artefact",
        artefact,
        "--model",
        model,
        "--set",
        set,
        "--json",
    ];
    arguments.extend(more);
    serde_json::from_str(&answer(0, &arguments)).unwrap()
}

fn of_example(name: &str) -> [String; 2] {
    ["machine", "artefact"].map(|file| example(&format!("{name}/{file}.toml")))
}

/// Number of different positions: lines of a plan without the ball column.
fn positions(csv: &str) -> usize {
    let rows = csv
        .lines()
        .skip(1)
        .map(|line| line.split_once(',').unwrap().1);
    let mut all: Vec<&str> = rows.collect();
    all.sort_unstable();
    all.dedup();
    all.len()
}

#[test]
fn sets_have_as_many_positions_as_the_document_and_tell_every_parameter_of_its_models() {
    let folder = Folder::new();
    // Machine, model, set, probings, balls, positions: Tables 5-4, 5-3 and 4-1.
    for (name, model, set, probings, balls, places) in [
        ("kolibri", "10", "chase-the-ball", 60, 1, 60),
        ("kolibri", "12", "chase-the-ball", 60, 1, 60),
        ("kolibri", "10", "rumba", 168, 4, 42),
        ("hu40", "13", "samba", 109, 6, 32),
    ] {
        let [machine, artefact] = of_example(name);
        let out = folder.at("set.csv");
        let plan = planned(&machine, &artefact, model, set, &["-o", &out]);
        // All of them can be reached.
        let left_out = plan["left_out"].as_array().unwrap();
        assert!(left_out.is_empty(), "{set}: {left_out:?}");
        assert_eq!(plan["probings"], probings, "{set}");
        assert_eq!(plan["balls"].as_array().unwrap().len(), balls, "{set}");
        assert_eq!(plan["rank"], plan["unknowns"], "{set}");
        assert!(plan["unseen"].as_array().unwrap().is_empty(), "{set}");
        assert!(plan["unreachable"].as_array().unwrap().is_empty(), "{set}");
        let csv = std::fs::read_to_string(&out).unwrap();
        assert_eq!(positions(&csv), places, "{csv}");
    }
}

/// Simulates probings of a set, identifies, and compares with the simulated errors.
#[track_caller]
fn goes_round(
    folder: &Folder,
    machine: &str,
    errors: &str,
    artefact: &str,
    model: &str,
    set: &str,
) {
    let (plan, probings) = (folder.at("set.csv"), folder.at("probings.csv"));
    planned(machine, artefact, model, set, &["-o", &plan]);
    done(&format!(
        "simulate probings {machine} {errors} --artefact {artefact} --plan {plan} -o \
            {probings}"
    ));
    let found = json(&format!(
        "identify {machine} {probings} --artefact {artefact} --model {model}"
    ));
    let truth: toml::Table = std::fs::read_to_string(errors).unwrap().parse().unwrap();
    let truth = truth["parameters"].as_table().unwrap();
    let parameters = found["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), truth.len(), "{set}: {found}");
    for parameter in parameters {
        let name = parameter["parameter"].as_str().unwrap();
        let value = parameter["value"].as_f64().unwrap();
        // Probings are written with nine decimals, and solved to 1e-9 mm.
        let expected = truth[name].as_float().unwrap();
        assert!((value - expected).abs() < 1e-8, "{set}, {name}: {value}");
    }
}

#[test]
fn what_is_simulated_at_a_set_is_identified_again() {
    let folder = Folder::new();
    let [machine, artefact] = of_example("kolibri");
    for (errors, model, set) in [
        ("kolibri/errors-10.toml", "10", "chase-the-ball"),
        ("kolibri/errors-10.toml", "10", "rumba"),
    ] {
        goes_round(&folder, &machine, &example(errors), &artefact, model, set);
    }
    let [machine, artefact] = of_example("hu40");
    let errors = example("hu40/errors-13.toml");
    goes_round(&folder, &machine, &errors, &artefact, "13", "samba");
}

#[test]
fn other_machines_get_a_set_for_their_own_axes_inside_their_travel() {
    let folder = Folder::new();
    for (name, tilts, ball) in [
        ("huron-k2x8", 'A', [60.0, 20.0, 40.0]),
        ("fork-head", 'B', [1500.0, 20.0, -600.0]),
        ("table-head", 'B', [60.0, 20.0, 40.0]),
        ("linuxcnc-xyzac-trt", 'A', [230.0, 160.0, -260.0]),
        ("five-axis-30", 'A', [60.0, 20.0, 40.0]),
    ] {
        let artefact = folder.file(
            "artefact.toml",
            format!("[[ball]]\nname = \"1\"\nnominal_mm = {ball:?}\n"),
        );
        let machine = example(&format!("{name}/machine.toml"));
        let text = std::fs::read_to_string(&machine).unwrap();
        let description: toml::Table = text.parse().unwrap();
        let axes = description["axis"].as_array().unwrap();
        for set in ["chase-the-ball", "rumba"] {
            let out = folder.at(&format!("{name}-{set}.csv"));
            let plan = planned(&machine, &artefact, "EXX1", set, &["-o", &out]);
            assert!(plan["probings"].as_u64().unwrap() > 30, "{name}: {plan}");
            assert!(plan["unreachable"].as_array().unwrap().is_empty(), "{name}");
            let csv = std::fs::read_to_string(&out).unwrap();
            let header: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
            for axis in axes {
                let letter = axis["name"].as_str().unwrap();
                let Some(column) = header.iter().position(|cell| *cell == letter) else {
                    continue;
                };
                let travel: Vec<f64> = (axis["range"].as_array().unwrap().iter())
                    .map(|v| v.as_float().unwrap())
                    .collect();
                let at = csv
                    .lines()
                    .skip(1)
                    .map(|line| -> f64 { line.split(',').nth(column).unwrap().parse().unwrap() });
                let (low, high) = at.fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p), h.max(p)));
                assert!(
                    low >= travel[0] && high <= travel[1],
                    "{name}, {letter}: {low} {high}"
                );
                if letter.starts_with(tilts) {
                    assert!(
                        high > 0.0 && high <= 55.0 && low >= -55.0,
                        "{name}: {low} {high}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_set_that_a_machine_or_an_artefact_does_not_have_is_refused() {
    let [kolibri, balls] = of_example("kolibri");
    let plan = |machine: &str, more: &[&str], parts: &[&str]| {
        let mut arguments = vec!["plan", machine, "--artefact", &balls, "--model", "auto"];
        arguments.extend(more);
        refused(&arguments, parts);
    };
    for three in ["mill-21", "router"] {
        let machine = example(&format!("{three}/machine.toml"));
        let text = std::fs::read_to_string(&machine).unwrap();
        let description: toml::Table = text.parse().unwrap();
        let name = description["name"].as_str().unwrap();
        plan(
            &machine,
            &["--set", "rumba"],
            &["rumba turns balls with two rotary axes", name, "has 0"],
        );
    }
    plan(
        &kolibri,
        &["--set", "samba"],
        &["samba needs a bar", "[[bar]]", "--set rumba"],
    );
    plan(
        &kolibri,
        &["--set", "chase-the-ball", "--balls", "1,2"],
        &["follows one ball, not 2"],
    );
}

#[test]
fn what_the_stylus_does_not_reach_is_left_out_and_said() {
    let [machine, artefact] = of_example("kolibri");
    let plan = planned(&machine, &artefact, "10", "rumba", &["--cone", "30"]);
    let left_out = plan["left_out"].as_array().unwrap();
    let probings = plan["probings"].as_u64().unwrap();
    assert_eq!(probings + left_out.len() as u64, 168);
    // Of the 42 pairs of Table 5-3, 18 have A beyond 30 degrees.
    assert_eq!(left_out.len(), 4 * 18, "{left_out:?}");
    let reason = left_out[0]["reason"].as_str().unwrap();
    assert!(reason.contains("45°"), "{reason}");
}
