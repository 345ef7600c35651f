//! Readings of instruments, beside probings and alone, and invalid ones.

use crate::identify::probings;
use crate::program::{
    Folder, answer, done, example, examples, json, plain, refused, refuses, trueaxis,
};

/// The observations of the example.
pub fn observations(folder: &Folder, more: &[&str]) -> String {
    let out = folder.at("mixed.csv");
    let [machine, errors, plan] = examples(
        "kolibri",
        ["machine.toml", "errors-10.toml", "observations.csv"],
    );
    let mut arguments = vec!["simulate", "observations", &machine, &errors];
    arguments.extend(["--plan", &plan, "-o", &out]);
    arguments.extend(more);
    answer(0, &arguments);
    out
}

#[test]
fn instruments_and_probings_give_one_answer_that_can_be_compiled() {
    let folder = Folder::new();
    let (probed, observed) = (probings(&folder, &[]), observations(&folder, &[]));
    let (machine, errors) = (example("kolibri/machine.toml"), folder.at("errors.toml"));
    let arguments = [
        "identify",
        &machine,
        &probed,
        "--observations",
        &observed,
        "-o",
        &errors,
    ];
    let said = plain(answer(0, &arguments).as_bytes());
    for part in [
        "from 168 probings of 4 balls and 53 observations with 3 set-ups",
        "lengths 30",
        "displacements 23",
        "square rotation about z",
        " EXX1 ",
    ] {
        assert!(said.contains(part), "`{part}` is not in\n{said}");
    }
    // The scale is no longer relative.
    assert!(!said.contains("common scale"), "{said}");
    let found: serde_json::Value =
        serde_json::from_str(&answer(0, &[&arguments[..], &["--json"]].concat())).unwrap();
    let noise = found["observed"]["noise"].as_array().unwrap();
    assert_eq!(noise.len(), 3);
    assert_eq!(noise[1]["source"], "lengths");
    assert_eq!(found["observed"]["rows"].as_array().unwrap().len(), 53);
    let blob = folder.at("machine.trax");
    done(&format!(
        "compile {machine} {errors} -o {blob} --random 1000"
    ));
    // With the page, too.
    let page = folder.at("page.html");
    answer(0, &[&arguments[..], &["--report", &page]].concat());
    let page = std::fs::read_to_string(page).unwrap();
    for part in [
        "168 probings of 4 balls and 53 observations with 3 set-ups",
        "<th scope=\"row\">displacements</th><td>23</td>",
        "<th scope=\"row\">bar (length)</th><td class=\"text\">dead length</td>",
        "<td class=\"text\">rotation about z</td><td>−0.",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn instruments_alone_and_files_of_runs_and_circles_are_read() {
    let folder = Folder::new();
    let [machine, errors] = examples("kolibri", ["machine.toml", "errors-10.toml"]);
    let (laser, square, circle) = (
        folder.at("x.csv"),
        folder.at("xy.csv"),
        folder.at("circle.csv"),
    );
    let at = "Y=0,Z=100,A=0,C=0";
    done(&format!(
        "simulate laser {machine} {errors} --axis X --at {at} --noise 0.2 -o {laser}"
    ));
    let at = "X=0,Y=0,Z=100,A=0,C=0";
    done(&format!(
        "simulate square {machine} {errors} --lines X,Y --at {at} --noise 0.2 \
            --square-urad 30 -o {square}"
    ));
    done(&format!(
        "simulate ballbar {machine} {errors} --plane XY --at {at} --noise 0.2 -o \
            {circle}"
    ));
    let out = folder.at("errors.toml");
    // The same test elsewhere, or of another machine.
    let text = std::fs::read_to_string(&circle).unwrap();
    for (line, with, said) in [
        (
            "# radius_mm = ",
            "# radius_mm = 9000.0 #",
            "of the test is outside the travel",
        ),
        (
            "# machine = ",
            "# machine = \"Other\" #",
            "this was measured on `Other`",
        ),
    ] {
        assert!(text.contains(line), "{text}");
        let wrong = folder.file("wrong.csv", text.replacen(line, with, 1));
        let arguments = ["identify", &machine, &wrong, "--model", "EC0X", "-o", &out];
        refused(&arguments, &[said]);
    }
    let out = folder.at("errors.toml");
    let found = json(&format!(
        "identify {machine} --observations {laser} {square} {circle} --model \
            EXX1,EYY1,EC0X -o {out}"
    ));
    for (name, truth) in [("EXX1", 0.0), ("EYY1", -0.607e-3), ("EC0X", 0.143e-3)] {
        let all = found["parameters"].as_array().unwrap();
        let one = all.iter().find(|p| p["parameter"] == name).unwrap();
        let [value, uncertainty] =
            ["value", "standard_uncertainty"].map(|k| one[k].as_f64().unwrap());
        // Errors of the rotary axes, which do not move, are not in the model: they turn the workpiece.
        assert!(
            (value - truth).abs() < 5.0 * uncertainty + 1e-6,
            "{name}: {value} ± {uncertainty}"
        );
        assert!(uncertainty < 5e-6, "{name}: {uncertainty}");
    }
    assert!(
        std::fs::read_to_string(&out)
            .unwrap()
            .contains("X = [-130.000, 130.000]")
    );
    // Points on a sphere.
    let text = "# radius_mm = 100.0\n# unit = \"um\"\n# at = { X = 0.0, Y = 0.0, Z = 74.0, A = 0.0, C = 0.0 }\nX,Y,Z,radial\n";
    let mut sphere = text.to_owned();
    for k in 0..40 {
        let (up, round) = (f64::from(k) * 2.0, f64::from(k) * 55.0);
        let [(sine, cosine), (y, x)] = [up, round].map(|v| libm::sincos(v.to_radians()));
        let (x, y, z) = (100.0 * cosine * x, 100.0 * cosine * y, 100.0 * sine);
        // A scale of X of 100 µm/m.
        let radial = 1e-4 * x * x / 100.0 * 1e3;
        sphere += &format!("{x:.6},{y:.6},{z:.6},{radial:.4}\n");
    }
    let sphere = folder.file("sphere.csv", sphere);
    let found = json(&format!(
        "identify {machine} --observations {sphere} --model EXX1"
    ));
    let scale = found["parameters"][0]["value"].as_f64().unwrap();
    assert!((scale - 1e-4).abs() < 1e-6, "{scale}");
    let text = done(&format!(
        "identify {machine} --observations {laser} --model EXX1"
    ));
    assert!(
        text.contains("from 220 observations with 1 set-up")
            || text.contains("from 110 observations with 1 set-up"),
        "{text}"
    );
}

#[test]
fn wrong_readings_are_named_with_file_and_line_and_can_be_left_out() {
    let folder = Folder::new();
    let (probed, observed) = (probings(&folder, &[]), observations(&folder, &[]));
    let machine = example("kolibri/machine.toml");
    let text = std::fs::read_to_string(&observed).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let column = lines[4]
        .split(',')
        .position(|name| name == "length_mm")
        .unwrap();
    let mut cells: Vec<String> = lines[20].split(',').map(str::to_owned).collect();
    let length: f64 = cells[column].parse().unwrap();
    cells[column] = (length + 0.05).to_string();
    lines[20] = cells.join(",");
    let wrong = folder.file("wrong.csv", lines.join("\n"));
    let arguments = ["identify", &machine, &probed, "--observations", &wrong];
    let output = trueaxis(&arguments);
    let said = plain(&output.stderr);
    let (_, size) = said
        .split_once("wrong.csv line 21: this length is ")
        .unwrap();
    let size: f64 = size.split(' ').next().unwrap().parse().unwrap();
    assert!((size - 50.0).abs() < 3.0, "{said}");
    for without in ["wrong.csv line 21", "setup bar"] {
        let output = trueaxis(&[&arguments[..], &["--without", without]].concat());
        let said = plain(&output.stderr);
        assert!(
            output.status.success() && !said.contains("line 21"),
            "{said}"
        );
    }
    let nothing = [&arguments[..], &["--without", "setup none"]].concat();
    refused(&nothing, &["neither a line", "setup bar"]);
}

#[test]
fn bad_observations_are_refused_with_their_place() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let header = "kind,setup,X,Y,Z,A,C,reads,length_mm,displacement_um,sigma_um\n";
    let good = "length,bar,0,0,100,0,0,,100,,0.5\n";
    for (text, parts) in [
        (String::new(), &["the file is empty"][..]),
        (
            format!("{header}distance,bar,0,0,100,0,0,,100,,0.5\n"),
            &["line 2", "`distance` is not a kind", "length, point"],
        ),
        (
            format!("{header}length,bar,0,0,100,0,0,tool +X,100,,0.5\n"),
            &["line 2", "a length has no reads", "leave the cell empty"],
        ),
        (
            format!("{header}length,bar,0,0,100,0,0,,,,0.5\n"),
            &["line 2", "length_mm", "the value is missing"],
        ),
        (
            format!("{header}displacement,laser,0,0,100,0,0,tool X,,1,0.5\n"),
            &["line 2", "has no sign"],
        ),
        (
            format!("{header}displacement,laser,0,0,100,0,0,tool +C,,1,0.5\n"),
            &["not the direction of a displacement"],
        ),
        (
            format!("{header}displacement,laser,0,0,100,0,0,tool +X,,1e6,0.5\n"),
            &["cannot be a reading", "unit"],
        ),
        (
            format!("{header}length,bar,0,0,900,0,0,,100,,0.5\n"),
            &["line 2", "outside the travel"],
        ),
        (
            format!("{header}length,bar,0,0,100,0,0,,100,,-1\n"),
            &["cannot be the uncertainty"],
        ),
        (
            format!("{header}angle,bar,0,0,100,0,0,tool +C,,,\n"),
            &["an angle needs the column `angle_urad`"],
        ),
        (
            format!("{header}{good}displacement,bar,0,0,100,0,0,tool +X,,1,0.5\n"),
            &["line 3", "`bar` reads a length"],
        ),
        (
            format!("# [setup.bal]\n# place_mm = [0.0, 0.0, 0.0]\n{header}{good}"),
            &["no line has the set-up `bal`"],
        ),
        (
            format!("# [setup.bar]\n# place = [0.0, 0.0, 0.0]\n{header}{good}"),
            &["unknown field", "place_mm"],
        ),
        (
            format!("# [setup.bar]\n# orientation_deg = [0.0, 0.0, 0.0]\n{header}{good}"),
            &["line 2", "the set-up of a length does not have this"],
        ),
        (
            format!("# [setup.bar]\n# dead_length_standard_uncertainty_mm = 0.0\n{header}{good}"),
            &["cannot be a standard uncertainty"],
        ),
        (
            format!("{header}{good}"),
            &["equations", "set-ups of instruments"],
        ),
        (
            "# radius_mm = 100.0\n# unit = \"um\"\nangle,ccw\n0,1\n90,2\n".to_owned(),
            &["where all axes stood", "# plane"],
        ),
    ] {
        let file = folder.file("bad.csv", &text);
        let arguments = [
            "identify",
            &machine,
            "--observations",
            &file,
            "--model",
            "EXX1",
        ];
        let parts = [parts, &["bad.csv"]].concat();
        refused(&arguments, &parts);
    }
    let said = plain(&trueaxis(&["identify", &machine]).stderr);
    assert!(said.contains("FILE.csv"), "{said}");
}

#[test]
fn drift_is_reported_and_removed_if_rows_have_times() {
    let folder = Folder::new();
    let [machine, errors, artefact, plan] = examples(
        "kolibri",
        [
            "machine.toml",
            "errors-10.toml",
            "artefact.toml",
            "plan.csv",
        ],
    );
    let text = std::fs::read_to_string(plan).unwrap();
    let mut rows: Vec<&str> = text.lines().collect();
    let header = rows.remove(0);
    // In an order that mixes balls and positions: 61 and the number of rows have no fade factor.
    let mixed = (0..rows.len()).map(|i| rows[i * 61 % rows.len()]);
    let mixed: Vec<&str> = std::iter::once(header).chain(mixed).collect();
    let plan = folder.file("mixed.csv", mixed.join("\n"));
    let probed = folder.at("probings.csv");
    let timed = |lag: &str| {
        let arguments = [
            "simulate",
            "probings",
            &machine,
            &errors,
            "--artefact",
            &artefact,
        ];
        let more = ["--plan", &plan, "--noise", "1", "-o", &probed];
        let drift = ["--drift", "10,0,0", "--drift-lag", lag];
        answer(0, &[&arguments[..], &more, &drift].concat());
        let text = std::fs::read_to_string(&probed).unwrap();
        let timed = text.lines().enumerate().map(|(i, line)| match i {
            0 => format!("{line},time_s"),
            _ => format!("{line},{}", 30 * i),
        });
        folder.file("timed.csv", timed.collect::<Vec<_>>().join("\n"))
    };
    let exponential = [
        "identify",
        &machine,
        &timed("0.2"),
        "--model",
        "10",
        "--json",
    ];
    let found: serde_json::Value = serde_json::from_str(&answer(0, &exponential)).unwrap();
    let drift = &found["observed"]["drift"][0];
    let [moved, lag] = ["value", "time_constant_s"].map(|key| drift[key].as_f64().unwrap());
    assert!((moved - 10e-3).abs() < 1e-3, "{moved}");
    // Of a bend of 4 µm, 1 µm of noise in 168 rows leaves this much.
    assert!((lag - 0.2 * 5010.0).abs() < 300.0, "{lag}");
    let timed = timed("0");
    for model in ["10", "auto"] {
        let said = done(&format!("identify {machine} {timed} --model {model}"));
        let line = said
            .lines()
            .find(|line| line.contains("the artefact moved along x by"));
        let line = line.unwrap_or_else(|| panic!("{said}"));
        let moved: f64 = line.split(' ').find_map(|word| word.parse().ok()).unwrap();
        assert!(
            (moved - 10.0).abs() < 1.0 && line.ends_with("in 5010 s"),
            "{line}"
        );
        // It is not tested once more.
        assert!(!said.contains("drift over"), "{said}");
    }
}

#[test]
fn a_part_that_the_machine_has_cut_shows_its_errors() {
    let folder = Folder::new();
    let [machine, errors, plan] =
        examples("kolibri", ["machine.toml", "errors-10.toml", "part.csv"]);
    let (measured, found) = (folder.at("measured.csv"), folder.at("errors.toml"));
    let simulate = ["simulate", "observations", &machine, &errors, "--plan"];
    answer(0, &[&simulate[..], &[&plan, "-o", &measured]].concat());
    let identify = [
        "identify", &machine, &measured, "--model", "10", "-o", &found,
    ];
    let said = plain(answer(0, &identify).as_bytes());
    assert!(said.contains("surfaces"), "{said}");
    let answered: serde_json::Value =
        serde_json::from_str(&answer(0, &[&identify[..], &["--json"]].concat())).unwrap();
    let parameters = answered["parameters"].as_array().unwrap();
    let truth = std::fs::read_to_string(&errors).unwrap();
    let mut compared = 0;
    for line in truth.lines() {
        let Some((name, value)) = line.split_once(" = ") else {
            continue;
        };
        let Some(one) = parameters.iter().find(|one| one["parameter"] == name) else {
            continue;
        };
        let value: f64 = value.parse().unwrap();
        let off = one["value"].as_f64().unwrap() - value;
        let uncertainty = one["standard_uncertainty"].as_f64().unwrap();
        // Ten values with one seed: chance exceeds this once in 1500 times.
        assert!(off.abs() < 4.0 * uncertainty, "{name}: {off} {uncertainty}");
        compared += 1;
    }
    assert_eq!(compared, 10, "{said}");
    let text = std::fs::read_to_string(&measured).unwrap();
    let longer = text.replacen("0,0,1,", "0,0,2,", 1);
    let nameless = text.replacen("normal_x", "time_s", 1);
    for (wrong, parts) in [
        (longer, ["the normal has the length 2.000", "of length 1"]),
        (
            nameless,
            [
                "needs the columns normal_x, normal_y and normal_z",
                "coordinates of the part",
            ],
        ),
    ] {
        assert_ne!(wrong, text);
        let wrong = folder.file("wrong.csv", wrong);
        refuses(&format!("identify {machine} {wrong} -o {found}"), &parts);
    }
}
