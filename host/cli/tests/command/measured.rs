//! From runs of instruments to error files, and invalid runs.

use crate::program::{Folder, plain};

/// Runs of a laser along X of the mill, with the options that say what it reads.
fn laser(folder: &Folder, name: &str, reads: &str) {
    let mill = "@mill-21/machine.toml @mill-21/errors-21.toml --axis X --noise 0.1";
    let mut words = folder.words(&format!("simulate laser {mill} -o %{name}"));
    match reads.contains(" to ") {
        true => words.extend(["--reads".to_owned(), reads.to_owned()]),
        false => words.extend(["--reads", reads, "--at", "Y=150,Z=-100"].map(str::to_owned)),
    }
    crate::program::answer(0, &words.iter().map(String::as_str).collect::<Vec<_>>());
}

#[test]
fn what_was_measured_can_be_compiled() {
    let folder = Folder::new();
    laser(&folder, "x.csv", "tool +X");
    laser(&folder, "pitch.csv", "tool +Z to +X");
    laser(&folder, "yaw.csv", "tool +X to +Y");
    let measured = "measured @mill-21/machine.toml";
    let three = "%x.csv %pitch.csv %yaw.csv";
    let said = folder.answer(&format!("{measured} {three} -o %errors.toml"));
    for part in [
        "3 error motions and 0 squarenesses from 3 files",
        "EXX",
        "EBX",
        "ECX",
    ] {
        assert!(said.contains(part), "{said}");
    }
    folder.answer("compile @mill-21/machine.toml %errors.toml -o %mill.trax --random 1000");
    // A second import keeps the result of the first.
    laser(&folder, "straight.csv", "tool +Y");
    folder.answer(&format!(
        "{measured} %straight.csv --update %errors.toml -o %both.toml"
    ));
    let all = folder.answer(&format!("{measured} {three} %straight.csv --json"));
    let all: serde_json::Value = serde_json::from_str(&all).unwrap();
    let motions = all["motions"].as_array().unwrap();
    let motion = motions.iter().find(|m| m["motion"] == "EYX").unwrap();
    let expected = motion["positive"][3].as_f64().unwrap();
    let written = folder.text("both.toml");
    for name in ["EXX", "EYX", "EBX", "ECX"] {
        let table = format!("[tabulated.{name}]");
        assert!(written.contains(&table), "{written}");
    }
    let table = written.split("[tabulated.EYX]").nth(1).unwrap();
    let table = table.split("positive = [").nth(1).unwrap();
    let value: f64 = table.split(',').nth(3).unwrap().trim().parse().unwrap();
    // EYX is the same whether the yaw was known before or is measured with it. An error file resolves 1e-6 µm and
    // µrad, the latter with a lever of 0.5 m.
    assert!((value - expected).abs() < 2e-6, "{value} is not {expected}");
}

#[test]
fn an_update_keeps_what_is_not_known() {
    let folder = Folder::new();
    laser(&folder, "x.csv", "tool +X");
    let old = "machine = \"Mill with 21 errors\"\n[parameters]\nEC0Y = 3e-5\nEYY1 = 2e-5\n[standard_uncertainty]\n\
               EC0Y = 1e-6\nEYY1 = 1e-6\n[uncertainty]\nmisfit_um = 20.0\n[unseen]\nEXX1 = 5.0\nEYX2 = 10.0\n\
               [calibrated]\nY = [50.0, 200.0]\nZ = [-250.0, -100.0]\n";
    folder.file("old.toml", old);
    folder.answer("measured @mill-21/machine.toml %x.csv --update %old.toml -o %new.toml");
    let new = folder.text("new.toml");
    let kept = [
        "misfit_um = 20.000",
        "EYX2 = 10.0",
        "Y = [50.0, 200.0]",
        "Z = [-250.0, -100.0]",
        "[tabulated.EXX]",
    ];
    for part in kept {
        assert!(new.contains(part), "{part}: {new}");
    }
    // It is measured now.
    assert!(!new.contains("EXX1"), "{new}");
}

#[test]
fn runs_alone_give_no_upper_bound_of_the_tip() {
    let folder = Folder::new();
    laser(&folder, "x.csv", "tool +X");
    folder.answer("measured @mill-21/machine.toml %x.csv -o %errors.toml");
    let said =
        folder.answer("compile @mill-21/machine.toml %errors.toml -o %mill.trax --random 1000");
    assert!(!said.contains("no more than"), "{said}");
    assert!(
        said.contains("Errors that are not in the error file are not in these figures"),
        "{said}"
    );
}

#[test]
fn levers_that_are_not_known_are_told() {
    let folder = Folder::new();
    laser(&folder, "x.csv", "tool +X");
    let output = folder.run("measured @mill-21/machine.toml %x.csv");
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
    folder.file(
        "x.csv",
        format!("{HEAD}target,+1,-1,+2,-2\n0,0,-2,0,-2\n100,3,1,5,1\n"),
    );
    let iso = "iso230-2 @router/machine.toml";
    let said = folder.answer(&format!("{iso} %x.csv -o %errors.toml --one-number"));
    for part in ["accuracy A", "repeatability R", "mean reversal value"] {
        assert!(said.contains(part), "{said}");
    }
    let json = folder.answer(&format!("{iso} %x.csv --json"));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json[0]["reversal"], 3.0);
    assert_eq!(json[0]["mean_reversal"], 2.5);
    let written = folder.text("errors.toml");
    assert!(written.contains("EXXb = 1.25"), "{written}");
    assert!(written.contains("value = ["), "{written}");
    let straight = HEAD.replace("tool +X", "tool +Y") + "target,+1\n0,0\n1,1\n";
    folder.file("y.csv", straight);
    let parts = ["not the position of the axis", "trueaxis measured"];
    folder.refused(&format!("{iso} %y.csv"), &parts);
}

#[test]
fn simulated_runs_and_circles_are_written() {
    let folder = Folder::new();
    let errors = "machine = \"Router\"\n[parameters]\nEXX1 = 100e-6\nEXXb = 2e-3\n";
    folder.file("errors.toml", errors);
    let router = "@router/machine.toml %errors.toml";
    let circle = folder.answer(&format!(
        "simulate ballbar {router} --plane XY --at X=400,Y=600 --readings 8 --radius 200"
    ));
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
    let run = |seed: u32| {
        let noise = format!("--axis X --noise 1 --seed {seed}");
        folder.answer(&format!("simulate laser {router} {noise}"))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
    let square = folder.answer(&format!("simulate square {router} --lines X,Y --targets 3"));
    assert!(square.contains("line,target,+1,-1"), "{square}");
    for case in "\
        ballbar --plane XQ | no two linear axes | --plane XY
        ballbar --plane XY | the circle needs | another centre
        laser --axis Q | no axis `Q` | axes Y X Z
        laser --axis X --reads +X | does not begin with tool or workpiece | tool +X
        laser --axis X --at Y | `Y` is not an axis | like Y=0,X=0,Z=0
        laser --axis X --to 900 | X = 810 is outside the travel | targets in mm
        square --lines X | two axes | --lines X,Y"
        .lines()
    {
        let [options, parts @ ..] = cells::<3>(case);
        let (what, options) = options.split_once(' ').unwrap();
        folder.refused(&format!("simulate {what} {router} {options}"), &parts);
    }
}

const HEAD: &str =
    "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n";

/// The cells of a line of a table.
fn cells<const N: usize>(line: &str) -> [&str; N] {
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    cells.try_into().unwrap()
}

/// What is replaced in a file, by what (`ROWS` are all of its rows, `;` ends a line of the replacement), and what is said.
const BAD: &str = r##"
    # axis = "X";       |                           | does not say `axis` | # axis
    # reads = "tool +X";|                           | does not say `reads` | # reads
    # unit = "um";      |                           | does not say `unit` | # unit
    "X"                 | "Q"                       | line 1: the machine has no axis `Q` | axes Y X Z
    "tool +X"           | "+X"                      | line 2: `+X` does not begin with tool or workpiece | tool or workpiece
    "tool +X"           | "tool X"                  | `X` has no sign | tool +C
    "tool +X"           | "tool +C"                 | no axis `C` | tool +C
    "tool +X"           | "tool é"                  | has no sign | tool +C
    "tool +X"           | "tool +X to +X"           | does not turn from one linear axis | tool +Y to +Z
    "um"                | "urad"                    | line 3: `urad` is not a unit of length | mm, um or in
    Y = 0, Z = 0        | Y = 0                     | where Z stood | add Z
    Y = 0, Z = 0        | X = 0, Y = 0, Z = 0       | X is the axis that moves | other axes
    Z = 0               | Z = 50                    | Z = 50 is outside the travel of -150 to 0 | correct the position
    # axis              | # axes                    | line 1: unknown field `axes` | how it was measured
    # unit              | # machine = "Mill";# unit | measured on `Mill` | machine file
    # unit              | # slope = "keep";# unit   | only a straightness has a slope | leave out
    # unit              | # square_urad = 3;# unit  | only a square | leave out
    # unit              | # offset_mm = [0, 0];# unit | 2 numbers, where 3 are expected | how it was
    ROWS |                             | nothing follows the lines with # | target,+1
    ROWS | target;0;                   | the header has no column for a run | target,+1
    ROWS | target,+1,-1,-1;0,1,2,3;    | column 4: `-1` is there twice | its own number
    ROWS | target,run1;0,1;            | column 2: `run1` is not a run with a direction | direction of travel
    ROWS | target,+1;0,1;              | 1 targets, not at least two | each target
    ROWS | target,+1;0,1;10,1,2;       | line 7: the row has 3 columns, the header has 2 | every run
    ROWS | target,+1;0,1;10,;          | line 7: column 2 (+1): the value is missing | every run
    ROWS | target,+1;0,1;10,inf;       | column 2 (+1): `inf` is not a finite number | every run
    ROWS | target,+1;10,1;0,1;         | line 7: column 1 (target): the values must increase, but 0 follows 10 | sort
    ROWS | target,+1;0,1;1000,1;       | X = 1000 is outside the travel of 0 to 800 | machine file
    ROWS | target,+1;0,0;700,700000;   | too large for an error of a machine | check the unit"##;

/// Like `BAD`, of a square.
const BAD_SQUARES: &str = r##"
    X,0,0               | Z,0,0                     | `Z` is not a line of this square | reads_along
    Y,100,0;            |                           | Y has 1 targets | each target
    Y = "tool +X"       | Y = "tool +Z"             | the direction of the other | tool +Y
    , Y = "tool +X"     |                           | two lines, not 1 | reads_along
    # unit              | # axis = "X";# unit       | no other axis | keep reads_along"##;

#[test]
fn files_that_do_not_say_how_it_was_measured_are_refused() {
    let folder = Folder::new();
    let rows = "target,+1,-1\n0,0,0\n100,1,1\n";
    let measured = "measured @router/machine.toml %runs.csv";
    let refused = |text: &str, parts: &[&str]| {
        folder.file("runs.csv", text);
        folder.refused(&format!("{measured} -o %errors.toml"), parts);
    };
    refused("", &["does not say `axis`", "begin it with"]);
    refused(rows, &["does not say `axis`", "# axis"]);
    let semicolons = format!("{HEAD}target;+1\n0;1\n");
    refused(&semicolons, &["separated by semicolons", "commas"]);
    let line = format!("{HEAD}ROWS");
    let square = "# reads_along = { X = \"tool +Y\", Y = \"tool +X\" }\n# unit = \"um\"\n# at = { X = 0, Y = 0, Z = 0 }\n\
                  line,target,+1\nX,0,0\nX,100,3\nY,0,0\nY,100,0\n";
    for (good, cases) in [(line.as_str(), BAD), (square, BAD_SQUARES)] {
        for case in cases.lines().skip(1) {
            let [from, to, parts @ ..] = cells::<4>(case);
            let [from, to] = [from, to].map(|text| text.replace(';', "\n"));
            assert!(good.contains(&from), "{case}");
            let text = good.replace(&from, &to).replace("ROWS", rows);
            refused(&text, &parts);
        }
    }
    assert!(!folder.names().contains(&"errors.toml".to_owned()));
    folder.file("runs.csv", HEAD.to_owned() + rows);
    let twice = ["EXX was measured more than once", "--update"];
    folder.refused(&format!("{measured} %runs.csv"), &twice);
    let input = ["is the input", "another name"];
    folder.refused(&format!("{measured} -o %runs.csv"), &input);
    let thermal = "machine = \"Router\"\n[thermal]\nEXX1 = { per_kelvin = 1e-5, sensor = \"bed\", reference_celsius = 20.0 }\n";
    folder.file("old.toml", thermal);
    let kept = ["thermal changes cannot be kept", "without --update"];
    folder.refused(&format!("{measured} --update %old.toml"), &kept);
}

/// A radial error of a table shows as two motions that rotate with it.
#[test]
fn what_one_reading_mixes_is_refused() {
    let folder = Folder::new();
    let radial = |name: &str, reads: &str, middle: f64| {
        let text = format!(
            "# axis = \"C\"\n# reads = \"tool {reads}\"\n# unit = \"um\"\n# at = {{ X = 0, Y = 0, Z = 0, A = 0 }}\n\
             target,+1\n0,0\n{middle},1\n180,2\n"
        );
        folder.file(name, text);
    };
    radial("x.csv", "+X", 90.0);
    radial("y.csv", "+Y", 90.0);
    radial("other.csv", "+Y", 45.0);
    let measured = "measured @linuxcnc-xyzac-trt/machine.toml %x.csv";
    let mixed = ["EXC, EYC cannot be distinguished", "in other directions"];
    folder.refused(measured, &mixed);
    let said = folder.answer(&format!("{measured} %y.csv"));
    assert!(said.contains("EXC") && said.contains("EYC"), "{said}");
    let different = [
        "targets or directions of travel are not the same",
        "at the same targets",
    ];
    folder.refused(&format!("{measured} %other.csv"), &different);
}

#[test]
fn positions_are_no_deviations_but_can_be_read_as_positions() {
    let folder = Folder::new();
    let file = |more: &str, scale: f64| {
        let mut text = format!(
            "# axis = \"X\"\n# reads = \"tool +X\"\n{more}\n# at = {{ Y = 150.0, Z = -100.0 }}\ntarget,+1,-1\n"
        );
        for target in [0.0, 30.0, 60.0, 90.0] {
            let read = target * (1.0 + 0.021 / 90.0);
            let [up, down] = [read, read + 0.001].map(|read| read * scale);
            text += &format!("{target},{up:.12},{down:.12}\n");
        }
        folder.file("x.csv", text);
    };
    let measured = "measured @mill-21/machine.toml %x.csv -o %errors.toml";
    for (unit, scale) in [("mm", 1.0), ("um", 1.0), ("in", 1.0 / 25.4)] {
        file(&format!("# unit = \"{unit}\""), scale);
        let parts = [
            "they are positions, not deviations",
            "say # reads_position = true",
        ];
        folder.refused(measured, &parts);
    }
    // Deviations of 9 mm at targets 30 mm apart are in another unit.
    file("# unit = \"mm\"", 0.4);
    let wide = ["differ by more than a step between targets", "correct unit"];
    folder.refused(measured, &wide);
    for (unit, scale) in [("mm", 1.0), ("in", 1.0 / 25.4)] {
        let is_position = format!("# unit = \"{unit}\"\n# reads_position = true");
        file(&is_position, scale);
        folder.answer(measured);
        let errors = folder.text("errors.toml");
        // 21 µm at 90 mm, and 1 µm of reversal around zero; X carries the workpiece and is reversed.
        for values in [
            "positive = [\n    0.5, -6.5, -13.5, -20.5,",
            "negative = [\n    -0.5, -7.5, -14.5, -21.5,",
        ] {
            assert!(errors.contains(values), "{errors}");
        }
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

/// What is warned of and said of a file of the Kolibri.
fn said(command: &str, text: &str) -> String {
    let folder = Folder::new();
    folder.file("x.csv", text);
    let output = folder.run(&format!("{command} @kolibri/machine.toml %x.csv"));
    plain(&[&output.stderr[..], &output.stdout].concat())
}

const DEVIATIONS: [[f64; 2]; 3] = [[0.1, -0.4], [2.2, 1.3], [5.1, 4.0]];

#[test]
fn readings_in_another_unit_are_named_and_signs_because_nothing_shows_them() {
    let by = |factor: f64| DEVIATIONS.map(|pair| pair.map(|v| v * factor));
    let good = said("measured", &runs("um", by(1.0)));
    assert!(!good.contains("the readings of X"), "{good}");
    assert!(good.contains("signs are as stated"), "{good}");
    for (unit, factor, parts) in [
        (
            "mm",
            1.0,
            [
                "vary by 5500 µm: no working machine does that",
                "correct `unit`",
            ],
        ),
        (
            "um",
            1e-3,
            [
                "a unit a thousand times larger they would vary by 5.50 µm",
                "correct `unit`",
            ],
        ),
        (
            "um",
            0.0,
            [
                "the readings of X are 0.0000 µm everywhere: no machine is as good",
                "look whether the instrument was read",
            ],
        ),
    ] {
        let said = said("measured", &runs(unit, by(factor)));
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
}

#[test]
fn readings_that_repeat_better_than_any_machine_are_named() {
    // 120 µm over the travel, in mm that are declared µm: more than the resolution of an instrument.
    let text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n\
                # at = { Y = 0.0, Z = 100.0, A = 0.0, C = 0.0 }\ntarget,+1,-1,+2,-2\n\
                -80,0.0001,-0.0004,0.0008,0.0002\n0,0.0601,0.0594,0.0606,0.0599\n80,0.1204,0.1198,0.1197,0.1205\n";
    for command in ["measured", "iso230-2"] {
        let found = said(command, text);
        for part in [
            "the readings of X differ from run to run by 0.000",
            "in a unit a thousand times larger they would differ by 0.",
        ] {
            assert!(found.contains(part), "{command}: {found}");
        }
        let good = said(command, &text.replace("um", "mm"));
        assert!(!good.contains("the readings of X"), "{command}: {good}");
    }
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
    folder.file("machine.toml", machine);
    let text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0.0, Z = 0.0 }\n\
                target,+1,-1\n-0.1,0.1,-0.4\n0.1,2.2,1.3\n";
    folder.file("x.csv", text);
    let said = plain(&folder.run("measured %machine.toml %x.csv").stderr);
    for part in ["X travels 0.400 mm", "looks like metres"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn an_evaluation_needs_no_place_and_says_if_it_is_not_to_the_standard() {
    let folder = Folder::new();
    let text = runs("um", DEVIATIONS);
    let text: String = (text.lines().filter(|line| !line.starts_with("# at")))
        .map(|line| format!("{line}\n"))
        .collect();
    folder.file("x.csv", text);
    let said = folder.answer("iso230-2 @kolibri/machine.toml %x.csv");
    let reason = "not to ISO 230-2: it asks for 5 runs in each direction, these are 1 ↑ and 1 ↓";
    assert!(said.contains(reason), "{said}");
    // What is written depends on it.
    for line in [
        "iso230-2 @kolibri/machine.toml %x.csv -o %errors.toml",
        "measured @kolibri/machine.toml %x.csv",
    ] {
        folder.refused(line, &["does not say where"]);
    }
}
