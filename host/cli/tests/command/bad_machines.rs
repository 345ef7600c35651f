//! Machines that are refused, with line, cause and remedy.

use crate::program::{Folder, answer, example, refused};

const MACHINE: &str = r#"name = "Mill"
topology = "wYFXZBSt"

[[axis]]
name = "Y"
branch = "workpiece"
range = [-210.0, 210.0]

[[axis]]
name = "X"
branch = "tool"
range = [-130.0, 130.0]

[[axis]]
name = "Z"
branch = "tool"
range = [0.0, 240.0]

[[axis]]
name = "B"
branch = "tool"
range = [-100.0, 100.0]

[spindle]
axis = "z"

[tool]
tip_mm = [0.0, 0.0, -74.0]
"#;

/// Checks that the machine with `from` replaced by `to` is refused at `line`.
fn refuses(from: &str, to: &str, line: usize, cause: &str, remedy: &str) {
    assert!(MACHINE.contains(from));
    let folder = Folder::new();
    let machine = folder.file("machine.toml", MACHINE.replacen(from, to, 1));
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill\"\n[parameters]\nEXX1 = 1e-5\n",
    );
    let blob = folder.at("x.trax");
    let place = format!("machine.toml, line {line}:");
    refused(
        &["compile", &machine, &errors, "-o", &blob],
        &[&place, cause, remedy],
    );
    assert_eq!(folder.names(), ["errors.toml", "machine.toml"]);
}

#[test]
fn an_unknown_letter_is_refused() {
    refuses(
        "\"B\"",
        "\"Q\"",
        20,
        "`Q` is not an axis letter",
        "X Y Z U V W",
    );
}

#[test]
fn an_axis_given_twice_is_refused() {
    refuses(
        "\"B\"",
        "\"X\"",
        20,
        "axis X is described twice",
        "its own letter",
    );
}

#[test]
fn a_topology_that_does_not_match_the_axes_is_refused() {
    refuses(
        "wYFXZBSt",
        "wBYFXZSt",
        2,
        "does not match the axes",
        "the axes below make wYFXZBSt",
    );
    refuses(
        "wYFXZBSt",
        "wBYFXZSt",
        2,
        "`wBYFXZSt`",
        "from the foundation outwards",
    );
}

#[test]
fn an_empty_travel_is_refused() {
    refuses(
        "[0.0, 240.0]",
        "[240.0, 0.0]",
        17,
        "the travel of axis Z is empty",
        "range = [lower, upper]",
    );
}

#[test]
fn not_a_number_is_refused() {
    refuses(
        "[0.0, 240.0]",
        "[nan, 240.0]",
        17,
        "not a finite number",
        "plain numbers",
    );
    refuses("-74.0", "inf", 28, "not a finite number", "plain numbers");
}

#[test]
fn linear_axes_that_do_not_span_space_are_refused() {
    let flat = MACHINE
        .replace("\"Y\"", "\"W\"")
        .replace("topology = \"wYFXZBSt\"", "");
    let folder = Folder::new();
    let machine = folder.file("machine.toml", flat);
    refused(
        &["compile", &machine, &machine, "-o", &folder.at("x.trax")],
        &[
            "machine.toml, line 5:",
            "the linear axes do not span space",
            "at least three linear axes",
        ],
    );
}

#[test]
fn parallel_rotary_axes_are_refused() {
    let second = "[[axis]]\nname = \"A\"\nbranch = \"tool\"\norientation_deg = [0, 0, 90]\nrange = [-90.0, 90.0]\n\n[spindle]";
    let folder = Folder::new();
    let text = MACHINE
        .replace("[spindle]", second)
        .replace("topology = \"wYFXZBSt\"", "");
    let machine = folder.file("machine.toml", text);
    refused(
        &["compile", &machine, &machine, "-o", &folder.at("x.trax")],
        &[
            "machine.toml, line 25:",
            "the rotary axes B and A are parallel",
            "orientation_deg of the two axes",
        ],
    );
}

#[test]
fn a_missing_tool_axis_is_refused() {
    refuses(
        "axis = \"z\"",
        "",
        24,
        "does not say which of its axes is the tool axis",
        "add axis = \"z\"",
    );
    refuses(
        "[spindle]\naxis = \"z\"\n",
        "",
        1,
        "the machine has no [spindle]",
        "add [spindle]",
    );
    refuses(
        "axis = \"z\"",
        "axis = \"k\"",
        25,
        "`k` is not an axis of the spindle frame",
        "write x, y or z",
    );
}

#[test]
fn unknown_keys_and_bad_syntax_are_refused() {
    refuses(
        "branch = \"tool\"",
        "brunch = \"tool\"",
        11,
        "unknown field `brunch`",
        "one of the keys",
    );
    refuses(
        "axis = \"z\"",
        "axis = z",
        25,
        "string values must be quoted",
        "texts in quotes",
    );
}

#[test]
fn a_file_that_is_not_there_or_no_text_is_refused() {
    let folder = Folder::new();
    let errors = example("kolibri/errors-12.toml");
    let blob = folder.at("x.trax");
    refused(
        &["compile", "nowhere.toml", &errors, "-o", &blob],
        &["nowhere.toml: cannot be read", "check the path"],
    );
    let machine = folder.file("machine.toml", b"name = \"\n\xff\"");
    refused(
        &["compile", &machine, &errors, "-o", &blob],
        &["line 2: this is not UTF-8 text", "save the file as UTF-8"],
    );
}

/// Arguments that compile the machine with more lines in its file, after others.
fn limited(folder: &Folder, changes: &[(&str, &str)], errors: &str) -> [String; 5] {
    let mut machine = MACHINE.to_owned();
    for (after, more) in changes {
        assert!(machine.contains(after));
        machine = machine.replacen(after, &format!("{after}\n{more}"), 1);
    }
    [
        "compile".to_owned(),
        folder.file("machine.toml", machine),
        folder.file("errors.toml", format!("machine = \"Mill\"\n{errors}\n")),
        "-o".to_owned(),
        folder.at("x.trax"),
    ]
}

const X: &str = "name = \"X\"";
const TOP: &str = "name = \"Mill\"";

fn accepts_limits(changes: &[(&str, &str)], errors: &str) {
    let folder = Folder::new();
    let arguments = limited(&folder, changes, errors);
    answer(0, &arguments.each_ref().map(String::as_str));
}

fn refuses_limits(changes: &[(&str, &str)], errors: &str, parts: &[&str]) {
    let folder = Folder::new();
    let arguments = limited(&folder, changes, errors);
    refused(&arguments.each_ref().map(String::as_str), parts);
    assert_eq!(folder.names(), ["errors.toml", "machine.toml"]);
}

#[test]
fn a_correction_faster_than_its_limit_is_refused() {
    // A slope of 1e-5 at 500 mm/s: 0.005 mm/s, and no other slope.
    let line = "[parameters]\nEXX1 = 1e-5";
    let both = "max_correction_speed = 0.00501\nmax_correction_acceleration = 1e-3";
    accepts_limits(&[(X, both)], line);
    refuses_limits(
        &[(X, "max_correction_speed = 0.00499")],
        line,
        &[
            "machine.toml, line 11: the correction of X can move at",
            "more than 0.00499 mm/s",
            "from X at 500 mm/s",
            "raise the limit if the drive follows",
        ],
    );
    accepts_limits(
        &[(X, "max_correction_speed = 0.00499\nmax_speed = 499.0")],
        line,
    );
}

#[test]
fn a_correction_that_changes_its_speed_faster_than_its_limit_is_refused() {
    // 1e-7 x² as the square of a straight line: its slope changes by 2e-7 per mm, at 500 mm/s by 0.05 mm/s².
    let parabola = "[parameters]\nEXX2 = 1e-7";
    accepts_limits(&[(X, "max_correction_acceleration = 0.0501")], parabola);
    refuses_limits(
        &[(X, "max_correction_acceleration = 0.0499")],
        parabola,
        &[
            "machine.toml, line 11: the correction of X can change its speed by",
            "more than 0.0499 mm/s²",
            "give more --points",
        ],
    );
    refuses_limits(
        &[(X, "max_correction_acceleration = -1.0")],
        parabola,
        &["machine.toml, line 11: this must be a positive number"],
    );
}

#[test]
fn a_corner_of_a_correction_takes_one_servo_period() {
    // The slope turns from 1e-5 to -1e-5: at 500 mm/s by 0.01 mm/s.
    let roof = "[tabulated.EXX]\nat = [-130.0, 0.0, 130.0]\nvalue = [0.0, 0.0013, 0.0]";
    accepts_limits(&[(X, "max_correction_acceleration = 10.01")], roof);
    let parts = ["line 11: the correction of X can change its speed by"];
    refuses_limits(&[(X, "max_correction_acceleration = 9.99")], roof, &parts);
    let period = (TOP, "servo_period_ms = 2.0");
    accepts_limits(&[period, (X, "max_correction_acceleration = 5.01")], roof);
    let parts = ["line 12: the correction of X can change its speed by"];
    let limit = (X, "max_correction_acceleration = 4.99");
    refuses_limits(&[period, limit], roof, &parts);
    let parts = ["line 2: a servo period of 11 ms is not between 0.001 and 10 ms"];
    refuses_limits(&[(TOP, "servo_period_ms = 11.0")], roof, &parts);
}

#[test]
fn solids_that_cannot_be_are_refused() {
    let solid = |more: &str| format!("[tool]\ntip_mm = [0.0, 0.0, -74.0]\n[[solid]]\n{more}");
    let refuses = |more: &str, line: usize, cause: &str, remedy: &str| {
        refuses(
            "[tool]\ntip_mm = [0.0, 0.0, -74.0]\n",
            &solid(more),
            line,
            cause,
            remedy,
        );
    };
    let cylinder = "name = \"t\"\ncarried_by = \"B\"\nshape = \"cylinder\"\n";
    refuses(
        "name = \"t\"\ncarried_by = \"C\"\nshape = \"box\"\nsize_mm = [1.0, 1.0, 1.0]\n",
        31,
        "the machine has no `C`",
        "\"spindle\", \"workpiece\" or \"foundation\"",
    );
    refuses(
        "name = \"t\"\ncarried_by = \"B\"\nshape = \"cone\"\n",
        32,
        "`cone` is not a shape",
        "\"capsule\"",
    );
    refuses(cylinder, 32, "the size of this cylinder", "add diameter_mm");
    refuses(
        &format!("{cylinder}diameter_mm = 5.0\nlength_mm = 0.0\n"),
        34,
        "not the size of a part",
        "more than 0",
    );
    refuses(
        &format!("{cylinder}diameter_mm = 5.0\nlength_mm = 1.0\nsize_mm = [1.0, 1.0, 1.0]\n"),
        35,
        "a cylinder has no size_mm",
        "a box has size_mm",
    );
    let whole = format!("{cylinder}diameter_mm = 5.0\nlength_mm = 1.0\n");
    refuses(
        &format!("{whole}[[solid]]\n{whole}"),
        36,
        "another solid `t`",
        "a name of its own",
    );
}
