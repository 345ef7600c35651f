//! Common slips: the message names the line and says what to write instead.

use crate::program::{Folder, answer, example, plain, refused, trueaxis};

/// Checks that `explain` for the Kolibri refuses `body`, after its name, at `line`.
fn refuses(body: &str, line: usize, cause: &str, remedy: &str) {
    let folder = Folder::new();
    let errors = folder.file("errors.toml", format!("machine = \"Kolibri\"\n{body}\n"));
    let place = format!("errors.toml, line {line}:");
    refused(
        &["explain", &example("kolibri/machine.toml"), &errors],
        &[&place, cause, remedy],
    );
}

#[test]
fn decimal_commas_in_a_file_are_told() {
    refuses(
        "[parameters]\nEXX1 = 1,5e-5",
        3,
        "unexpected",
        "write a decimal point, not a comma",
    );
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("kolibri/machine.toml")).unwrap();
    let text = text.replace("[-210.0, 210.0]", "[-210,0, 210,0]");
    let machine = folder.file("machine.toml", text);
    refused(
        &["pose", &machine],
        &[
            "machine.toml, line 11: 4 numbers, where 2 are expected",
            "write a decimal point, not a comma",
        ],
    );
}

#[test]
fn small_letters_are_told() {
    for (body, line, cause, remedy) in [
        ("[parameters]\nexx1 = 1e-5", 3, "`exx1`", "write EXX1:"),
        ("[parameters]\nEXXB = 1e-5", 3, "`EXXB`", "write EXXb:"),
        ("[parameters]\neb0a = 1e-5", 3, "`eb0a`", "write EB0A:"),
        ("[parameters]\nexcC1 = 1e-5", 3, "`excC1`", "write EXCc1:"),
        ("[calibrated]\na = [-1, 1]", 3, "no axis a", "write A:"),
        (
            "[tabulated.exx]\nat = [0.0, 1.0]\nvalue = [0.0, 0.0]",
            2,
            "`exx`",
            "write [tabulated.EXX]",
        ),
    ] {
        refuses(body, line, cause, remedy);
    }
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("kolibri/machine.toml")).unwrap();
    let machine = folder.file("machine.toml", text.replace("\"A\"", "\"a\""));
    refused(
        &["pose", &machine],
        &[
            "machine.toml, line 14: `a` is not an axis letter",
            "write \"A\"",
        ],
    );
}

#[test]
fn a_missing_folder_is_told_before_the_work_begins() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-81.toml"),
    );
    let blob = folder.at("nowhere/x.trax");
    refused(
        &["compile", &machine, &errors, "-o", &blob],
        &[
            "x.trax: cannot be written: there is no folder",
            "make the folder",
        ],
    );
    let errors = folder.at("nowhere/errors.toml");
    refused(
        &["explain", &machine, &errors],
        &[
            "errors.toml: cannot be read: there is no folder",
            "check the path",
        ],
    );
    assert!(folder.names().is_empty());
}

#[test]
fn a_correction_that_is_too_large_points_to_the_parameter() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let blob = folder.at("x.trax");
    for (body, line) in [
        ("[parameters]\nEXX1 = 1e-5\nEB0Z = 0.02\n", 4),
        (
            "[parameters]\nEXX1 = 1e-5\n[tabulated.EXZ]\nat = [0.0, 240.0]\nvalue = [0.0, 4.0]\n",
            4,
        ),
    ] {
        let errors = folder.file("errors.toml", format!("machine = \"Kolibri\"\n{body}"));
        let place = format!("errors.toml, line {line}: the correction of ");
        refused(
            &[
                "compile",
                &machine,
                &errors,
                "-o",
                &blob,
                "--tolerance",
                "5",
            ],
            &[&place, "--allow-large"],
        );
    }
}

/// X travels 2.5 mm for each mm, so any addition comes back enlarged.
#[test]
fn a_correction_that_does_not_converge_points_to_the_largest_error() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("kolibri/machine.toml")).unwrap();
    let machine = folder.file(
        "machine.toml",
        text.replace("[-130.0, 130.0]", "[-60.0, 60.0]"),
    );
    let errors = folder.file(
        "errors.toml",
        "machine = \"Kolibri\"\n[parameters]\nEYX1 = 1e-5\nEXX1 = 1.5\n",
    );
    let positions = folder.file("p.csv", "X,Y,Z,A,C\n0,0,0,0,0\n\n50,0,0,0,0\n");
    let parts = [
        "errors.toml, line 4: the kinematic correction does not converge",
        "the largest of the errors: up to 90 mm",
        "check the units of the error parameters (mm and rad)",
    ];
    let blob = folder.at("x.trax");
    refused(&["compile", &machine, &errors, "-o", &blob], &parts);
    refused(
        &[
            "compile",
            &machine,
            &errors,
            "-o",
            &blob,
            "--zero-at",
            "X=50",
        ],
        &parts,
    );
    let output = trueaxis(&["correct", &machine, &errors, "--positions", &positions]);
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    for part in parts {
        assert!(said.contains(part), "{said}");
    }
    assert!(said.contains("p.csv, line 4)"), "{said}");
}

/// An error file for the router that names `x.csv`, with additional lines in its entry.
fn measured(folder: &Folder, csv: &str, entry: &str) -> String {
    folder.file("x.csv", csv);
    folder.file(
        "errors.toml",
        format!("machine = \"Router\"\n[tabulated.EXX]\nfile = \"x.csv\"\n{entry}"),
    )
}

#[test]
fn a_measured_motion_is_read_from_a_file_beside_the_error_file() {
    let router = example("router/machine.toml");
    let folder = Folder::new();
    let inline = |name: &str, body: &str| {
        folder.file(
            "inline.toml",
            format!("machine = \"Router\"\n[tabulated.{name}]\n{body}"),
        )
    };
    let json = |errors: &str| -> serde_json::Value {
        let positions = folder.file("p.csv", "X,Y,Z\n0,0,0\n150,0,0\n700,0,0\n300,5,0\n");
        let arguments = [
            "correct",
            &router,
            errors,
            "--positions",
            &positions,
            "--json",
        ];
        serde_json::from_str(&answer(0, &arguments)).unwrap()
    };
    let same = inline("EXX", "at = [0, 400, 800]\nvalue = [0.0, 0.0025, 0.010]\n");
    let same = json(&same);
    for (csv, unit) in [
        ("0,0\n400,2.5\n800,10\n", "um"),
        ("position,deviation\r\n0,0\r\n400,2.5\r\n800,10\r\n", "µm"),
        ("X (mm),mm\n0,0\n400,0.0025\n800,0.010\n", "mm"),
    ] {
        let errors = measured(&folder, csv, &format!("unit = \"{unit}\"\n"));
        assert_eq!(json(&errors), same, "{unit}");
    }
    // Both directions, and angles.
    let both = inline(
        "EXX",
        "at = [0, 800]\npositive = [0.0, 0.010]\nnegative = [0.002, 0.012]\n",
    );
    let both = json(&both);
    let errors = measured(&folder, "at,up,down\n0,0,2\n800,10,12\n", "unit = \"um\"\n");
    assert_eq!(json(&errors), both);
    let angle = inline("EAX", "at = [0, 800]\nvalue = [0.0, 48e-6]\n");
    let angle = json(&angle);
    for (value, unit) in [("48", "urad"), ("0.048", "mrad"), ("9.9006", "arcsec")] {
        folder.file("x.csv", format!("0,0\n800,{value}\n"));
        let errors = inline("EAX", &format!("file = \"x.csv\"\nunit = \"{unit}\"\n"));
        let found = json(&errors);
        for (found, expected) in rows(&found).iter().zip(rows(&angle)) {
            // arcsec is written with five digits: 1e-5 of 48 µrad at a lever of 1 m.
            assert!((found - expected).abs() < 1e-6, "{unit}");
        }
    }
    // A unit may also be given for values in the file itself.
    let errors = inline(
        "EXX",
        "at = [0, 400, 800]\nvalue = [0.0, 2.5, 10]\nunit = \"um\"\n",
    );
    assert_eq!(json(&errors), same);
}

/// All corrections.
fn rows(json: &serde_json::Value) -> Vec<f64> {
    let rows = json["corrections"].as_array().unwrap().iter();
    rows.flat_map(|row| row.as_array().unwrap())
        .map(|v| v.as_f64().unwrap())
        .collect()
}

#[test]
fn a_bad_file_of_measured_values_is_refused_at_its_line() {
    let router = example("router/machine.toml");
    for (csv, entry, place, cause, remedy) in [
        (
            "0;1\n1;2\n",
            "unit = \"um\"",
            "x.csv, line 1:",
            "separated by semicolons",
            "with commas",
        ),
        (
            "0,1\n1,2,5\n",
            "unit = \"um\"",
            "x.csv, line 2:",
            "the row has 3 columns, not 2",
            "with decimal points",
        ),
        (
            "0,1\n100,2\n50,3\n",
            "unit = \"um\"",
            "x.csv, line 3:",
            "the values must increase, but 50 follows 100",
            "sort the rows",
        ),
        (
            "0,1\n",
            "unit = \"um\"",
            "x.csv:",
            "two positions are needed, the file has 1",
            "in each line",
        ),
        (
            "0,1\n800,1\n",
            "",
            "errors.toml, line 3:",
            "the unit of the values in `x.csv` is not given",
            "add unit",
        ),
        (
            "0,1\n800,1\n",
            "unit = \"arcsec\"",
            "errors.toml, line 4:",
            "`arcsec` is not a unit of length",
            "write mm, um or in",
        ),
        (
            "0,1\n800,2500\n",
            "unit = \"mm\"",
            "errors.toml, line 3:",
            "EXX cannot be physical",
            "check unit",
        ),
        (
            "0,1\n800,1\n",
            "unit = \"um\"\nat = [0.0, 1.0]",
            "errors.toml, line 5:",
            "both in a file and here",
            "keep one",
        ),
    ] {
        let folder = Folder::new();
        let errors = measured(&folder, csv, entry);
        refused(&["explain", &router, &errors], &[place, cause, remedy]);
    }
    let folder = Folder::new();
    let errors = measured(&folder, "", "unit = \"um\"");
    std::fs::remove_file(folder.at("x.csv")).unwrap();
    refused(
        &["explain", &router, &errors],
        &[
            "errors.toml, line 3:",
            "x.csv: cannot be read",
            "folder of the error file",
        ],
    );
}
