//! Strategies, their programs, the logs of their touches, and invalid ones.

use crate::program::{
    Folder, answer, done, example, examples, json, plain, refused, refuses, trueaxis,
};

fn planned(folder: &Folder, more: &str) -> serde_json::Value {
    let [machine, artefact] = examples("kolibri", ["machine.toml", "artefact.toml"]);
    let (out, indexings) = (folder.at("plan.csv"), "A=-50:50:10,C=0:330:30");
    let plan = format!("plan {machine} --artefact {artefact} --model 12 -o {out}");
    json(&format!("{plan} --indexings {indexings} {more}"))
}

/// The log of its touches on a machine with the document's errors and 0.5 µm of noise.
fn touched(folder: &Folder) -> String {
    let [machine, errors, artefact] = examples(
        "kolibri",
        ["machine.toml", "errors-12.toml", "artefact.toml"],
    );
    let (plan, log) = (folder.at("plan.csv"), folder.at("touches.log"));
    done(&format!(
        "simulate touches {machine} {errors} --artefact {artefact} --plan {plan} \
            --noise 0.5 --misplaced 1,-1,0.5 -o {log}"
    ));
    log
}

#[test]
fn a_plan_leads_to_parameters() {
    let folder = Folder::new();
    let (program, table) = (folder.at("probe.ngc"), folder.at("table.csv"));
    let proposed = planned(
        &folder,
        &format!(
            "--probings 40 --program {program} --table {table} --ball-diameter 20 \
            --stylus-diameter 6"
        ),
    );
    assert_eq!(
        [
            &proposed["probings"],
            &proposed["rank"],
            &proposed["unknowns"]
        ],
        [40, 27, 27]
    );
    let plan = std::fs::read_to_string(folder.at("plan.csv")).unwrap();
    assert!(plan.starts_with("ball,A,C,A_dir,C_dir,run\n"), "{plan}");
    assert_eq!(plan.lines().count(), 41);
    // The first probing is repeated as another run.
    let first: Vec<&str> = plan.lines().nth(1).unwrap().rsplitn(2, ',').collect();
    let last: Vec<&str> = plan.lines().last().unwrap().rsplitn(2, ',').collect();
    assert_eq!((first[1], first[0] == last[0]), (last[1], false));
    let text = std::fs::read_to_string(&program).unwrap();
    let touches = text.lines().filter(|l| l.starts_with("G38.2 "));
    assert_eq!(touches.count(), 200);
    let table = std::fs::read_to_string(&table).unwrap();
    assert_eq!(table.lines().count(), 201);
    // The written plan gets the same evaluation.
    let [machine, artefact] = examples("kolibri", ["machine.toml", "artefact.toml"]);
    let plan = folder.at("plan.csv");
    let again = json(&format!(
        "plan {machine} --artefact {artefact} --model 12 --plan {plan}"
    ));
    assert_eq!(proposed, again);
    let log = touched(&folder);
    let out = folder.at("probings.csv");
    let said = done(&format!("probings {machine} {log} --plan {plan} -o {out}"));
    assert!(
        said.contains("40 probings of 4 balls from 200 touches"),
        "{said}"
    );
    // 10 + 3 mm, with scales of up to 0.6 mm/m.
    assert!(
        said.contains("ball 1: 13.00") || said.contains("ball 1: 12.99"),
        "{said}"
    );
    let found = json(&format!("identify {machine} {out} --model 12"));
    assert_eq!(found["parameters"].as_array().unwrap().len(), 12);
    let of = |name: &str| {
        let all = found["parameters"].as_array().unwrap();
        all.iter().find(|p| p["parameter"] == name).unwrap()["value"]
            .as_f64()
            .unwrap()
    };
    assert!((of("EB0A") - 1.09e-3).abs() < 2e-5, "{}", of("EB0A"));
    assert!((of("EAAb") + 13e-6).abs() < 1e-5, "{}", of("EAAb"));
}

#[test]
fn the_program_comes_from_the_side_that_the_plan_wants() {
    let folder = Folder::new();
    let program = folder.at("probe.ngc");
    planned(
        &folder,
        &format!("--probings 30 --program {program} --ball-diameter 20 --stylus-diameter 6"),
    );
    let plan = std::fs::read_to_string(folder.at("plan.csv")).unwrap();
    let program = std::fs::read_to_string(program).unwrap();
    let (mut at, mut came) = ([f64::NAN; 2], [0.0; 2]);
    let mut rows = plan.lines().skip(1);
    for line in program.lines() {
        let word = |letter: char| -> Option<f64> {
            line.split(' ')
                .find_map(|w| w.strip_prefix(letter)?.parse().ok())
        };
        if line.starts_with("G0 ") {
            for (i, letter) in ['A', 'C'].into_iter().enumerate() {
                if let Some(next) = word(letter) {
                    if next != at[i] {
                        came[i] = if next > at[i] { 1.0 } else { -1.0 };
                    }
                    at[i] = next;
                }
            }
        }
        // The first touch of a row follows its approach.
        if line.starts_with("(row ") {
            came = if at[0].is_nan() { [0.0; 2] } else { came };
        }
        if line.starts_with("G1 ") && line.contains("F#<near>") && program_row(&program, line) {
            let cells: Vec<&str> = rows.next().unwrap().split(',').collect();
            let wanted: Vec<f64> = cells[1..5].iter().map(|c| c.parse().unwrap()).collect();
            assert_eq!(
                (at.to_vec(), came.to_vec()),
                (wanted[..2].to_vec(), wanted[2..].to_vec())
            );
        }
    }
    assert!(rows.next().is_none());
}

/// True for the first move near a ball: the one after `G0` with linear axes.
fn program_row(program: &str, line: &str) -> bool {
    let before = program[..line.as_ptr() as usize - program.as_ptr() as usize]
        .lines()
        .last();
    before.is_some_and(|l| l.starts_with("G0 X"))
}

#[test]
fn instruments_are_planned_beside_probings_and_alone() {
    let folder = Folder::new();
    let [machine, artefact, probings, observations] = examples(
        "kolibri",
        [
            "machine.toml",
            "artefact.toml",
            "plan.csv",
            "observations.csv",
        ],
    );
    let alone = ["plan", &machine, "--observations", &observations, "--json"];
    let plan = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&answer(0, &[&alone[..], more].concat())).unwrap()
    };
    let found = plan(&["--model", "10"]);
    assert_eq!([&found["probings"], &found["observations"]], [0, 53]);
    // The rotary axes do not move.
    let unseen = found["unseen"].as_array().unwrap();
    assert_eq!(unseen.len(), 5);
    assert!(
        unseen[0]["sentence"]
            .as_str()
            .unwrap()
            .contains("observe at more positions"),
        "{unseen:?}"
    );
    // Probings and instruments know more together than either.
    let of = |found: &serde_json::Value, name: &str| {
        let all = found["parameters"].as_array().unwrap();
        let one = all.iter().find(|p| p["parameter"] == name).unwrap();
        one["standard_uncertainty"].as_f64().unwrap()
    };
    let probed = [
        "--model",
        "10",
        "--artefact",
        &artefact,
        "--plan",
        &probings,
    ];
    let both = plan(&probed);
    let balls = ["plan", &machine, "--json"];
    let balls: serde_json::Value =
        serde_json::from_str(&answer(0, &[&balls[..], &probed].concat())).unwrap();
    assert_eq!([&both["setups"], &balls["setups"]], [3, 0]);
    for name in ["EC0X", "EYY1", "EZZ1"] {
        assert!(
            of(&both, name) < of(&found, name).min(of(&balls, name)),
            "{name}"
        );
    }
    // What the file says about the set-up, or its readings, is needed of a length only.
    let text = std::fs::read_to_string(&observations).unwrap();
    let without = text.replace("# place_mm = [0.0, 0.0, 50.0]\n", "");
    let without = folder.file("without.csv", without);
    let arguments = [
        "plan",
        &machine,
        "--observations",
        &without,
        "--model",
        "EXX1",
    ];
    refused(
        &arguments,
        &[
            "without.csv",
            "the set-up `bar` reads lengths",
            "# [setup.bar]",
            "place_mm",
        ],
    );
    let alone = ["plan", &machine, "--observations", &observations];
    for more in [["--plan", &probings], ["-o", &without]] {
        let output = trueaxis(&[&alone[..], &more].concat());
        let said = plain(&output.stderr);
        assert!(
            !output.status.success() && said.contains("--artefact <FILE>"),
            "{said}"
        );
    }
    let few = folder.file(
        "few.csv",
        "kind,X,Y,Z,A,C,reads\ndisplacement,0,0,100,0,0,tool +X\n",
    );
    let arguments = ["plan", &machine, "--observations", &few, "--model", "EXX1"];
    refused(&arguments, &["few.csv", "equations", "read more"]);
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let folder = Folder::new();
    let [machine, artefact] = examples("kolibri", ["machine.toml", "artefact.toml"]);
    let plan = example("kolibri/plan.csv");
    let refused = |more: &str, parts: &[&str]| {
        let start = format!("plan {machine} --artefact {artefact} --model 10");
        refuses(&format!("{start} {more}"), parts);
    };
    refused("--balls 1,9", &["ball `9` is not there"]);
    refused("--balls 1,1", &["names 1 twice"]);
    refused("--indexings A=0:60", &["`A=0:60` are no positions"]);
    refused(
        "--indexings X=0:60:10",
        &["X is not a rotary axis of Kolibri"],
    );
    refused(
        "--indexings A=0:150:50",
        &["A = 150 is outside the travel of -120 to 120"],
    );
    refused("--indexings A=0,A=10", &["A is listed twice"]);
    refused("--indexings A", &["`A` says no positions"]);
    refused("--indexings A=100", &["no ball can be probed", "100°"]);
    refused("--indexings A=0,C=0", &["at all 4 positions", "equations"]);
    refused(
        "--probings 8",
        &[
            "8 probings are too few for 25 unknowns",
            "--probings 10 or more",
        ],
    );
    refused("--minutes 5", &["2 probings are too few"]);
    refused("--search 13", &["through the ball"]);
    refused(&format!("-o {artefact}"), &["the output", "is the input"]);
    let out = folder.at("same.csv");
    refused(
        &format!("-o {out} --table {out} --ball-diameter 20 --stylus-diameter 6"),
        &["would be written twice"],
    );
    let program = folder.at("probe.ngc");
    refused(
        &format!(
            "--plan {plan} --program {program} --ball-diameter 20 --stylus-diameter 6 \
            --cone 50"
        ),
        &["line 5 of the plan: ball 1 cannot be touched", "55°"],
    );
    let few = folder.file("few.csv", "ball,A,C\n1,0,0\n1,10,90\n");
    refused(
        &format!("--plan {few}"),
        &["few.csv", "equations", "unknowns"],
    );
    let far = folder.file("far.csv", "ball,A,C\n1,0,0\n1,-120,90\n");
    refused(&format!("--plan {far}"), &["line 3: ball `1` is at"]);
    assert_eq!(folder.names(), ["far.csv", "few.csv"]);
}

#[test]
fn a_log_that_is_none_of_this_plan_is_refused() {
    let folder = Folder::new();
    planned(&folder, "--probings 30");
    let whole = std::fs::read_to_string(touched(&folder)).unwrap();
    let lines: Vec<&str> = whole.lines().collect();
    let (machine, plan) = (example("kolibri/machine.toml"), folder.at("plan.csv"));
    let refused = |log: &str, parts: &[&str]| {
        let log = folder.file("bad.log", log);
        refuses(&format!("probings {machine} {log} --plan {plan}"), parts);
    };
    refused("", &["the file is empty", "PROBECLOSE"]);
    refused("X,Y,Z,A,C\n", &["no rows below the header"]);
    refused("X,Y,Z,A\n1,2,3,4\n", &["the column `C` is missing"]);
    refused(
        "1.0 2.0\n",
        &["bad.log, line 1", "the row has 2 columns, not 9"],
    );
    refused(
        "1.0 2.0 x 0 0 0 0 0 0\n",
        &["line 1: column 3 (Z): `x` is not a finite number"],
    );
    refused(
        "1.0 2.0 500 0 0 0 0 0 0\n",
        &["column 3 (Z): Z = 500 is outside the travel"],
    );
    refused(
        &(whole.clone() + lines[149] + "\n"),
        &["line 147: the five touches of ball", "no part of a sphere"],
    );
    let other = whole.replace(" 0.000000 0.000000 0.000000\n", " 0.000000 0.000000\n");
    refused(&other, &["the row has 8 columns"]);
    // The log of another plan: rows in another order, with the same first and last rows.
    let mut turned: Vec<&[&str]> = lines.chunks(5).collect();
    turned.reverse();
    refused(
        &(turned.concat().join("\n") + "\n"),
        &["line 6: column", "another plan"],
    );
    // A touch of something else.
    let mut far: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
    let words: Vec<&str> = lines[21].split(' ').collect();
    let x: f64 = words[0].parse().unwrap();
    far[21] = [&[(x - 4.0).to_string().as_str()], &words[1..]]
        .concat()
        .join(" ");
    refused(
        &far.join("\n"),
        &["no part of a sphere", "line 6 of the plan"],
    );
}

#[test]
fn logs_that_end_early_or_were_begun_again_are_read_and_missing_touches_named() {
    let folder = Folder::new();
    planned(&folder, "--probings 30");
    let whole = std::fs::read_to_string(touched(&folder)).unwrap();
    let lines: Vec<&str> = whole.lines().collect();
    let (machine, plan) = (example("kolibri/machine.toml"), folder.at("plan.csv"));
    let out = folder.at("probings.csv");
    let read = |lines: &[&str]| {
        let log = folder.file("part.log", lines.join("\n"));
        let arguments = ["probings", &machine, &log, "--plan", &plan, "-o", &out];
        let said = answer(0, &arguments);
        (said, std::fs::read_to_string(&out).unwrap())
    };
    let (said, all) = read(&lines);
    assert!(!said.contains("left out"), "{said}");
    // Stopped in the middle of row 13.
    let (said, part) = read(&lines[..63]);
    assert!(said.contains("12 probings"), "{said}");
    assert!(said.contains("3 of 5 touches of ball"), "{said}");
    assert!(said.contains("(line 14 of the plan), 0 of 5"), "{said}");
    assert_eq!(part.lines().count(), 1 + 12);
    // Restarted with this row: everything is there, to the last digit.
    let (said, again) = read(&[&lines[..63], &lines[60..]].concat());
    assert!(!said.contains("left out"), "{said}");
    assert_eq!(again, all);
    // One touch is missing.
    let (said, _) = read(&[&lines[..3], &lines[4..]].concat());
    assert!(said.contains("29 probings"), "{said}");
    assert!(said.contains("missing: 4 of 5 touches of ball"), "{said}");
    assert!(said.contains("(line 2 of the plan); probe"), "{said}");
}

#[test]
fn a_touch_that_disagrees_is_named() {
    let folder = Folder::new();
    planned(&folder, "--probings 30");
    let whole = std::fs::read_to_string(touched(&folder)).unwrap();
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    let words: Vec<&str> = lines[50].split(' ').collect();
    // The touch at a pole, 0.05 mm too high.
    let z: f64 = words[2].parse().unwrap();
    let high = (z + 0.05).to_string();
    lines[50] = [&words[..2], &[high.as_str()], &words[3..]]
        .concat()
        .join(" ");
    let (machine, plan) = (example("kolibri/machine.toml"), folder.at("plan.csv"));
    let (log, out) = (
        folder.file("off.log", lines.join("\n")),
        folder.at("probings.csv"),
    );
    let said = done(&format!("probings {machine} {log} --plan {plan} -o {out}"));
    let named = said.lines().find(|l| l.contains("disagree")).unwrap();
    assert!(named.contains("line 12 of the plan"), "{said}");
    assert!(named.contains("line 51 of the log"), "{said}");
}

#[test]
fn location_errors_that_a_model_lacks_are_named_before_and_after_probing() {
    let folder = Folder::new();
    let [machine, errors, artefact] = examples(
        "kolibri",
        ["machine.toml", "errors-12.toml", "artefact.toml"],
    );
    let (plan, probed) = (folder.at("plan.csv"), folder.at("probings.csv"));
    let lacks = |arguments: &[&str]| {
        let output = trueaxis(arguments);
        let said = plain(&output.stderr);
        assert!(output.status.success(), "{said}");
        said
    };
    let proposed = |model: &str, indexings: &str| {
        let with = [
            "--artefact",
            &artefact,
            "--model",
            model,
            "--indexings",
            indexings,
        ];
        lacks(
            &[
                &["plan", &machine],
                &with[..],
                &["--probings", "40", "-o", &plan],
            ]
            .concat(),
        )
    };
    assert_eq!(proposed("10", "A=-50:50:10,C=0:330:30"), "");
    // Indexing the spindle shows the position of the stylus.
    let said = proposed("10", "A=-50:50:10,C=0:330:30,S=0:270:90");
    assert!(said.contains("the plan turns the spindle (M19)"), "{said}");
    assert!(said.contains("the model lacks EX0S,EY0S"), "{said}");
    assert!(said.contains("Give --model 13"), "{said}");
    let with = ["--artefact", &artefact, "--plan", &plan, "-o", &probed];
    answer(
        0,
        &[&["simulate", "probings", &machine, &errors], &with[..]].concat(),
    );
    let identified = |model: &str| lacks(&["identify", &machine, &probed, "--model", model]);
    assert!(identified("10").contains("the model lacks EX0S,EY0S"));
    assert!(!identified("13").contains("lacks"));
}

#[test]
fn a_spindle_that_cannot_be_oriented_is_not_turned_and_its_stylus_can_be_stated() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let known = std::fs::read_to_string(example("kolibri/artefact.toml")).unwrap();
    let (artefact, plan) = (folder.at("artefact.toml"), folder.at("plan.csv"));
    let plan = |machine: &str, stylus: &str| {
        std::fs::write(&artefact, format!("{known}\n{stylus}")).unwrap();
        let with = ["--artefact", &artefact, "--model", "13", "--probings", "40"];
        let output = trueaxis(&[&["plan", machine], &with[..], &["-o", &plan]].concat());
        let said = plain(&output.stderr);
        assert!(output.status.success(), "{said}");
        (said, plain(&output.stdout))
    };
    let (said, shown) = plan(&machine, "");
    assert!(said.contains("the spindle is not turned"), "{said}");
    // After half a turn of C, the workpiece sees it on the other side.
    assert!(
        said.contains("EX0S (10 µm move the tip by up to 20.0 µm over the travel)"),
        "{said}"
    );
    assert!(shown.contains("EX0S (the stylus' x)"), "{shown}");
    let oriented = std::fs::read_to_string(&machine).unwrap();
    let oriented = oriented.replace("[spindle]", "[spindle]\ncan_be_oriented = true");
    let (said, shown) = plan(&folder.file("machine.toml", oriented), "");
    assert!(said.contains("the plan turns the spindle (M19)"), "{said}");
    assert!(!shown.contains("EX0S (the stylus"), "{shown}");
    let zeroed = "[stylus]\nx_mm = 0.0\nx_standard_uncertainty_mm = 0.002\ny_mm = 0.0\ny_standard_uncertainty_mm = 0.002\n";
    let (said, shown) = plan(&machine, zeroed);
    assert!(!said.contains("spindle"), "{said}");
    assert!(!shown.contains("EX0S (the stylus"), "{shown}");
}
