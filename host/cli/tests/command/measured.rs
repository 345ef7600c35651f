//! From runs of instruments to error files, and invalid runs.

use crate::program::{Folder, answer, example, plain, refused, trueaxis};

/// A simulated run of a laser along X of the mill.
fn laser(folder: &Folder, name: &str, more: &[&str]) -> String {
    let out = folder.at(name);
    let (machine, errors) = (
        example("mill-21/machine.toml"),
        example("mill-21/errors-21.toml"),
    );
    let mut arguments = vec![
        "simulate", "laser", &machine, &errors, "-o", &out, "--noise", "0.1",
    ];
    arguments.extend(more);
    answer(0, &arguments);
    out
}

const AT: [&str; 2] = ["--at", "Y=150,Z=-100"];

#[test]
fn what_was_measured_can_be_compiled() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let x = laser(&folder, "x.csv", &["--axis", "X", AT[0], AT[1]]);
    let pitch = laser(
        &folder,
        "pitch.csv",
        &["--axis", "X", "--reads", "tool +Z to +X"],
    );
    let yaw = laser(
        &folder,
        "yaw.csv",
        &["--axis", "X", "--reads", "tool +X to +Y"],
    );
    let (errors, blob) = (folder.at("errors.toml"), folder.at("mill.trax"));
    let said = answer(0, &["measured", &machine, &x, &pitch, &yaw, "-o", &errors]);
    for part in [
        "3 error motions and 0 squarenesses from 3 files",
        "EXX",
        "EBX",
        "ECX",
    ] {
        assert!(said.contains(part), "{said}");
    }
    answer(
        0,
        &[
            "compile", &machine, &errors, "-o", &blob, "--random", "1000",
        ],
    );
    // A second import keeps the result of the first.
    let straight = laser(
        &folder,
        "straight.csv",
        &["--axis", "X", "--reads", "tool +Y", AT[0], AT[1]],
    );
    let both = folder.at("both.toml");
    answer(
        0,
        &[
            "measured", &machine, &straight, "--update", &errors, "-o", &both,
        ],
    );
    let all = answer(
        0,
        &["measured", &machine, &x, &pitch, &yaw, &straight, "--json"],
    );
    let all: serde_json::Value = serde_json::from_str(&all).unwrap();
    let motions = all["motions"].as_array().unwrap();
    let motion = motions.iter().find(|m| m["motion"] == "EYX").unwrap();
    let expected = motion["positive"][3].as_f64().unwrap();
    let written = std::fs::read_to_string(&both).unwrap();
    for name in ["EXX", "EYX", "EBX", "ECX"] {
        assert!(
            written.contains(&format!("[tabulated.{name}]")),
            "{written}"
        );
    }
    let table = written.split("[tabulated.EYX]").nth(1).unwrap();
    let table = table.split("positive = [").nth(1).unwrap();
    let value: f64 = table.split(',').nth(3).unwrap().trim().parse().unwrap();
    // EYX is the same whether the yaw was known before or is measured with it. An error file resolves 1e-6 µm and
    // µrad, the latter with a lever of 0.5 m.
    assert!((value - expected).abs() < 2e-6, "{value} is not {expected}");
}

#[test]
fn levers_that_are_not_known_are_told() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let x = laser(&folder, "x.csv", &["--axis", "X", AT[0], AT[1]]);
    let output = trueaxis(&["measured", &machine, &x]);
    assert_eq!(output.status.code(), Some(0));
    let said = plain(&output.stderr);
    for part in [
        "EBX is not known",
        "in EXX, with a lever of 200 mm",
        "ECX is not known",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn iso_230_2_is_printed_and_imported() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let head = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n";
    let x = folder.file(
        "x.csv",
        format!("{head}target,+1,-1,+2,-2\n0,0,-2,0,-2\n100,3,1,5,1\n"),
    );
    let errors = folder.at("errors.toml");
    let said = answer(
        0,
        &["iso230-2", &machine, &x, "-o", &errors, "--one-number"],
    );
    for part in ["accuracy A", "repeatability R", "mean reversal value"] {
        assert!(said.contains(part), "{said}");
    }
    let json = answer(0, &["iso230-2", &machine, &x, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json[0]["reversal"], 3.0);
    assert_eq!(json[0]["mean_reversal"], 2.5);
    let written = std::fs::read_to_string(&errors).unwrap();
    assert!(written.contains("EXXb = 1.25"), "{written}");
    assert!(written.contains("value = ["), "{written}");
    let straight = folder.file(
        "y.csv",
        head.replace("tool +X", "tool +Y") + "target,+1\n0,0\n1,1\n",
    );
    refused(
        &["iso230-2", &machine, &straight],
        &["not the position of the axis", "trueaxis measured"],
    );
}

#[test]
fn simulated_runs_and_circles_are_written() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let errors = folder.file(
        "errors.toml",
        "machine = \"Router\"\n[parameters]\nEXX1 = 100e-6\nEXXb = 2e-3\n",
    );
    let circle = answer(
        0,
        &[
            "simulate",
            "ballbar",
            &machine,
            &errors,
            "--plane",
            "XY",
            "--at",
            "X=400,Y=600",
            "--readings",
            "8",
            "--radius",
            "200",
        ],
    );
    // R·EXX1·cos²φ, and ±2 µm of backlash, measured in X: after negative travel at φ = 45° counter-clockwise.
    let rows: Vec<&str> = circle
        .lines()
        .filter(|line| !line.starts_with('#'))
        .collect();
    assert_eq!(rows[0], "angle,ccw,cw");
    assert_eq!(rows[3], "90,0.0000,0.0000");
    let at_45: Vec<f64> = rows[2].split(',').map(|v| v.parse().unwrap()).collect();
    let half = 0.5_f64.sqrt();
    assert!((at_45[1] - (10.0 - 2.0 * half)).abs() < 1e-3, "{circle}");
    assert!((at_45[2] - (10.0 + 2.0 * half)).abs() < 1e-3, "{circle}");
    // The same seed gives the same noise.
    let run = |seed: &str| {
        answer(
            0,
            &[
                "simulate", "laser", &machine, &errors, "--axis", "X", "--noise", "1", "--seed",
                seed,
            ],
        )
    };
    assert_eq!(run("1"), run("1"));
    assert_ne!(run("1"), run("2"));
    let square = answer(
        0,
        &[
            "simulate",
            "square",
            &machine,
            &errors,
            "--lines",
            "X,Y",
            "--targets",
            "3",
        ],
    );
    assert!(square.contains("line,target,+1,-1"), "{square}");
    for (arguments, parts) in [
        (
            &["ballbar", "--plane", "XQ"][..],
            ["no two linear axes", "--plane XY"],
        ),
        (
            &["ballbar", "--plane", "XY"],
            ["the circle needs", "another centre"],
        ),
        (&["laser", "--axis", "Q"], ["no axis `Q`", "axes Y X Z"]),
        (
            &["laser", "--axis", "X", "--reads", "+X"],
            ["does not begin with tool or workpiece", "tool +X"],
        ),
        (
            &["laser", "--axis", "X", "--at", "Y"],
            ["`Y` is not an axis", "like Y=0,X=0,Z=0"],
        ),
        (
            &["laser", "--axis", "X", "--to", "900"],
            ["X = 810 is outside the travel", "targets in mm"],
        ),
        (&["square", "--lines", "X"], ["two axes", "--lines X,Y"]),
    ] {
        let mut all = vec!["simulate", arguments[0], &machine, &errors];
        all.extend(&arguments[1..]);
        refused(&all, &parts);
    }
}

#[test]
fn files_that_do_not_say_how_it_was_measured_are_refused() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let out = folder.at("errors.toml");
    let head = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n";
    let rows = "target,+1,-1\n0,0,0\n100,1,1\n";
    let with = |from: &str, to: &str| {
        assert!(head.contains(from));
        head.replace(from, to) + rows
    };
    let square = "# reads_along = { X = \"tool +Y\", Y = \"tool +X\" }\n# unit = \"um\"\n# at = { X = 0, Y = 0, Z = 0 }\n\
                  line,target,+1\nX,0,0\nX,100,3\nY,0,0\nY,100,0\n";
    for (text, parts) in [
        (String::new(), ["does not say `axis`", "begin it with"]),
        (rows.to_owned(), ["does not say `axis`", "# axis"]),
        (
            with("# axis = \"X\"\n", ""),
            ["does not say `axis`", "# axis"],
        ),
        (
            with("# reads = \"tool +X\"\n", ""),
            ["does not say `reads`", "# reads"],
        ),
        (
            with("# unit = \"um\"\n", ""),
            ["does not say `unit`", "# unit"],
        ),
        (
            with("\"X\"", "\"Q\""),
            ["line 1: the machine has no axis `Q`", "axes Y X Z"],
        ),
        (
            with("\"tool +X\"", "\"+X\""),
            [
                "line 2: `+X` does not begin with tool or workpiece",
                "tool or workpiece",
            ],
        ),
        (
            with("\"tool +X\"", "\"tool X\""),
            ["`X` has no sign", "tool +C"],
        ),
        (
            with("\"tool +X\"", "\"tool +C\""),
            ["no axis `C`", "tool +C"],
        ),
        (
            with("\"tool +X\"", "\"tool é\""),
            ["has no sign", "tool +C"],
        ),
        (
            with("\"tool +X\"", "\"tool +X to +X\""),
            ["does not turn from one linear axis", "tool +Y to +Z"],
        ),
        (
            with("\"um\"", "\"urad\""),
            ["line 3: `urad` is not a unit of length", "mm, um or in"],
        ),
        (with("Y = 0, Z = 0", "Y = 0"), ["where Z stood", "add Z"]),
        (
            with("Y = 0, Z = 0", "X = 0, Y = 0, Z = 0"),
            ["X is the axis that moves", "other axes"],
        ),
        (
            with("Z = 0", "Z = 50"),
            [
                "Z = 50 is outside the travel of -150 to 0",
                "correct the position",
            ],
        ),
        (
            with("# axis", "# axes"),
            ["line 1: unknown field `axes`", "how it was measured"],
        ),
        (
            with("# axis = \"X\"", "# axis = \"X\"\n# machine = \"Mill\""),
            ["measured on `Mill`", "machine file"],
        ),
        (
            with("# unit", "# slope = \"keep\"\n# unit"),
            ["only a straightness has a slope", "leave out"],
        ),
        (
            with("# unit", "# square_urad = 3\n# unit"),
            ["only a square", "leave out"],
        ),
        (
            with("# unit", "# offset_mm = [0, 0]\n# unit"),
            ["2 numbers, where 3 are expected", "how it was"],
        ),
        (
            head.to_owned(),
            ["nothing follows the lines with #", "target,+1"],
        ),
        (
            format!("{head}target\n0\n"),
            ["the header has no column for a run", "target,+1"],
        ),
        (
            format!("{head}target,run1\n0,1\n"),
            [
                "column 2: `run1` is not a run with a direction",
                "direction of travel",
            ],
        ),
        (
            format!("{head}target;+1\n0;1\n"),
            ["separated by semicolons", "commas"],
        ),
        (
            format!("{head}target,+1\n0,1\n"),
            ["1 targets, not at least two", "each target"],
        ),
        (
            format!("{head}target,+1\n0,1\n10,1,2\n"),
            [
                "line 7: the row has 3 columns, the header has 2",
                "every run",
            ],
        ),
        (
            format!("{head}target,+1\n0,1\n10,\n"),
            ["line 7: column 2 (+1): the value is missing", "every run"],
        ),
        (
            format!("{head}target,+1\n0,1\n10,inf\n"),
            ["column 2 (+1): `inf` is not a finite number", "every run"],
        ),
        (
            format!("{head}target,+1\n10,1\n0,1\n"),
            [
                "line 7: column 1 (target): the values must increase, but 0 follows 10",
                "sort",
            ],
        ),
        (
            format!("{head}target,+1\n0,1\n1000,1\n"),
            ["X = 1000 is outside the travel of 0 to 800", "machine file"],
        ),
        (
            format!("{head}target,+1\n0,0\n700,700000\n"),
            ["too large for an error of a machine", "check the unit"],
        ),
        (
            square.replace("\nX,0", "\nZ,0"),
            ["`Z` is not a line of this square", "reads_along"],
        ),
        (
            square.replace("Y,100,0\n", ""),
            ["Y has 1 targets", "each target"],
        ),
        (
            square.replace("Y = \"tool +X\"", "Y = \"tool +Z\""),
            ["the direction of the other", "tool +Y"],
        ),
        (
            square.replace(", Y = \"tool +X\"", ""),
            ["two lines, not 1", "reads_along"],
        ),
        (
            square.replace("# unit", "# axis = \"X\"\n# unit"),
            ["no other axis", "keep reads_along"],
        ),
    ] {
        let file = folder.file("runs.csv", &text);
        refused(&["measured", &machine, &file, "-o", &out], &parts);
    }
    assert!(!folder.names().contains(&"errors.toml".to_owned()));
    let file = folder.file("runs.csv", head.to_owned() + rows);
    refused(
        &["measured", &machine, &file, &file],
        &["EXX was measured more than once", "--update"],
    );
    refused(
        &["measured", &machine, &file, "-o", &file],
        &["is the input", "another name"],
    );
    let thermal = folder.file(
        "old.toml",
        "machine = \"Router\"\n[thermal]\nEXX1 = { per_kelvin = 1e-5, sensor = \"bed\", reference_celsius = 20.0 }\n",
    );
    refused(
        &["measured", &machine, &file, "--update", &thermal],
        &["thermal changes cannot be kept", "without --update"],
    );
}

/// A radial error of a table shows as two motions that rotate with it.
#[test]
fn what_one_reading_mixes_is_refused() {
    let folder = Folder::new();
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let radial = |reads: &str| {
        format!(
            "# axis = \"C\"\n# reads = \"tool {reads}\"\n# unit = \"um\"\n# at = {{ X = 0, Y = 0, Z = 0, A = 0 }}\n\
             target,+1\n0,0\n90,1\n180,2\n"
        )
    };
    let x = folder.file("x.csv", radial("+X"));
    let y = folder.file("y.csv", radial("+Y"));
    refused(
        &["measured", &machine, &x],
        &["EXC, EYC cannot be distinguished", "in other directions"],
    );
    let said = answer(0, &["measured", &machine, &x, &y]);
    assert!(said.contains("EXC") && said.contains("EYC"), "{said}");
    let other = folder.file("other.csv", radial("+Y").replace("90,1", "45,1"));
    refused(
        &["measured", &machine, &x, &other],
        &[
            "targets or directions of travel are not the same",
            "at the same targets",
        ],
    );
}

#[test]
fn positions_are_no_deviations_but_can_be_read_as_positions() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let file = |more: &str, scale: f64| {
        let mut text = format!(
            "# axis = \"X\"\n# reads = \"tool +X\"\n{more}\n# at = {{ Y = 150.0, Z = -100.0 }}\ntarget,+1,-1\n"
        );
        for target in 0..4 {
            let read = f64::from(30 * target) * (1.0 + 0.021 / 90.0);
            text += &format!(
                "{},{:.12},{:.12}\n",
                30 * target,
                read * scale,
                (read + 0.001) * scale
            );
        }
        folder.file("x.csv", text)
    };
    let out = folder.at("errors.toml");
    for (unit, scale) in [("mm", 1.0), ("um", 1.0), ("in", 1.0 / 25.4)] {
        let raw = file(&format!("# unit = \"{unit}\""), scale);
        let parts = [
            "they are positions, not deviations",
            "say # reads_position = true",
        ];
        refused(&["measured", &machine, &raw, "-o", &out], &parts);
    }
    // Deviations of 9 mm at targets 30 mm apart are in another unit.
    let wide = file("# unit = \"mm\"", 0.4);
    refused(
        &["measured", &machine, &wide, "-o", &out],
        &["differ by more than a step between targets", "correct unit"],
    );
    for (unit, scale) in [("mm", 1.0), ("in", 1.0 / 25.4)] {
        let read = file(
            &format!("# unit = \"{unit}\"\n# reads_position = true"),
            scale,
        );
        answer(0, &["measured", &machine, &read, "-o", &out]);
        let errors = std::fs::read_to_string(&out).unwrap();
        // 21 µm at 90 mm, and 1 µm of reversal around zero; X carries the workpiece and is reversed.
        assert!(
            errors.contains("positive = [\n    0.5, -6.5, -13.5, -20.5,"),
            "{errors}"
        );
        assert!(
            errors.contains("negative = [\n    -0.5, -7.5, -14.5, -21.5,"),
            "{errors}"
        );
    }
}

/// A file of a laser along X of the Kolibri.
fn runs(unit: &str, readings: [[f64; 2]; 3]) -> String {
    let rows = [-80.0, 0.0, 80.0].iter().zip(readings);
    let rows: String = rows
        .map(|(t, [up, down])| format!("{t},{up},{down}\n"))
        .collect();
    format!(
        "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"{unit}\"\n\
         # at = {{ Y = 0.0, Z = 100.0, A = 0.0, C = 0.0 }}\ntarget,+1,-1\n{rows}"
    )
}

#[test]
fn readings_in_another_unit_are_named() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let said = |text: &str| {
        let file = folder.file("x.csv", text);
        let output = trueaxis(&["measured", &machine, &file]);
        plain(&output.stderr)
    };
    let deviations = [[0.1, -0.4], [2.2, 1.3], [5.1, 4.0]];
    let by = |factor: f64| deviations.map(|pair| pair.map(|v| v * factor));
    let good = said(&runs("um", by(1.0)));
    assert!(!good.contains("the readings of X"), "{good}");
    let mm = said(&runs("mm", by(1.0)));
    assert!(
        mm.contains("vary by 5500 µm: no working machine does that"),
        "{mm}"
    );
    let um = said(&runs("um", by(1e-3)));
    assert!(
        um.contains("a unit a thousand times larger they would vary by 5.50 µm"),
        "{um}"
    );
}

#[test]
fn readings_that_repeat_better_than_any_machine_are_named() {
    // 120 µm over the travel, in mm that are declared µm: more than the resolution of an instrument.
    let text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n\
                # at = { Y = 0.0, Z = 100.0, A = 0.0, C = 0.0 }\ntarget,+1,-1,+2,-2\n\
                -80,0.0001,-0.0004,0.0008,0.0002\n0,0.0601,0.0594,0.0606,0.0599\n80,0.1204,0.1198,0.1197,0.1205\n";
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let said = |command: &str, unit: &str| {
        let file = folder.file("x.csv", text.replace("um", unit));
        plain(&trueaxis(&[command, &machine, &file]).stderr)
    };
    for command in ["measured", "iso230-2"] {
        let found = said(command, "um");
        assert!(
            found.contains("the readings of X differ from run to run by 0.000")
                && found.contains("in a unit a thousand times larger they would differ by 0."),
            "{command}: {found}"
        );
        let good = said(command, "mm");
        assert!(!good.contains("the readings of X"), "{command}: {good}");
    }
}

#[test]
fn readings_that_are_zero_everywhere_are_named() {
    let folder = Folder::new();
    let file = folder.file("x.csv", runs("um", [[0.0, 0.0]; 3]));
    let said = plain(&trueaxis(&["measured", &example("kolibri/machine.toml"), &file]).stderr);
    let parts = [
        "the readings of X are 0.0000 µm everywhere: no machine is as good",
        "look whether the instrument was read",
    ];
    for part in parts {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn the_sign_of_readings_is_said_because_nothing_shows_it() {
    let folder = Folder::new();
    let file = folder.file("x.csv", runs("um", [[0.1, -0.4], [2.2, 1.3], [5.1, 4.0]]));
    let output = trueaxis(&["measured", &example("kolibri/machine.toml"), &file]);
    let said = plain(&output.stdout);
    assert!(said.contains("signs are as stated"), "{said}");
}

#[test]
fn a_travel_that_is_shorter_than_the_tool_is_named() {
    let folder = Folder::new();
    let axes: String = ["X", "Y", "Z"]
        .iter()
        .map(|name| {
            format!("[[axis]]\nname = \"{name}\"\nbranch = \"tool\"\nrange = [-0.2, 0.2]\n")
        })
        .collect();
    let machine = format!(
        "name = \"m\"\n{axes}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -100.0]\n"
    );
    let machine = folder.file("machine.toml", machine);
    let text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0.0, Z = 0.0 }\n\
                target,+1,-1\n-0.1,0.1,-0.4\n0.1,2.2,1.3\n";
    let file = folder.file("x.csv", text);
    let said = plain(&trueaxis(&["measured", &machine, &file]).stderr);
    assert!(
        said.contains("X travels 0.400 mm") && said.contains("looks like metres"),
        "{said}"
    );
}

#[test]
fn an_evaluation_needs_no_place_and_says_if_it_is_not_to_the_standard() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let text = runs("um", [[0.1, -0.4], [2.2, 1.3], [5.1, 4.0]]);
    let text: String = (text.lines().filter(|line| !line.starts_with("# at")))
        .map(|line| format!("{line}\n"))
        .collect();
    let file = folder.file("x.csv", text);
    let said = answer(0, &["iso230-2", &machine, &file]);
    assert!(
        said.contains(
            "not to ISO 230-2: it asks for 5 runs in each direction, these are 1 ↑ and 1 ↓"
        ),
        "{said}"
    );
    // What is written depends on it.
    let errors = folder.at("errors.toml");
    refused(
        &["iso230-2", &machine, &file, "-o", &errors],
        &["does not say where"],
    );
    refused(&["measured", &machine, &file], &["does not say where"]);
}
