//! Results of the commands.

use crate::program::{Folder, answer, blob, done, example, split};
use serde_json::Value;
use trueaxis::{AlignedBlob, Travel};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Command, Region, Runtime, random_commands};
use trueaxis_tests::usual_or_all;

fn model(machine: &str, errors: &str) -> (Machine, ErrorModel) {
    let machine = Machine::from_toml(&std::fs::read_to_string(example(machine)).unwrap()).unwrap();
    let errors =
        ErrorModel::from_toml(&std::fs::read_to_string(example(errors)).unwrap(), &machine)
            .unwrap();
    (machine, errors)
}

fn json(code: i32, arguments: &[&str]) -> Value {
    serde_json::from_str(&answer(code, arguments)).unwrap()
}

/// Header and rows of numbers.
fn rows<T: std::str::FromStr>(csv: &str) -> (String, Vec<Vec<T>>) {
    let (header, body) = csv.split_once('\n').unwrap();
    let number = |v: &str| v.parse().unwrap_or_else(|_| panic!("{v}"));
    (
        header.to_owned(),
        body.lines()
            .map(|line| line.split(',').map(number).collect())
            .collect(),
    )
}

/// Checks `before`, `after` and `kinematic`, and that the tables are as good as the kinematic correction.
fn check_quality(json: &Value) {
    for key in ["before", "after", "kinematic"] {
        for kind in ["translation_um", "direction_urad"] {
            for statistic in ["mean", "rms", "max"] {
                assert!(
                    json[key][kind][statistic].is_f64(),
                    "{key} {kind} {statistic}"
                );
            }
        }
    }
    let max = |key: &str| json[key]["translation_um"]["max"].as_f64().unwrap();
    assert!(max("before") > 100.0);
    assert!(max("after") < 0.1);
    assert!(max("kinematic") < 1e-6);
    assert!(json["difference_um"].as_f64().unwrap() <= 0.05);
    assert!(json["difference_urad"].as_f64().unwrap() <= 0.05);
}

#[test]
fn compile_says_what_it_did_and_writes_what_it_says() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    let path = folder.at("h.trax");
    let answer = json(
        0,
        &split(&format!(
            "compile {machine} {errors} -o {path} --random 500 --json"
        )),
    );
    check_quality(&answer);
    assert_eq!(answer["meets_tolerance"], true);
    assert_eq!(answer["bytes"], std::fs::metadata(&path).unwrap().len());
    assert_eq!(answer["positions"], 500);
    assert_eq!(folder.names(), ["h.trax"]);
    for axis in answer["axes"].as_array().unwrap() {
        let number = |key: &str| axis[key].as_f64().unwrap();
        let least = if axis["unit"] == "mm" { 0.01 } else { 0.001 };
        assert!((number("value_bound") - (1.25 * number("largest")).max(least)).abs() < 1e-6);
        assert!((number("ramp_rate") - (2.0 * number("value_bound")).max(0.01)).abs() < 1e-6);
        assert!(number("rate_bound") >= 0.1 && number("rate_bound") > number("ramp_rate"));
    }
    // Much less than if rotation about the tool axis is corrected, too.
    let per_mm = |answer: &Value| answer["um_per_mm_of_tool_length"].as_f64().unwrap();
    assert!(per_mm(&answer) > 0.003);
    let orientation = ["--policy", "orientation", "--random", "500", "--json"];
    let files = ["compile", &machine, &errors, "-o", &path];
    assert!(per_mm(&json(0, &[&files[..], &orientation].concat())) > 0.01);
}

#[test]
fn compile_writes_the_same_bytes_again() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    let path = folder.at("h.trax");
    done(&format!(
        "compile {machine} {errors} -o {path} --random 300 --seed 9"
    ));
    done(&format!(
        "compile {machine} {errors} -o {} --random 300 --seed 9",
        folder.at("again.trax")
    ));
    assert_eq!(
        std::fs::read(path).unwrap(),
        std::fs::read(folder.at("again.trax")).unwrap()
    );
}

#[test]
fn neither_bytes_nor_figures_depend_on_the_number_of_threads() {
    let folder = Folder::new();
    let path = folder.at("k.trax");
    // Location errors and backlash; a bent axis, a calibrated range and a scheme with many tables.
    let bent = folder.file(
        "bent.toml",
        "machine = \"Kolibri\"\n[parameters]\nEXX2 = 2e-7\nEXA2 = 1e-2\nEB0A = 1e-4\n[calibrated]\nA = [-55.0, 55.0]\n",
    );
    let machine = example("kolibri/machine.toml");
    for (errors, usual) in [
        (example("kolibri/errors-12.toml"), ["cost"]),
        (bent, ["tables"]),
    ] {
        for minimize in usual_or_all(&usual[..], &["cost", "tables"]) {
            let results = ["1", "3"].map(|threads| {
                let output = std::process::Command::new(env!("CARGO_BIN_EXE_trueaxis"))
                    .env("RAYON_NUM_THREADS", threads)
                    .args(["compile", &machine, &errors, "-o", &path])
                    .args(["--random", "3000", "--minimize", minimize])
                    .args(["--best-effort", "--json"])
                    .output()
                    .unwrap();
                let answer = String::from_utf8(output.stdout).unwrap();
                (answer, std::fs::read(&path).unwrap())
            });
            assert!(results[0].0.contains("\"written\": true"));
            assert_eq!(results[0], results[1], "{errors}, {minimize}");
        }
    }
}

#[test]
fn verify_sees_a_missed_tolerance_as_compile_did() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    let path = folder.at("h.trax");
    let line = format!(
        "compile {machine} {errors} -o {path} --points 3 --random 300 --tolerance 0.05 \
             --best-effort"
    );
    let arguments = split(&line);
    let output = crate::program::trueaxis(&arguments);
    assert_eq!(output.status.code(), Some(1));
    let said = crate::program::plain(&output.stderr);
    assert!(
        said.contains(
            "the tolerance of 0.05 µm at the tip and 1 µrad of the tool's direction is not met"
        ),
        "{said}"
    );
    assert!(
        said.contains("were reached") && said.contains("written all the same"),
        "{said}"
    );
    assert_eq!(folder.names(), ["h.trax"]);
    // `verify` finds the same; a wider tolerance passes.
    answer(1, &["verify", &machine, &errors, &path, "--random", "300"]);
    done(&format!(
        "verify {machine} {errors} {path} --random 300 --tolerance 1000"
    ));
}

#[test]
fn verify_reports_before_after_and_kinematic() {
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let line = format!(
        "verify {machine} {errors} {} --random 400 --seed 5 --json",
        blob("kolibri")
    );
    let arguments = split(&line);
    let first = json(0, &arguments);
    check_quality(&first);
    assert_eq!(first["positions"], 400);
    assert_eq!(json(0, &arguments), first);
    // Another seed gives other positions.
    let mut other = arguments.to_vec();
    other[7] = "6";
    assert_ne!(json(0, &other)["before"], first["before"]);
}

#[test]
fn verify_needs_the_zero_position_that_compile_had() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let path = folder.at("k.trax");
    let zero = ["--zero-at", "X=10,Z=100,A=-20"];
    done(&format!(
        "compile {machine} {errors} -o {path} --random 300 {} {}",
        zero[0], zero[1]
    ));
    done(&format!(
        "verify {machine} {errors} {path} --random 300 {} {}",
        zero[0], zero[1]
    ));
    answer(1, &["verify", &machine, &errors, &path, "--random", "300"]);
    // At that position the correction is zero.
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n0,-20,0,10,100\n");
    let (_, values) = rows::<f32>(&answer(0, &["eval", &path, "--positions", &positions]));
    assert!(values[0].iter().all(|v| v.abs() < 5e-5), "{values:?}");
}

#[test]
fn inside_and_outside_the_calibrated_range_are_told_apart() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let text = "machine = \"Kolibri\"\n[parameters]\nEXA2 = 1e-2\nEB0A = 1e-4\n[calibrated]\nA = [-55.0, 55.0]\n";
    let errors = folder.file("errors.toml", text);
    let path = folder.at("k.trax");
    let answer = json(
        0,
        &split(&format!(
            "compile {machine} {errors} -o {path} --random 500 --json"
        )),
    );
    assert_eq!(answer["inside"]["positions"], 500);
    assert_eq!(answer["partly_calibrated"], true);
    let outside = answer["outside"]["positions"].as_u64().unwrap();
    assert!((200..400).contains(&outside), "{outside}");
}

#[test]
fn the_verdict_does_not_depend_on_how_many_positions_fall_past_the_ends_of_travel() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    // The correction of X leads 0.05 mm past an end, where EYX holds its value: a bend of 0.1 µm.
    let text = "machine = \"Mill with 21 errors\"\n[parameters]\nEXX0 = 0.05\nEYX2 = 2e-6\n";
    let errors = folder.file("errors.toml", text);
    let path = folder.at("m.trax");
    let compile = |random: &str| {
        let line = format!(
            "compile {machine} {errors} -o {path} --random {random} --policy orientation \
                 --verbose"
        );
        let words = split(&line);
        answer(0, &words)
    };
    for random in ["2000", "20000"] {
        let shown = compile(random);
        assert!(!shown.contains("ranges of the error motions"), "{shown}");
    }
    // One position in ten thousand is there.
    let shown = compile("400000");
    let line = "  inside the ranges of the error motions, by at most 0.04";
    assert!(shown.contains(line), "{shown}");
    let verify = ["verify", &machine, &errors, &path, "--random", "400000"];
    let found = json(0, &[&verify[..], &["--json"]].concat());
    assert_eq!(found["meets_tolerance"], true);
    assert_eq!(found["partly_calibrated"], false);
    assert!(found["inside"]["difference_um"].as_f64().unwrap() < 0.05);
    assert!(found["difference_um"].as_f64().unwrap() > 0.08);
}

#[test]
fn a_table_on_a_part_of_the_travel_is_calibrated_there() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let text = "machine = \"Kolibri\"\n[tabulated.EXX]\nat = [-65.0, 0.0, 65.0]\nvalue = [0.0, 0.003, 0.001]\n";
    let errors = folder.file("errors.toml", text);
    let path = folder.at("k.trax");
    let answer = json(
        0,
        &split(&format!(
            "compile {machine} {errors} -o {path} --random 500 --json"
        )),
    );
    assert_eq!(answer["inside"]["positions"], 500);
    let outside = answer["outside"]["positions"].as_u64().unwrap();
    assert!((200..300).contains(&outside), "{outside}");
}

#[test]
fn a_table_for_each_direction_of_travel_is_corrected_in_each() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let text = "machine = \"Kolibri\"\n[tabulated.EXX]\nat = [-130.0, 0.0, 130.0]\npositive = [0.001, 0.003, 0.003]\nnegative = [-0.001, 0.003, -0.005]\n";
    let errors = folder.file("errors.toml", text);
    let path = folder.at("k.trax");
    answer(
        0,
        &["compile", &machine, &errors, "-o", &path, "--random", "500"],
    );
    let positions = folder.file(
        "p.csv",
        "Y,A,C,X,Z\n0,0,0,-120,0\n0,0,0,-65,0\n0,0,0,65,0\n0,0,0,125,0\n0,0,0,65,0\n0,0,0,-65,0\n",
    );
    let (_, values) = rows::<f64>(&answer(0, &["eval", &path, "--positions", &positions]));
    // First the mean, because the direction is still unknown.
    let expected = [-0.000_231, -0.002, -0.003, -0.003, 0.001, -0.001];
    for (row, expected) in values.iter().zip(expected) {
        assert!((row[3] - expected).abs() < 5e-5, "{} {expected}", row[3]);
    }
}

#[test]
fn harmonics_of_an_endless_axis_are_corrected_around_the_seam() {
    let folder = Folder::new();
    let machine = example("table-head/machine.toml");
    let text = "machine = \"Table and head\"\n[parameters]\nEXCc1 = 2e-3\nEYCs3 = 1e-3\nEACc8 = 5e-6\n[calibrated]\nC = [90.0, 180.0]\n";
    let errors = folder.file("errors.toml", text);
    let path = folder.at("t.trax");
    let answer = json(
        0,
        &split(&format!(
            "compile {machine} {errors} -o {path} --random 500 --json"
        )),
    );
    assert_eq!(answer["inside"], serde_json::Value::Null);
    assert!(answer["difference_um"].as_f64().unwrap() < 0.05);
}

#[test]
fn inspect_lists_what_there_is() {
    let found = json(0, &["inspect", &blob("length"), "--json"]);
    let count = |key: &str| found[key].as_u64().unwrap_or_else(|| panic!("{key}")) as usize;
    let axes: Vec<&str> = found["axes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a["name"].as_str().unwrap())
        .collect();
    assert_eq!(axes, ["Y", "A", "C", "X", "Z"]);
    assert_eq!(count("terms"), found["term_list"].as_array().unwrap().len());
    assert_eq!(count("grids"), 0);
    assert!(count("tables") > 0 && count("samples") > 0);
    assert_eq!(
        count("bytes") as u64,
        std::fs::metadata(blob("length")).unwrap().len()
    );
    assert_eq!(found["auxiliaries"][0]["name"], "tool length");
    let text = answer(0, &["inspect", &blob("length")]);
    for part in [
        "Huron K2X8-Five",
        "dX =",
        "of A:",
        "correction within",
        "tool length",
    ] {
        assert!(text.contains(part), "{part} is not in:\n{text}");
    }
}

#[test]
fn eval_gives_the_bits_of_the_runtime() {
    let (machine, errors) = model(
        "huron-k2x8/machine-tool-length.toml",
        "huron-k2x8/errors-13.toml",
    );
    let commands =
        random_commands(&Kinematics::new(&machine, &errors), Region::Travel, 500, 3).unwrap();
    let mut csv = "length,Z,X,C,A,Y\n".to_owned();
    for c in &commands {
        let [y, a, ch, x, z, _] = c.axes;
        csv += &format!("{},{z},{x},{ch},{a},{y}\n", c.auxiliaries[0]);
    }
    let folder = Folder::new();
    let positions = folder.file("p.csv", csv);
    let out = folder.at("out.csv");
    let path = blob("length");
    answer(0, &["eval", &path, "--positions", &positions, "-o", &out]);
    let (header, values) = rows::<f32>(&std::fs::read_to_string(out).unwrap());
    assert_eq!(header, "dY,dA,dC,dX,dZ");
    assert_eq!(values.len(), commands.len());
    let bytes = AlignedBlob::from_bytes(&std::fs::read(path).unwrap());
    let runtime = Runtime::load(&bytes).unwrap();
    for (command, row) in commands.iter().zip(values) {
        // Without backlash the direction does not matter.
        let expected = runtime.evaluate(command);
        assert!(
            row.iter()
                .zip(expected)
                .all(|(a, b)| a.to_bits() == b.to_bits()),
            "{row:?} {expected:?}"
        );
    }
}

#[test]
fn the_order_of_positions_is_the_direction_of_travel() {
    let folder = Folder::new();
    // A moves up, down by less than the reversal threshold, then down by more.
    let motion = [0.0, 10.0, 20.0, 19.9995, 10.0_f64];
    let directions = [
        Travel::Unknown,
        Travel::Positive,
        Travel::Positive,
        Travel::Positive,
        Travel::Negative,
    ];
    let csv: String = motion
        .iter()
        .map(|a| format!("50,{a},0,10,100\n"))
        .collect();
    let positions = folder.file("p.csv", format!("Y,A,C,X,Z\n{csv}"));
    let path = blob("kolibri");
    let (_, values) = rows::<f32>(&answer(0, &["eval", &path, "--positions", &positions]));
    let (machine, _) = model("kolibri/machine.toml", "kolibri/errors-12.toml");
    let bytes = AlignedBlob::from_bytes(&std::fs::read(path).unwrap());
    let runtime = Runtime::load(&bytes).unwrap();
    for ((a, travel), row) in motion.iter().zip(directions).zip(&values) {
        let mut command = Command::at(&machine, &[50.0, *a, 0.0, 10.0, 100.0]);
        command.travel[1] = travel;
        assert_eq!(row[..], runtime.evaluate(&command)[..5]);
    }
    // The same position in the other direction: twice the parameter EAAb = -0.013 mrad apart, damped by 0.1.
    let apart = f64::from(values[1][1] - values[4][1]).to_radians();
    assert!((apart - 2.0 * 0.013e-3 / 1.01).abs() < 1e-7, "{apart}");
    // The reference correction uses the same directions.
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let (_, exact) = rows::<f64>(&answer(
        0,
        &["correct", &machine, &errors, "--positions", &positions],
    ));
    for (table, exact) in values.iter().zip(exact) {
        for (t, e) in table.iter().zip(exact) {
            assert!((f64::from(*t) - e).abs() < 5e-5, "{t} {e}");
        }
    }
}

#[test]
fn json_of_eval_and_correct_has_the_same_numbers() {
    let folder = Folder::new();
    let positions = folder.file("p.csv", "Y,A,C,X,Z\n50,10,20,30,40\n51,11,21,31,41\n");
    let path = blob("kolibri");
    let (_, values) = rows::<f32>(&answer(0, &["eval", &path, "--positions", &positions]));
    let found = json(0, &["eval", &path, "--positions", &positions, "--json"]);
    assert_eq!(found["axes"][1], "A");
    for (row, values) in found["corrections"].as_array().unwrap().iter().zip(values) {
        for (a, b) in row.as_array().unwrap().iter().zip(values) {
            assert_eq!(a.as_f64().unwrap() as f32, b);
        }
    }
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let out = folder.at("out.csv");
    let line = format!("correct {machine} {errors} --positions {positions} -o {out} --json");
    let arguments = split(&line);
    assert_eq!(json(0, &arguments)["rows"], 2);
}

#[test]
fn correct_agrees_with_the_golden_cases() {
    let folder = Folder::new();
    for name in ["huron-13", "kolibri-10", "tilted-split"] {
        let golden = |end: &str| {
            format!(
                "{}/../../tests/golden/{name}{end}",
                env!("CARGO_MANIFEST_DIR")
            )
        };
        let (header, cases) = rows::<f64>(&std::fs::read_to_string(golden(".csv")).unwrap());
        let columns: Vec<&str> = header.split(',').collect();
        let axes = columns.iter().position(|c| c.starts_with('d')).unwrap();
        let mut csv = columns[..axes].join(",") + "\n";
        for case in &cases {
            let row: Vec<String> = case[..axes].iter().map(f64::to_string).collect();
            csv += &(row.join(",") + "\n");
        }
        let positions = folder.file("p.csv", csv);
        let (machine, errors) = (golden(".machine.toml"), golden(".errors.toml"));
        let (found, values) = rows::<f64>(&done(&format!(
            "correct {machine} {errors} --positions {positions} --policy orientation"
        )));
        assert_eq!(found, columns[axes..2 * axes].join(","));
        assert_eq!(values.len(), cases.len());
        for (value, case) in values.iter().zip(&cases) {
            for (v, c) in value.iter().zip(&case[axes..]) {
                assert!((v - c).abs() < 1e-9, "{name}: {v} {c}");
            }
        }
    }
}

#[test]
fn every_help_shows_an_example() {
    for command in [
        "compile",
        "verify",
        "inspect",
        "eval",
        "correct",
        "flash",
        "monitor",
        "linuxcnc setup",
        "linuxcnc check",
        "linuxcnc model",
        "linuxcnc probe",
        "linuxcnc calibrate",
    ] {
        let words: Vec<&str> = command.split(' ').chain(["--help"]).collect();
        let help = answer(0, &words);
        let shows = ["Example", "Examples"]
            .iter()
            .any(|head| help.contains(&format!("{head}:\n  trueaxis {command} ")));
        assert!(shows, "{help}");
    }
}
