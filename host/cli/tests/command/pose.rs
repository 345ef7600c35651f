//! `pose` and `explain`, and unlikely machine descriptions.

use crate::program::{Folder, answer, example, plain, refused, trueaxis};
use serde_json::Value;

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&answer(0, arguments)).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let values = value.as_array().unwrap().iter();
    values.map(|v| v.as_f64().unwrap()).collect()
}

/// Calculated by hand: Kolibri at X = 10, A = 30. The tip is at (10, 0, −74) in the machine, and the table is turned
/// by +30° about x, so on the table y = −74·sin 30°, z = −74·cos 30°, and the tool leans to +y.
#[test]
fn pose_is_that_of_the_tip_seen_from_the_workpiece() {
    let machine = example("kolibri/machine.toml");
    let found = json(&["pose", &machine, "--at", "X=10,A=30", "--json"]);
    let pose = &found["poses"][0];
    let (s, c) = libm::sincos(30_f64.to_radians());
    let near = |found: &Value, expected: [f64; 3]| {
        for (found, expected) in numbers(found).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{pose}");
        }
    };
    near(&pose["nominal"]["tip"], [10.0, -74.0 * s, -74.0 * c]);
    near(&pose["nominal"]["direction"], [0.0, s, c]);
    assert!(pose["actual"].is_null());
    let axes = pose["axes"].as_array().unwrap();
    near(&axes[0]["direction"], [0.0, 1.0, 0.0]);
    near(&axes[2]["direction"], [0.0, -s, c]);
    let text = answer(0, &["pose", &machine, "--at", "x=10,A=30"]);
    assert!(text.contains("C  turns the workpiece about"), "{text}");
}

#[test]
fn the_direction_of_a_reversed_axis_is_that_of_its_carriage() {
    let machine = example("mill-21/machine.toml");
    let found = json(&["pose", &machine, "--json"]);
    let axes = &found["poses"][0]["axes"];
    assert_eq!(numbers(&axes[1]["direction"]), [-1.0, 0.0, 0.0]);
    assert_eq!(axes[1]["carries"], "workpiece");
    assert_eq!(numbers(&axes[2]["direction"]), [0.0, 0.0, 1.0]);
    // The tool still goes to +X.
    let at = json(&["pose", &machine, "--at", "X=100", "--json"]);
    assert_eq!(
        numbers(&at["poses"][0]["nominal"]["tip"]),
        [100.0, 0.0, -100.0]
    );
}

/// With the output of `correct`, the actual tool reaches the nominal position, except for what two rotary axes and
/// the second order leave.
#[test]
fn the_actual_pose_of_a_corrected_command_is_the_nominal_one() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let path = folder.file("p.csv", "X,Y,Z,A,C\n0,0,0,0,0\n10,-20,30,-40,50\n");
    let found = json(&["pose", &machine, &errors, "--positions", &path, "--json"]);
    let corrections = answer(0, &["correct", &machine, &errors, "--positions", &path]);
    let dq: Vec<f64> = corrections
        .lines()
        .nth(2)
        .unwrap()
        .split(',')
        .map(|v| v.parse().unwrap())
        .collect();
    let order = numbers(&found["poses"][1]["position"]);
    let at: Vec<String> = "YACXZ"
        .chars()
        .zip(order.iter().zip(&dq))
        .map(|(l, (q, d))| format!("{l}={}", q + d))
        .collect();
    let corrected = folder.file(
        "c.csv",
        format!(
            "Y,A,C,X,Z\n0,0,0,0,0\n{}\n",
            at.iter().map(|a| &a[2..]).collect::<Vec<_>>().join(",")
        ),
    );
    let corrected = json(&[
        "pose",
        &machine,
        &errors,
        "--positions",
        &corrected,
        "--json",
    ]);
    let nominal = numbers(&found["poses"][1]["nominal"]["tip"]);
    let before = numbers(&found["poses"][1]["actual"]["tip"]);
    let after = numbers(&corrected["poses"][1]["actual"]["tip"]);
    for i in 0..3 {
        // Corrections are printed to 1e-10 mm and degrees.
        assert!(
            (after[i] - nominal[i]).abs() < 1e-7,
            "{after:?} {nominal:?}"
        );
    }
    assert!((before[0] - nominal[0]).abs() > 1e-3);
}

#[test]
fn poses_of_many_positions_are_a_csv_file() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let path = folder.file("p.csv", "X,Y,Z\n1,2,-3\n4,5,6\n");
    let output = trueaxis(&["pose", &machine, "--positions", &path]);
    assert_eq!(
        String::from_utf8(output.stdout).unwrap(),
        "x,y,z,i,j,k\n\
         1.0000000,2.0000000,-63.0000000,0.0000000000,0.0000000000,1.0000000000\n\
         4.0000000,5.0000000,-54.0000000,0.0000000000,0.0000000000,1.0000000000\n"
    );
    assert!(plain(&output.stderr).contains("Z is outside its travel"));
    let errors = example("router/errors-10.toml");
    let out = folder.at("poses.csv");
    let said = answer(
        0,
        &["pose", &machine, &errors, "--positions", &path, "-o", &out],
    );
    assert!(said.ends_with("poses of 2 positions\n"), "{said}");
    let written = std::fs::read_to_string(out).unwrap();
    assert!(written.starts_with("x,y,z,i,j,k,actual x,"), "{written}");
    assert!(written.lines().all(|line| line.split(',').count() == 12));
}

#[test]
fn a_bad_position_is_refused() {
    let machine = example("router/machine.toml");
    for (at, cause) in [
        ("A=3", "--at: the machine has no axis `A`"),
        ("X", "--at: `X` is not an axis"),
        ("X=1,x=2", "--at: axis x is given twice"),
        ("X=1,5,Y=2", "--at: `5` has no axis: write a decimal point"),
        ("X=one", "--at: `one` is not a finite number"),
    ] {
        refused(
            &["pose", &machine, "--at", at],
            &[cause, "like Y=0,X=0,Z=0"],
        );
    }
}

/// The warnings for the Kolibri with `from` replaced by `to`.
fn warned(from: &str, to: &str) -> String {
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("kolibri/machine.toml")).unwrap();
    assert!(text.contains(from));
    let machine = folder.file("machine.toml", text.replacen(from, to, 1));
    let output = trueaxis(&["pose", &machine]);
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    said
}

#[test]
fn what_is_hardly_meant_is_warned_of_with_its_line() {
    for (from, to, line, cause) in [
        (
            "[-120.0, 120.0]",
            "[-2.09, 2.09]",
            16,
            "the travel of axis A is 4.18 degrees in all, which looks like radians",
        ),
        (
            "branch = \"workpiece\"\nrange = [-120.0",
            "branch = \"workpiece\"\norientation_deg = [0.0, 0.0, 0.7854]\nrange = [-120.0",
            16,
            "the orientation of axis A has 0.7854 degrees, which looks like radians: 45.0 degrees",
        ),
        (
            "axis = \"z\"",
            "axis = \"z\"\norientation_deg = [0.0, -1.57, 0.0]",
            35,
            "the orientation of the spindle has -1.57 degrees",
        ),
        (
            "[0.0, 0.0, -74.0]",
            "[0.0, 0.0, -0.074]",
            37,
            "the tip is 0.074 mm from the spindle frame",
        ),
        (
            "[0.0, 0.0, -74.0]",
            "[0.0, -74.0, 0.0]",
            37,
            "the tip is 74.000 mm off the tool axis z",
        ),
    ] {
        let said = warned(from, to);
        let place = format!("machine.toml, line {line}: {cause}");
        assert!(said.contains(&place), "`{place}` is not in:\n{said}");
    }
    // Intended values: a tilt of 5.5 degrees, a narrow travel in degrees.
    for to in [
        "[-120.0, 120.0]\norientation_deg = [5.5, -45.0, 0.0]",
        "[-4.0, 4.0]",
    ] {
        assert_eq!(warned("[-120.0, 120.0]", to), "");
    }
}

#[test]
fn no_example_is_doubted() {
    let mut count = 0;
    for folder in std::fs::read_dir(example("")).unwrap() {
        for file in std::fs::read_dir(folder.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            if name.starts_with("machine") {
                let output = trueaxis(&["pose", path.to_str().unwrap()]);
                let said = plain(&output.stderr);
                // Some machines do not have zero in their travels.
                assert!(
                    !said.contains("looks like") && !said.contains("the tip is"),
                    "{said}"
                );
                assert_eq!(output.status.code(), Some(0));
                count += 1;
            }
        }
    }
    assert!(count >= 10, "{count}");
}

#[test]
fn a_missing_spindle_is_refused_with_the_axis_of_the_tip() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("kolibri/machine.toml")).unwrap();
    let text = text
        .replace("[spindle]\naxis = \"z\"\n", "")
        .replace("[0.0, 0.0, -74.0]", "[0.0, 74.0, 1.0]");
    let machine = folder.file("machine.toml", text);
    refused(
        &["pose", &machine],
        &["the machine has no [spindle]", "axis = \"y\""],
    );
}

/// Every reading of `explain` in JSON equals the displacement that `pose` shows between the same two commands: how
/// far the tool has gone too far in the direction of a positive command.
#[test]
fn explain_reads_what_pose_shows() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEXX1 = 20e-6\n",
    );
    let found = json(&["explain", &machine, &errors, "--json"]);
    let explained = &found["explained"][0];
    assert_eq!(explained["parameter"], "EXX1");
    assert_eq!(explained["kind"], "parameter");
    assert_eq!(explained["changes_nothing"], false);
    let shown = &explained["shown"];
    assert_eq!(shown["instrument"], "laser");
    assert_eq!(shown["reads_in"], "X");
    assert_eq!(shown["unit"], "µm");
    let x = |which: &str, at: &Value| {
        let at: Vec<String> = "YXZ"
            .chars()
            .zip(numbers(at))
            .map(|(l, q)| format!("{l}={q}"))
            .collect();
        let posed = json(&["pose", &machine, &errors, "--at", &at.join(","), "--json"]);
        numbers(&posed["poses"][0][which]["tip"])[0]
    };
    let went = |which: &str| x(which, &shown["to"]) - x(which, &shown["from"]);
    let reading = (went("actual") - went("nominal")) * 1e3;
    assert!((reading - shown["reading"].as_f64().unwrap()).abs() < 1e-9);
    assert!((reading + 2.0).abs() < 1e-9);
}

#[test]
fn explain_names_the_parameter_that_is_meant() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Router\"\n[parameters]\nEC0Y = 30e-6\n",
    );
    let machine = example("router/machine.toml");
    let found = json(&["explain", &machine, &errors, "--json"]);
    let explained = &found["explained"][0];
    assert_eq!(explained["changes_nothing"], true);
    assert_eq!(explained["meant"], serde_json::json!(["EC0X"]));
    assert!(explained["shown"].is_null());
}

#[test]
fn explain_tells_tables_reversal_and_temperatures_apart() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Router\"\n[thermal]\nEXX1 = { per_kelvin = 11.5e-6, sensor = \"bed\", reference_celsius = 20.0 }\n\
         [tabulated.EYY]\nat = [0.0, 500.0]\npositive = [0.0, 0.010]\nnegative = [0.002, 0.010]\n",
    );
    let text = answer(0, &["explain", &example("router/machine.toml"), &errors]);
    assert_eq!(
        text,
        "the table EYY, Y carries the tool: a laser along Y reads +9.0 µm at +500 mm\n\
         the table EYY, between its two directions, Y carries the tool: a dial or laser along Y reads −2.0 µm after positive less after negative travel of Y, at 0 mm\n\
         EXX1 +11.5e-6 per K of bed, X carries the tool: 1 K warmer, a laser along X reads +1.2 µm at +100 mm\n\
         0 rotary and 3 linear axes have N = 4R + 2P + 6 = 12 independent constants: 3 location errors; the others set up workpiece and tool\n"
    );
}
