//! Error files that are refused, with line, cause and remedy.

use crate::program::{Folder, answer, example, refused};

/// `body` after the line that names the Kolibri is refused at `line`.
fn refuses(body: &str, line: usize, cause: &str, remedy: &str) {
    let folder = Folder::new();
    let errors = folder.file("errors.toml", format!("machine = \"Kolibri\"\n{body}\n"));
    let machine = example("kolibri/machine.toml");
    let place = format!("errors.toml, line {line}:");
    refused(
        &["compile", &machine, &errors, "-o", &folder.at("x.trax")],
        &[&place, cause, remedy],
    );
    assert_eq!(folder.names(), ["errors.toml"]);
}

#[test]
fn an_unknown_key_is_refused() {
    refuses(
        "[parameter]\nEXX1 = 1e-5",
        2,
        "unknown field `parameter`",
        "unknown keys",
    );
}

#[test]
fn an_unknown_name_is_refused() {
    refuses(
        "[parameters]\nEXX1 = 1e-5\nEXQ1 = 1e-5",
        4,
        "`EXQ1` is no error parameter",
        "write EB0A",
    );
}

#[test]
fn an_axis_that_is_not_there_is_refused() {
    refuses(
        "[parameters]\nEB0B = 1e-5",
        3,
        "the machine has no axis B",
        "has the axes Y A C X Z",
    );
}

#[test]
fn an_error_that_cannot_be_physical_is_refused() {
    refuses(
        "[parameters]\nEB0A = 0.2",
        3,
        "EB0A cannot be physical",
        "1 mrad = 1e-3",
    );
    refuses(
        "[parameters]\nEB0A = nan",
        3,
        "EB0A cannot be physical",
        "1 mrad = 1e-3",
    );
    refuses(
        "[parameters]\nEXX1 = 1e-5\nEAX1 = 1e-2",
        4,
        "EAX1 cannot be physical",
        "[calibrated]",
    );
}

#[test]
fn a_table_that_does_not_increase_is_refused() {
    refuses(
        "[tabulated.EXX]\nat = [0.0, 100.0, 100.0]\nvalue = [0.0, 0.001, 0.002]",
        3,
        "the positions of EXX do not increase at entry 3",
        "sort the positions",
    );
}

#[test]
fn errors_of_another_machine_are_refused() {
    let folder = Folder::new();
    let errors = example("hu40/errors-13.toml");
    refused(
        &[
            "compile",
            &example("kolibri/machine.toml"),
            &errors,
            "-o",
            &folder.at("x.trax"),
        ],
        &[
            "line 4:",
            "these errors belong to `HU40`, the machine is `Kolibri`",
            "machine file of this name",
        ],
    );
}

#[test]
fn a_calibrated_range_beside_the_travel_is_refused() {
    let folder = Folder::new();
    let text =
        "machine = \"Kolibri\"\n[parameters]\nEXX2 = 1e-8\n[calibrated]\nX = [500.0, 600.0]\n";
    let errors = folder.file("errors.toml", text);
    refused(
        &[
            "compile",
            &example("kolibri/machine.toml"),
            &errors,
            "-o",
            &folder.at("x.trax"),
        ],
        &["the calibrated range of axis X", "correct [calibrated]"],
    );
}

#[test]
fn a_bound_over_a_millimetre_is_refused_unless_allowed() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Kolibri\"\n[parameters]\nEXX1 = 1e-5\nEB0Z = 0.01\n",
    );
    let machine = example("kolibri/machine.toml");
    let blob = folder.at("x.trax");
    let arguments = [
        "compile",
        &machine,
        &errors,
        "-o",
        &blob,
        "--random",
        "200",
        "--tolerance",
        "5",
    ];
    refused(
        &arguments,
        &[
            "the correction of X reaches",
            "because of EB0Z",
            "more than 1 mm is refused",
            "--allow-large",
        ],
    );
    assert_eq!(folder.names(), ["errors.toml"]);
    let mut allowed = arguments.to_vec();
    allowed.extend(["--allow-large", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&answer(0, &allowed)).unwrap();
    let warning = &json["warnings"][0];
    assert_eq!(warning["kind"], "large");
    assert_eq!(warning["culprit"]["parameter"], "EB0Z");
}

#[test]
fn a_bad_zero_position_is_refused() {
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let folder = Folder::new();
    for (text, cause) in [
        ("X", "`X` is not an axis, an equals sign and a number"),
        ("B=0", "the machine has no axis `B`"),
        ("X=0,X=1", "axis X is given twice"),
        ("X=nan", "`nan` is no finite number"),
        ("X=1000", "X = 1000 is outside its travel -130 to 130 mm"),
    ] {
        let blob = folder.at("x.trax");
        refused(
            &["compile", &machine, &errors, "-o", &blob, "--zero-at", text],
            &[cause, "like Y=0,A=0,C=0,X=0,Z=0"],
        );
    }
}
