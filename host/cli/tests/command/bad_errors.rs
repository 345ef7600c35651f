//! Error files that are refused, with line, cause and remedy.

use crate::program::{Folder, answer, example, refused};

/// Checks that `body`, after the line that names the Kolibri, is refused at `line`.
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
        "one of the keys",
    );
}

#[test]
fn a_value_with_a_unit_is_refused_with_the_number_to_write() {
    for value in ["\"30 um\"", "\"30µrad\"", "30 um", "\"-3.5e1 arcsec\""] {
        refuses(
            &format!("[parameters]\nEB0A = {value}"),
            3,
            "",
            "without unit and quotes: values are in mm and rad: 30 µm is 30e-3",
        );
    }
    refuses(
        "[parameters]\nEB0A = \"many\"",
        3,
        "invalid type",
        "numbers have no quotes",
    );
}

#[test]
fn swapped_files_are_named_as_such() {
    let [machine, errors] = ["kolibri/machine.toml", "kolibri/errors-10.toml"].map(example);
    let order = "the machine file comes first, then the error file";
    let is_errors = "errors-10.toml: this is an error file, where a machine file is expected";
    for command in [
        vec!["compile", &errors, &machine, "-o", "x.trax"],
        vec!["pose", &errors, "--at", "X=1"],
    ] {
        refused(&command, &[is_errors, order]);
    }
    refused(
        &["explain", &machine, &machine],
        &[
            "machine.toml: this is a machine file, where an error file is expected",
            order,
        ],
    );
}

#[test]
fn an_unknown_name_is_refused() {
    refuses(
        "[parameters]\nEXX1 = 1e-5\nEXQ1 = 1e-5",
        4,
        "`EXQ1` is not an error parameter",
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
        "30 µrad (30 µm/m) is 30e-6",
    );
    refuses(
        "[parameters]\nEB0A = nan",
        3,
        "EB0A cannot be physical",
        "30 µrad (30 µm/m) is 30e-6",
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
    refuses(
        "[parameters]\nEXX2 = 1e-8\n[calibrated]\nX = [500.0, 600.0]",
        5,
        "the calibrated range of axis X has nothing of its travel",
        "correct [calibrated]",
    );
}

#[test]
fn a_calibrated_range_that_is_hardly_wider_than_corrections_is_refused() {
    refuses(
        "[parameters]\nEXX2 = 1e-8\n[calibrated]\nX = [10.0, 10.3]",
        5,
        "the calibrated range of axis X has 0.300 mm of its travel, less than 1 mm",
        "write [lower, upper] in mm",
    );
    refuses(
        "[calibrated]\nA = [119.5, 300.0]",
        3,
        "the calibrated range of axis A has 0.500 deg of its travel, less than 1 deg",
        "write [lower, upper] in deg",
    );
    refuses(
        "[calibrated]\nX = [-1e308, 1e308]",
        3,
        "larger than any travel",
        "in mm of the command",
    );
}

#[test]
fn tables_that_have_nothing_of_the_travel_in_common_are_refused() {
    refuses(
        "[tabulated.EXX]\nat = [-100.0, 0.0]\nvalue = [0.0, 0.001]\n[tabulated.EYX]\nat = [0.5, 100.0]\nvalue = [0.0, 0.001]",
        6,
        "the tables of axis X have nothing of its travel in common",
        "give positions in mm",
    );
}

#[test]
fn harmonics_of_a_linear_axis_are_refused() {
    refuses(
        "[parameters]\nEXXc1 = 1e-3",
        3,
        "axis X is linear: harmonics are error motions of rotary axes",
        "write coefficients (EXX1, EXX2 …) or a table",
    );
    refuses(
        "[parameters]\nEXAs9 = 1e-3",
        3,
        "`EXAs9` is not an error parameter",
        "EXCc1 or EXCs1 (cosine, sine of 1 to 8 times the angle",
    );
}

#[test]
fn absurd_temperatures_are_refused() {
    let entry =
        |rest: &str| format!("[thermal]\nEXX1 = {{ per_kelvin = 1e-5, sensor = \"bed\", {rest} }}");
    refuses(
        &entry("reference_celsius = 20.0, range_kelvin = [-10, 1e308]"),
        3,
        "the temperature range of EXX1 goes beyond 200 K",
        "within ±200 K",
    );
    refuses(
        &entry("reference_celsius = 20.0, range_kelvin = [5, 10]"),
        3,
        "the temperature range of EXX1 is empty or does not contain 0",
        "around 0",
    );
    refuses(
        &entry("reference_celsius = 1e300"),
        3,
        "the reference temperature of EXX1",
        "reference_celsius = 20.0",
    );
}

#[test]
fn lags_and_lists_of_changes_are_checked_one_by_one() {
    let one = "{ per_kelvin = 1e-6, sensor = \"bed\", reference_celsius = 20.0";
    refuses(
        &format!("[thermal]\nEXX1 = {one}, lag_s = 0.5 }}"),
        3,
        "the lag of EXX1 is not a number from 1 to 1000000 s",
        "63 % of a step",
    );
    refuses(
        &format!("[thermal]\nEXX1 = [{one} }},\n {one}, lag_s = nan }}]"),
        4,
        "the lag of EXX1",
        "leave it out",
    );
    refuses(
        &format!("[thermal]\nEXX1 = [{one} }},\n {one}, lag = 60 }}]"),
        4,
        "unknown field `lag`",
        "lag_s",
    );
    refuses("[thermal]\nEXX1 = 1e-6", 3, "a list of them", "per_kelvin");
    let many: Vec<String> = (1..9)
        .map(|k| format!("{one}, lag_s = {k}00.0 }}"))
        .collect();
    refuses(
        &format!("[thermal]\nEXX1 = [{}]", many.join(", ")),
        3,
        "sensor `bed` cannot be used",
        "each further lag of a sensor counts as one",
    );
}

#[test]
fn thermal_changes_that_cannot_be_physical_are_refused() {
    let entry = |name: &str, per_kelvin: &str| {
        format!(
            "[thermal]\n{name} = {{ per_kelvin = {per_kelvin}, sensor = \"bed\", reference_celsius = 20.0 }}"
        )
    };
    for (name, per_kelvin, place) in [
        ("EXX1", "1e300", "at X = -130.0 mm"),
        ("EXX3", "1e-4", "at X = -130.0 mm"),
        ("EB0Z", "0.006", "at 20 K from the reference"),
        ("EXAs2", "7.0", "at A ="),
    ] {
        let cause = format!("the thermal change of {name} cannot be physical");
        refuses(&entry(name, per_kelvin), 3, &cause, place);
    }
    refuses(
        &entry("EACc1", "nan"),
        3,
        "the change of EACc1 per kelvin is not a finite number",
        "in the parameter's unit per kelvin",
    );
}

#[test]
fn a_motion_that_is_too_large_with_its_backlash_is_refused() {
    refuses(
        "[parameters]\nEAX0 = 0.06\nEAXb = -0.05",
        3,
        "EAX0 cannot be physical",
        "30 µrad (30 µm/m) is 30e-6",
    );
}

#[test]
fn a_table_of_absurd_size_is_refused() {
    let at: Vec<String> = (0..10_001)
        .map(|i| format!("{}", f64::from(i) * 0.01))
        .collect();
    refuses(
        &format!("[tabulated.EXX]\nat = [{}]\nvalue = [0.0]", at.join(", ")),
        3,
        "EXX has 10001 positions",
        "leave out positions",
    );
    refuses(
        "[tabulated.EXX]\nat = [0.0, inf]\nvalue = [0.0, 0.001]",
        3,
        "a position of EXX is not a finite number",
        "mm and degrees",
    );
}

#[test]
fn a_table_without_the_values_of_a_direction_is_refused() {
    for (values, line, cause) in [
        ("positive = [0.0, 0.001]", 4, "one direction of travel only"),
        ("negative = [0.0, 0.001]", 4, "one direction of travel only"),
        (
            "value = [0.0, 0.001]\nnegative = [0.0, 0.001]",
            5,
            "for both directions and for one",
        ),
        ("", 3, "positions without values"),
    ] {
        refuses(
            &format!("[tabulated.EXX]\nat = [0.0, 100.0]\n{values}"),
            line,
            cause,
            "positive = […] and negative = […]",
        );
    }
    refuses(
        "[tabulated.EXX]\nat = [0.0, 100.0]\npositive = [0.0, 0.001]\nnegative = [0.0]",
        5,
        "EXX has 2 positions and 1 values",
        "as many values as positions",
    );
}

#[test]
fn standard_uncertainties_of_a_table_that_cannot_be_are_refused() {
    for (value, cause, remedy) in [
        (
            "[1e-4, 1e-4, 1e-4]",
            "EXX has 2 positions and 3 standard uncertainties",
            "one number for all",
        ),
        (
            "[1e-4, -1e-4]",
            "standard uncertainty 2 of EXX is negative or not a number",
            "0 or more",
        ),
        (
            "nan",
            "standard uncertainty 1 of EXX is negative",
            "0 or more",
        ),
        (
            "1e3",
            "the standard uncertainty of EXX cannot be physical",
            "mm",
        ),
        ("\"small\"", "expected a number, or a list", "errors.toml"),
    ] {
        refuses(
            &format!(
                "[tabulated.EXX]\nat = [0.0, 100.0]\nvalue = [0.0, 0.001]\nstandard_uncertainty = {value}"
            ),
            5,
            cause,
            remedy,
        );
    }
}

/// Checks that `body` is refused at `line` for the table-head machine, whose C axis rotates without limits.
fn refuses_endless(body: &str, line: usize, cause: &str, remedy: &str) {
    let folder = Folder::new();
    let text = format!("machine = \"Table and head\"\n{body}\n");
    let errors = folder.file("errors.toml", text);
    let machine = example("table-head/machine.toml");
    let place = format!("errors.toml, line {line}:");
    refused(
        &["compile", &machine, &errors, "-o", &folder.at("x.trax")],
        &[&place, cause, remedy],
    );
}

#[test]
fn an_error_motion_that_does_not_close_over_the_turn_is_refused() {
    refuses_endless(
        "[parameters]\nEXC0 = 1e-3\nEXC1 = 2.5e-3",
        4,
        "EXC1 does not close over the turn of axis C, which is endless",
        "use harmonics (EXCc1, EXCs1 …)",
    );
    refuses_endless(
        "[thermal]\nEXC1 = { per_kelvin = 1e-4, sensor = \"bed\", reference_celsius = 20.0 }",
        3,
        "the thermal change of EXC1 does not close",
        "use harmonics",
    );
    refuses_endless(
        "[parameters]\nEXC2 = 1e-3\n[calibrated]\nC = [20.0, 300.0]",
        3,
        "EXC2 does not close",
        "a table whose first and last value are equal",
    );
}

#[test]
fn a_table_that_does_not_close_over_the_turn_is_refused() {
    refuses_endless(
        "[tabulated.EXC]\nat = [0.0, 360.0]\nvalue = [0.0, 0.001]",
        3,
        "EXC does not close over the turn",
        "make the first and the last value equal",
    );
    refuses_endless(
        "[tabulated.EXC]\nat = [0.0, 360.0]\npositive = [0.0, 0.0]\nnegative = [0.0, 0.001]",
        3,
        "EXC does not close over the turn",
        "in each direction of travel",
    );
    refuses_endless(
        "[tabulated.EXC]\nat = [0.0, 100.0]\nvalue = [0.0, 0.0]",
        3,
        "EXC does not cover the turn of axis C",
        "equal at both ends",
    );
}

#[test]
fn a_bound_over_two_millimetres_is_refused_unless_allowed() {
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
            "the correction of Y reaches",
            "because of EB0Z",
            "more than 2 mm is refused",
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
        ("X=nan", "`nan` is not a finite number"),
        ("X=1000", "X = 1000 is outside its travel -130 to 130 mm"),
    ] {
        let blob = folder.at("x.trax");
        refused(
            &["compile", &machine, &errors, "-o", &blob, "--zero-at", text],
            &[cause, "like Y=0,A=0,C=0,X=0,Z=0"],
        );
    }
}
