//! From probings to parameters, and invalid probings.

use crate::program::{
    Folder, answer, done, example, examples, plain, refused, refuses, run, split, trueaxis,
};

/// The probings of the Kolibri with ten errors and 1 µm of noise.
pub fn probings(folder: &Folder, more: &[&str]) -> String {
    probings_of(folder, &example("kolibri/plan.csv"), more)
}

/// Like `probings`, for another plan.
pub fn probings_of(folder: &Folder, plan: &str, more: &[&str]) -> String {
    let out = folder.at("probings.csv");
    let [machine, errors, artefact] = examples(
        "kolibri",
        ["machine.toml", "errors-10.toml", "artefact.toml"],
    );
    let mut arguments = vec![
        "simulate",
        "probings",
        &machine,
        &errors,
        "--artefact",
        &artefact,
    ];
    arguments.extend(["--plan", plan, "--noise", "1", "-o", &out]);
    arguments.extend(more);
    answer(0, &arguments);
    out
}

fn identified(folder: &Folder, probings: &str, more: &[&str]) -> serde_json::Value {
    let out = folder.at("errors.toml");
    let machine = example("kolibri/machine.toml");
    let mut arguments = vec!["identify", &machine, probings, "-o", &out, "--json"];
    arguments.extend(more);
    serde_json::from_str(&answer(0, &arguments)).unwrap()
}

/// Value and standard uncertainty of a parameter.
fn of(answer: &serde_json::Value, name: &str) -> [f64; 2] {
    let all = answer["parameters"].as_array().unwrap();
    let one = all.iter().find(|p| p["parameter"] == name).unwrap();
    ["value", "standard_uncertainty"].map(|key| one[key].as_f64().unwrap())
}

#[test]
fn what_is_identified_can_be_compiled() {
    let folder = Folder::new();
    let probings = probings(&folder, &[]);
    let answer_10 = identified(&folder, &probings, &["--model", "10"]);
    let [value, uncertainty] = of(&answer_10, "EB0A");
    assert!((value - 1.09e-3).abs() < 4.0 * uncertainty && uncertainty < 5e-6);
    let (machine, errors, blob) = (
        example("kolibri/machine.toml"),
        folder.at("errors.toml"),
        folder.at("machine.trax"),
    );
    done(&format!(
        "compile {machine} {errors} -o {blob} --random 1000"
    ));
    // The text output.
    let said = done(&format!("identify {machine} {probings} --verbose"));
    for part in [
        "10 parameters from 168 probings of 4 balls",
        "Not measured, and not in these figures: EX0C, EY0A, EZ0A, EXXb and 5 more.",
        "elsewhere (µm)\nfewest                           10",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn what_is_not_seen_has_a_probing_that_would_show_it() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    // Rows with C at zero.
    let all = std::fs::read_to_string(probings(&folder, &[])).unwrap();
    let mut rows = all.lines();
    let header = rows.next().unwrap();
    assert_eq!(header, "ball,Y,A,C,X,Z");
    let at_zero = |row: &&str| row.split(',').nth(3).unwrap().parse::<f64>() == Ok(0.0);
    let kept: Vec<&str> = std::iter::once(header)
        .chain(rows.filter(at_zero))
        .collect();
    let kept = folder.file("c0.csv", kept.join("\n") + "\n");
    let said = done(&format!("identify {machine} {kept} --model 10"));
    let unseen = said
        .split("not to be seen in these probings")
        .nth(1)
        .unwrap();
    let add = unseen
        .lines()
        .find(|line| line.starts_with("    add: ball "));
    // At zero, C has no effect.
    assert!(add.is_some_and(|line| line.contains(", C = ")), "{said}");
    let found = identified(&folder, &kept, &["--model", "10"]);
    let unseen = found["unseen"].as_array().unwrap();
    let added: Vec<&str> = unseen.iter().filter_map(|u| u["add"].as_str()).collect();
    let add = add.unwrap().trim();
    let is_added = |place: &&str| add.starts_with(&format!("add: {place}"));
    assert!(added.iter().any(is_added), "{add}: {added:?}");
}

#[test]
fn a_compensation_that_was_on_is_undone() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let (errors, blob) = (example("kolibri/errors-10.toml"), folder.at("active.trax"));
    done(&format!(
        "compile {machine} {errors} -o {blob} --random 1000"
    ));
    // Positions as read with the compensation on: without its correction.
    let measured = std::fs::read_to_string(probings(&folder, &[])).unwrap();
    let positions: String = (measured.lines())
        .map(|line| line.split_once(',').unwrap().1.to_owned() + "\n")
        .collect();
    let positions = folder.file("positions.csv", positions);
    let corrections = done(&format!("eval {blob} --positions {positions}"));
    let mut read = String::from("ball,Y,A,C,X,Z\n");
    for (row, correction) in measured.lines().zip(corrections.lines()).skip(1) {
        let (ball, row) = row.split_once(',').unwrap();
        let both = row.split(',').zip(correction.split(','));
        let cells = both.map(|(q, d)| q.parse::<f64>().unwrap() - d.parse::<f64>().unwrap());
        let cells: Vec<String> = cells.map(|q| format!("{q:.9}")).collect();
        read += &format!("{ball},{}\n", cells.join(","));
    }
    let read = folder.file("read.csv", read);
    let with = identified(&folder, &read, &["--model", "10", "--active", &blob]);
    let without = identified(&folder, &read, &["--model", "10"]);
    let [undone, uncertainty] = of(&with, "EB0A");
    assert!((undone - 1.09e-3).abs() < 4.0 * uncertainty, "{undone}");
    assert!(of(&without, "EB0A")[0].abs() < 1e-4);
}

/// Probings of the Kolibri with the ball and the positions of A and C by which its compensation was validated.
fn validated(folder: &Folder, name: &str, more: &[&str]) -> String {
    validated_with(&example("kolibri/errors-10.toml"), folder, name, more)
}

fn validated_with(errors: &str, folder: &Folder, name: &str, more: &[&str]) -> String {
    let out = folder.at(name);
    let [machine, artefact, plan] = examples(
        "kolibri",
        ["machine.toml", "artefact.toml", "validation.csv"],
    );
    let arguments = [
        "simulate",
        "probings",
        &machine,
        errors,
        "--artefact",
        &artefact,
        "--plan",
        &plan,
        "-o",
        &out,
    ];
    answer(0, &[&arguments[..], more].concat());
    out
}

#[test]
fn several_files_of_probings_are_identified_together_if_what_stayed_is_stated() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let first = validated(&folder, "first.csv", &["--noise", "1", "--seed", "2"]);
    let second = validated(&folder, "second.csv", &["--noise", "1", "--seed", "3"]);
    let identify = |files: &[&str], more: &[&str]| {
        let words = ["identify", &machine];
        let arguments = [&words[..], files, &["--model", "10", "--json"], more].concat();
        let output = trueaxis(&arguments);
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        found
    };
    refuses(
        &format!("identify {machine} {first} {second} --model 10"),
        &["both probings", "--same stylus"],
    );
    let alone = identify(&[&first], &[]);
    let of_alone = of(&alone, "EB0A")[1];
    let balls = alone["balls"].as_array().unwrap().len();
    for (same, count) in [("stylus", 2 * balls), ("balls", balls)] {
        let both = identify(&[&first, &second], &["--same", same]);
        assert_eq!(both["balls"].as_array().unwrap().len(), count, "{same}");
        let [value, uncertainty] = of(&both, "EB0A");
        assert!(
            (value - 1.09e-3).abs() < 4.0 * uncertainty,
            "{same}: {both}"
        );
        // Twice the rows: 0.71 of it, and less than that of one file in any case.
        assert!(
            uncertainty < 0.85 * of_alone,
            "{same}: {uncertainty} {of_alone}"
        );
    }
}

#[test]
fn a_machine_that_changes_from_day_to_day_is_no_noise() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    // On the second day Y is longer by 100 µm/m. All files have one name, each in a folder of its own.
    let errors = std::fs::read_to_string(example("kolibri/errors-10.toml")).unwrap();
    let changed = folder.file("changed.toml", errors.replace("-0.607e-3", "-0.507e-3"));
    let usual = example("kolibri/errors-10.toml");
    let mut days = Vec::new();
    for (day, errors) in [&usual, &changed, &usual].into_iter().enumerate() {
        std::fs::create_dir(folder.at(&format!("day{day}"))).unwrap();
        let name = format!("day{day}/probings.csv");
        let seed = day.to_string();
        let more = ["--noise", "1", "--seed", &seed];
        days.push(validated_with(errors, &folder, &name, &more));
    }
    let identified = |same: &str| {
        let words = ["identify", &machine, &days[0], &days[1], &days[2]];
        let more = ["--model", "10", "--same", same, "--json"];
        let output = trueaxis(&[&words[..], &more].concat());
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let misfit = identified("balls")["misfit_um"].as_f64().unwrap();
    // Two thirds of 100 µm/m over some 100 mm are several µm.
    assert!(misfit > 1.0, "{misfit}");
    let balls = identified("stylus")["balls"].as_array().unwrap().len();
    let one = trueaxis(&["identify", &machine, &days[0], "--model", "10", "--json"]);
    let one: serde_json::Value = serde_json::from_slice(&one.stdout).unwrap();
    assert_eq!(balls, 3 * one["balls"].as_array().unwrap().len());
}

#[test]
fn what_a_compensation_has_done_to_each_parameter_is_said() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    identified(&folder, &probings(&folder, &[]), &["--model", "10"]);
    let (errors, blob) = (folder.at("errors.toml"), folder.at("active.trax"));
    done(&format!(
        "compile {machine} {errors} -o {blob} --random 1000"
    ));
    let before = validated(&folder, "before.csv", &["--noise", "1", "--seed", "2"]);
    let old = folder.at("before.toml");
    done(&format!("identify {machine} {before} --model 10 -o {old}"));
    let on = ["--noise", "1", "--seed", "3", "--active", &blob];
    let after = validated(&folder, "after.csv", &on);
    let arguments = [
        "identify", &machine, &after, "--model", "10", "--before", &old,
    ];
    let said = answer(0, &arguments);
    for part in ["compensability (k = 2)", "tip at these probings (µm), mean"] {
        assert!(said.contains(part), "{said}");
    }
    let found = answer(0, &[&arguments[..], &["--json"]].concat());
    let found: serde_json::Value = serde_json::from_str(&found).unwrap();
    let compensated = &found["compensated"];
    let all = compensated["parameters"].as_array().unwrap();
    assert_eq!(all.len(), 10);
    for one in all {
        let number = |key: &str| one[key].as_f64().unwrap();
        let (before, after) = (number("before"), number("after"));
        // The source document's Eq. 38.
        let part = (before.abs() - after.abs()) / before.abs();
        assert!((part - number("compensability")).abs() < 1e-12, "{one}");
        // Of ten values, one in 15 000 is farther from 0; the calibration has three times as many rows.
        let uncertainty = 1.5 * number("after_standard_uncertainty");
        assert!(after.abs() < 4.5 * uncertainty, "{one}");
    }
    let mean = [0, 1].map(|k| compensated["mean_um"][k].as_f64().unwrap());
    // 0.1 mm of errors; the remainder is the noise of two calibrations, a few µm.
    assert!(mean[0] > 50.0 && mean[1] < 0.05 * mean[0], "{mean:?}");
    let other = folder.file(
        "other.toml",
        "machine = \"Kolibri\"\n[parameters]\nEXC1 = 1e-5\n",
    );
    refuses(
        &format!("identify {machine} {after} --model 10 --before {other}"),
        &["none of its parameters is looked for", "same --model"],
    );
}

/// What is identified from probings with tables. Where these are not undone, only what they leave is found: some nm that are no
/// noise, of which the command may complain.
fn json_of_tables(words: &[&str]) -> serde_json::Value {
    let found = trueaxis(words);
    let most = if words.contains(&"--active") { 0 } else { 1 };
    assert!(found.status.code().is_some_and(|code| code <= most));
    serde_json::from_slice(&found.stdout).unwrap()
}

#[test]
fn what_is_probed_with_a_compensation_that_is_undone_is_the_machine() {
    let folder = Folder::new();
    let (machine, truth) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
    );
    let blob = folder.at("active.trax");
    done(&format!(
        "compile {machine} {truth} -o {blob} --random 1000"
    ));
    let after = validated(&folder, "after.csv", &["--active", &blob]);
    let of_all = |more: &[&str]| {
        let words = ["identify", &machine, &after, "--model", "10", "--json"];
        of(&json_of_tables(&[&words[..], more].concat()), "EB0A")[0]
    };
    // Tables are within 0.05 µm of the reference correction, which is less than 1 µrad at levers of 0.1 m.
    assert!(of_all(&[]).abs() < 1e-6);
    // With the tables undone, only f32 rounding remains.
    assert!((of_all(&["--active", &blob]) - 1.09e-3).abs() < 1e-9);
}

#[test]
fn recorded_probings_with_an_exact_compensation_applied_identify_to_nothing() {
    let folder = Folder::new();
    let [machine, truth] = examples("kolibri", ["machine.toml", "errors-10.toml"]);
    let [blob, after] = ["applied.trax", "after.csv"].map(|name| folder.at(name));
    done(&format!(
        "compile {machine} {truth} -o {blob} --random 1000"
    ));
    let before = validated(&folder, "before.csv", &[]);
    let said = done(&format!(
        "probings {machine} {before} --apply {blob} -o {after}"
    ));
    assert!(
        said.contains("60 probings as they would have been with"),
        "{said}"
    );
    let found = |more: &str| {
        let line = format!("identify {machine} {after} --model 10 --json{more}");
        json_of_tables(&split(&line))
    };
    let left = found("");
    for one in left["parameters"].as_array().unwrap() {
        // Tables are within 0.05 µm of the reference correction, which is less than 1 µrad and 1 µm/m at levers of 0.1
        // m. The bound is stricter for EY0C, which is in mm.
        assert!(one["value"].as_f64().unwrap().abs() < 1e-6, "{one}");
    }
    // `--active` is the inverse; only f32 rounding remains.
    let undone = of(&found(&format!(" --active {blob}")), "EB0A")[0];
    assert!((undone - 1.09e-3).abs() < 1e-9, "{undone}");
}

#[test]
fn what_was_known_before_stays() {
    let folder = Folder::new();
    let probings = probings(&folder, &[]);
    let old = folder.file(
        "old.toml",
        "machine = \"Kolibri\"\n[parameters]\nEAAb = -13e-6\nEB0A = 0.5e-3\n",
    );
    identified(&folder, &probings, &["--model", "10", "--update", &old]);
    let written = std::fs::read_to_string(folder.at("errors.toml")).unwrap();
    assert!(
        written.contains("EAAb = -1.3e-5") && written.contains("EB0A = 1.09"),
        "{written}"
    );
    let table =
        "machine = \"Kolibri\"\n[tabulated.EXX]\nat = [-100.0, 100.0]\nvalue = [0.0, 0.01]\n";
    let old = folder.file("old.toml", table);
    identified(&folder, &probings, &["--model", "10", "--update", &old]);
    let written = std::fs::read_to_string(folder.at("errors.toml")).unwrap();
    assert!(written.contains("[tabulated.EXX]"), "{written}");
    let change = "machine = \"Kolibri\"\n[thermal]\nEXX1 = { per_kelvin = 1e-6, sensor = \"bed\", reference_celsius = 20.0 }\n";
    let old = folder.file("old.toml", change);
    let machine = example("kolibri/machine.toml");
    refuses(
        &format!("identify {machine} {probings} --update {old}"),
        &["thermal changes cannot be kept", "without --update"],
    );
}

#[test]
fn rows_that_are_no_probings_are_refused() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let out = folder.at("errors.toml");
    let row = "1,1,2,3,4,100\n";
    for (text, parts) in [
        ("", ["the file is empty", "ball,X,Y,Z,A,C"]),
        (
            "ball,X,Y,Z,A\n",
            ["column `C` is missing", "ball,Y,A,C,X,Z"],
        ),
        (
            "ball,X,Y,Z,A,C,Q\n",
            ["column 7: `Q` is not a known column", "A_dir"],
        ),
        (
            "ball,X,Y,Z,A,C,C\n",
            ["column 7: `C` is listed twice", "keep one"],
        ),
        ("ball;X;Y;Z;A;C\n", ["separated by semicolons", "commas"]),
        (
            "ball,Y,A,C,X,Z\n",
            ["no rows below the header", "one probing per line"],
        ),
        (
            "ball,Y,A,C,X,Z\n1,2,3\n",
            [
                "line 2: the row has 3 columns, the header has 6",
                "one value per column",
            ],
        ),
        (
            "ball,Y,A,C,X,Z\n1,2,3,x,4,5\n",
            ["column 4 (C): `x` is not a finite number", "decimal point"],
        ),
        (
            "ball,Y,A,C,X,Z\n1,2,3,NaN,4,5\n",
            [
                "column 4 (C): `NaN` is not a finite number",
                "decimal point",
            ],
        ),
        (
            "ball,Y,A,C,X,Z\n1,2,3,4,500,5\n",
            [
                "column 5 (X): X = 500 is outside the travel",
                "range of the axis",
            ],
        ),
        (
            "ball,Y,A,C,X,Z,A_dir\n1,2,3,4,5,6,2\n",
            ["column 7 (A_dir): `2` is not a direction", "write 1"],
        ),
        (
            "ball,Y,A,C,X,Z,sigma_um\n1,2,3,4,5,6,0\n",
            ["0 µm cannot be the uncertainty of a probing", "more than 0"],
        ),
        (
            "ball,Y,A,C,X,Z\n,2,3,4,5,6\n",
            ["column 1 (ball): the value is missing", "one value per"],
        ),
        (
            &format!("ball,Y,A,C,X,Z\n{row}{row}"),
            ["line 3: this row is the same as line 2", "column `run`"],
        ),
        (
            "ball,Y,A,C,X,Z\n1,2,0.5236,1.5708,4,5\n",
            [
                "line 2: rotary positions such as A = 0.5236 look like radians",
                "in degrees",
            ],
        ),
        (
            &format!("ball,Y,A,C,X,Z\n{row}"),
            [
                "3 equations, three of each probing, for 16 unknowns",
                "fewer parameters",
            ],
        ),
    ] {
        let probings = folder.file("p.csv", text);
        refuses(
            &format!("identify {machine} {probings} --model 10 -o {out}"),
            &parts,
        );
    }
    assert_eq!(folder.names(), ["p.csv"]);
}

#[test]
fn a_ball_that_nobody_knows_is_refused_and_one_that_was_probed_once_is_told() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let artefact = example("kolibri/artefact.toml");
    let text = std::fs::read_to_string(probings(&folder, &[])).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[6] = lines[6].replacen('1', "l", 1);
    let misnamed = folder.file("misnamed.csv", lines.join("\n") + "\n");
    let with = ["identify", &machine, &misnamed, "--model", "10"];
    refused(
        &[&with[..], &["--artefact", &artefact]].concat(),
        &[
            "misnamed.csv, line 7: the artefact has no ball `l`",
            "write one of 1, 2, 3, 4",
        ],
    );
    // Without an artefact it counts as a fifth ball.
    let output = trueaxis(&with);
    assert_eq!(output.status.code(), Some(0));
    let said = plain(&output.stderr);
    assert!(
        said.contains("line 7: ball l was probed only once") && said.contains("correct the name"),
        "{said}"
    );
}

#[test]
fn models_and_artefacts_that_are_none_are_refused() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let probings = probings(&folder, &[]);
    for (model, parts) in [
        (
            "11",
            [
                "`11` is neither a model nor an error parameter",
                "10, 12, 13",
            ],
        ),
        (
            "84",
            ["laid out as wCBXFZYSt; Kolibri is wCAYFXZSt", "auto"],
        ),
        ("EB0A,EB0A", ["EB0A is named twice", "once"]),
        ("EB0B", ["Kolibri has no parameter EB0B", "wCAYFXZSt"]),
    ] {
        refuses(
            &format!("identify {machine} {probings} --model {model}"),
            &parts,
        );
    }
    for (text, parts) in [
        (
            "[[bar]]\nballs = [\"1\", \"7\"]\nlength_mm = 1.0\nstandard_uncertainty_mm = 1.0\n",
            ["there is no ball `1`", "add [[ball]]"],
        ),
        (
            "[[ball]]\nname = \"1\"\n[[ball]]\nname = \"1\"\n",
            ["ball `1` is listed twice", "its own name"],
        ),
        (
            "[[ball]]\nname = \"1\"\nnominal_mm = [1.0, 2.0]\n",
            ["2 numbers", "as many values"],
        ),
        (
            "[stylus]\nlength_standard_uncertainty_mm = -1.0\n",
            ["-1 is no such length", "more than 0"],
        ),
        ("balls = 3\n", ["unknown field", "one of the keys"]),
    ] {
        let artefact = folder.file("a.toml", text);
        refuses(
            &format!("identify {machine} {probings} --model 10 --artefact {artefact}"),
            &parts,
        );
    }
}

#[test]
fn what_cannot_be_probed_is_not_simulated() {
    let folder = Folder::new();
    let [machine, errors, artefact] = examples(
        "kolibri",
        ["machine.toml", "errors-10.toml", "artefact.toml"],
    );
    for (plan, ball, parts) in [
        (
            "ball,A,C\n9,0,0\n",
            None,
            ["ball `9` has no nominal_mm", "correct the plan"],
        ),
        (
            "ball,A,C\n1,0,0\n",
            Some("[[ball]]\nname = \"1\"\nnominal_mm = [500.0, 0.0, 0.0]\n"),
            ["line 2: ball `1` is at X = 500", "correct the plan"],
        ),
    ] {
        let plan = folder.file("s.csv", plan);
        let artefact = ball.map_or(artefact.clone(), |text| folder.file("a.toml", text));
        refuses(
            &format!("simulate probings {machine} {errors} --artefact {artefact} --plan {plan}"),
            &parts,
        );
    }
}

/// The stylus of the Kolibri, measured.
const STYLUS: &str = "
[stylus]
x_mm = 0.0
y_mm = 0.0
z_mm = -74.0
x_standard_uncertainty_mm = 1e-3
y_standard_uncertainty_mm = 1e-3
z_standard_uncertainty_mm = 1e-3
";

#[test]
fn what_the_stylus_takes_up_stays_known_as_not_seen() {
    let folder = Folder::new();
    let of = |file: &str| example(&format!("kolibri/{file}"));
    let [machine, artefact, plan] = ["machine.toml", "artefact.toml", "plan.csv"].map(of);
    let text = std::fs::read_to_string(of("errors-10.toml")).unwrap();
    let text = text.replace("EB0A =", "EX0C = 20e-3\nEB0A =");
    let truth = folder.file("truth.toml", text);
    let measured = folder.at("measured.csv");
    let simulate = [
        "simulate",
        "probings",
        &machine,
        &truth,
        "--artefact",
        &artefact,
    ];
    let plan = ["--plan", &plan, "--noise", "0.5", "-o", &measured];
    answer(0, &[&simulate[..], &plan].concat());
    let found = folder.at("found.toml");
    let identify = |artefact: &str| {
        let start = ["identify", &machine, &measured, "--artefact", artefact];
        let output = trueaxis(&[&start[..], &["--model", "12", "-o", &found]].concat());
        let said = String::from_utf8(output.stderr).unwrap();
        (said, std::fs::read_to_string(&found).unwrap())
    };
    // The stylus is found beside its stated place, by the 20 µm.
    let (said, file) = identify(&artefact);
    assert!(
        said.contains("cannot tell that from EX0C,EY0A,EZ0A"),
        "{said}"
    );
    let unseen = [
        "[unseen]",
        "\nEX0C = 20.0",
        "\nEZ0A = 20.0",
        "\nEXX1 = ",
        "\nEXXb = 10.0  # no row says from which side the axis came",
    ];
    for unseen in unseen {
        assert!(file.contains(unseen), "{file}");
    }
    let said = answer(
        0,
        &["compile", &machine, &found, "-o", &folder.at("tables.trax")],
    );
    assert!(
        said.contains("the measured errors put the tip off by about"),
        "{said}"
    );
    assert!(
        said.contains("Not measured, and not in these figures: EX0C"),
        "{said}"
    );
    assert!(!said.contains("no more than"), "{said}");
    assert!(
        file.contains("misfit_um = ") && said.contains("over the probed zone"),
        "{said}"
    );
    // A stylus that was measured takes nothing up; then the model lacks something, and the residuals show it.
    let text = std::fs::read_to_string(&artefact).unwrap() + STYLUS;
    let (said, file) = identify(&folder.file("qualified.toml", text));
    assert!(!said.contains("cannot tell that from"), "{said}");
    assert!(said.contains("the model lacks"), "{said}");
    assert!(!file.contains("\nEX0C"), "{file}");
}

#[test]
fn what_is_listed_as_not_seen_is_checked() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let text = std::fs::read_to_string(example("kolibri/errors-10.toml")).unwrap();
    for (unseen, message) in [
        ("EX0C = -1.0", "negative or not a number"),
        ("EX0C = nan", "negative or not a number"),
        ("EX0Q = 1.0", "is not an error parameter"),
        ("EB0A = 1.0", "has a value and is also listed as not seen"),
        (
            "[uncertainty]\ncovariance = \"c.csv\"\nmisfit_um = -1.0",
            "misfit_um is negative or not a number",
        ),
    ] {
        let errors = folder.file("errors.toml", format!("{text}\n[unseen]\n{unseen}\n"));
        let output = run(&format!("verify {machine} {errors} {errors}"));
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(message), "{unseen}: {said}");
    }
}
