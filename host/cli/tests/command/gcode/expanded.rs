//! `--expand`, without LinuxCNC: what is refused before its interpreter runs, and what becomes of the interpreter's
//! output, from a script in its place. `cargo xtask gcode` compares with the real one.

use super::{SETUP, with_mill_21};
use crate::program::{Folder, plain};
use std::path::Path;
use std::process::{Command, Output};

/// The command with programs from one folder only.
fn trueaxis(path: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
    command.args(arguments).arg("--expand").env("PATH", path);
    command.output().unwrap()
}

/// What is refused where there is no interpreter, with parts of the message; nothing is written.
fn refuses(program: &str, options: &[&str], parts: &[&str]) {
    let folder = Folder::new();
    let empty = Folder::new();
    let output = with_mill_21(&folder, program, options, |arguments| {
        trueaxis(empty.path(), arguments)
    });
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    for part in parts.iter().chain(&["help:"]) {
        assert!(
            said.contains(part),
            "{program}: `{part}` is not in:\n{said}"
        );
    }
    assert_eq!(folder.names(), ["part.ngc", "setup.toml"]);
}

#[test]
fn without_the_interpreter_it_says_what_to_install() {
    refuses(
        "#1=2\nG0 X#1\nM2\n",
        &[],
        &["rs274, is not installed", "linuxcnc-uspace"],
    );
}

#[test]
fn options_that_do_not_fit_are_refused() {
    refuses(
        "M2\n",
        &["--dialect", "fanuc"],
        &["--expand", "another dialect"],
    );
}

#[test]
fn what_canonical_commands_cannot_say_is_refused_by_line_and_word() {
    for (line, parts) in [
        (
            "G0 X#5061",
            &["line 3", "#5061", "the result of probing"][..],
        ),
        ("#1 = # 5070", &["line 3", "#5070", "the result of probing"]),
        ("M66 P1 L3 Q1", &["line 3", "M66 waits for an input"]),
        ("#1=#5399", &["line 3", "#5399", "input"]),
        (
            "#1=#<_hal[a.b]>",
            &["line 3", "#<_hal[a.b]>", "a pin of the machine"],
        ),
        ("#1=#<_INI[a]b>", &["line 3", "#<_ini[a]b>", "INI file"]),
        (
            "#1=#<_metric_machine>",
            &["line 3", "the units of the machine"],
        ),
        ("N5 #5221=3", &["line 3", "#5221=", "G10 L2"]),
        (
            "#1=#5241",
            &[
                "line 3",
                "#5241",
                "the offset G55, which is not known",
                "[offset.\"G55\"]",
            ],
        ),
        (
            "#1=#5163",
            &["line 3", "#5163", "where G28 goes", "[home.G28]"],
        ),
        (
            "#1=#5400",
            &["line 3", "#5400", "the tool in the spindle", "[start] tool"],
        ),
        ("#1=#5409", &["line 3", "#5409"]),
        ("/ G0 X1", &["line 3", "--block-delete"]),
        ("(debug, #5221)", &["line 3", "#5221", "inches"]),
        ("(py, print)", &["line 3", "Python"]),
        (
            "#1=#[#2+1]\n#3=5222",
            &["line 4", "5222", "write the parameter itself: #5222"],
        ),
    ] {
        refuses(
            &format!("G21 G90\nG0 X10 Y10 Z50\n{line}\nM2\n"),
            &[],
            parts,
        );
    }
    let folder = Folder::new();
    let setup = folder.file("none.toml", "units = \"mm\"\n[offset.G54]\nX = 1\n");
    let program = folder.file("a.ngc", "G21\n#1=#<_x>\n");
    let compensation = crate::program::blob("mill-21");
    let arguments = [
        "gcode",
        &program,
        "-o",
        "o.ngc",
        "--compensation",
        &compensation,
        "--setup",
        &setup,
    ];
    let said = plain(&trueaxis(folder.path(), &arguments).stderr);
    for part in ["line 2", "#<_x>", "that of X is not known", "[start] X"] {
        assert!(said.contains(part), "`{part}` is not in:\n{said}");
    }
    let arguments = [
        "gcode",
        &program,
        "-o",
        "o.ngc",
        "--compensation",
        &compensation,
    ];
    let said = plain(&trueaxis(folder.path(), &arguments).stderr);
    assert!(
        said.contains("--expand: mm or inches, that is not known"),
        "{said}"
    );
}

/// What the interpreter prints before a program for `mill-21`, and after it.
#[cfg(unix)]
const BEFORE: &str = "USE_LENGTH_UNITS(CANON_UNITS_MM)\nSET_G5X_OFFSET(1, 100.0000, 50.0000, -350.0000, 0.0000, 0.0000, 0.0000)\n\
SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\nSET_XY_ROTATION(0.0000)\nSET_FEED_REFERENCE(CANON_XYZ)\nON_RESET()\n\
USE_LENGTH_UNITS(CANON_UNITS_MM)\nSTRAIGHT_TRAVERSE(0.0000, 50.0000, 250.0000, 0.0000, 0.0000, 0.0000)\n\
COMMENT(\"interpreter: motion mode set to none\")\nSELECT_PLANE(CANON_PLANE_XY)\nCOMMENT(\"trueaxis: the program begins\")\n";

/// The command with a script in place of the interpreter, which prints these commands; `|` parts the number of a
/// block from its command.
#[cfg(unix)]
fn scripted(program: &str, commands: &str, end: &str, options: &[&str]) -> (Folder, Output) {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let bin = Folder::new();
    let mut text = String::new();
    for (count, line) in BEFORE.lines().chain(commands.lines()).enumerate() {
        let (block, command) = line.split_once('|').unwrap_or((".....", line));
        text += &format!("{:>5} N{block:<6}{command}\n", count + 1);
    }
    let canonical = bin.file("canonical", text);
    let script = bin.file(
        "rs274",
        format!("#!/bin/sh\nwhile read line; do echo \"$line\"; done < {canonical}\n{end}\n"),
    );
    std::fs::set_permissions(script, std::fs::Permissions::from_mode(0o755)).unwrap();
    let output = with_mill_21(&folder, program, options, |arguments| {
        trueaxis(bin.path(), arguments)
    });
    (folder, output)
}

#[cfg(unix)]
const PROGRAM: &str =
    "G21 G90\n#1=20\no100 sub\nG1 X#1 F300\no100 endsub\no100 call\nT1 M6 G43\nG0 Z200\nM2\n";
#[cfg(unix)]
const COMMANDS: &str = "1|USE_LENGTH_UNITS(CANON_UNITS_MM)\n4|SET_FEED_RATE(300.0000)\n\
4|STRAIGHT_FEED(20.0000, 50.0000, 250.0000, 0.0000, 0.0000, 0.0000)\n7|SELECT_TOOL(1)\n7|START_CHANGE()\n7|STOP_SPINDLE_TURNING(0)\n\
7|CHANGE_TOOL(1)\n7|USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 100.0000, 0.0000 0.0000 0.0000, 0.0000 0.0000 25.4000)\n\
8|STRAIGHT_TRAVERSE(20.0000, 50.0000, 200.0000, 0.0000, 0.0000, 0.0000)\n9|PROGRAM_END()\nON_RESET()\n";

#[cfg(unix)]
#[test]
fn canonical_commands_are_corrected_as_lines_of_the_original() {
    let (folder, output) = scripted(PROGRAM, COMMANDS, "", &["--check"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(
        output.status.code(),
        Some(0),
        "{said}{}",
        plain(&output.stderr)
    );
    assert!(
        said.starts_with("expanded by LinuxCNC's interpreter to 9 lines"),
        "{said}"
    );
    assert!(said.contains("in mm: up to 0.05 µm"), "{said}");
    assert!(
        said.contains("in line 8\n") && !said.contains("in line 9\n"),
        "{said}"
    );
    let out = std::fs::read_to_string(folder.at("out.ngc")).unwrap();
    let first = out.lines().next().unwrap();
    assert!(
        first.starts_with("(trueaxis corrected: part.ngc "),
        "{first}"
    );
    assert!(first.ends_with(", expanded by rs274)"), "{first}");
    for line in [
        "N1 G21 G17 G90 G91.1 G94",
        "N4 G1 X",
        "N7 T1",
        "N7 M6",
        "N7 G43 H1",
        "N8 G0 ",
        "N9 M2",
    ] {
        assert!(out.contains(&format!("\n{line}")), "no {line} in\n{out}");
    }
}

#[cfg(unix)]
#[test]
fn a_command_that_is_not_known_and_output_that_is_cut_off_are_refused() {
    let off = COMMANDS.replace("200.0000,", "999.0000,");
    let probe = COMMANDS.replace("8|STRAIGHT_TRAVERSE", "8|STRAIGHT_PROBE");
    let other = COMMANDS.replace("7|START_CHANGE()", "7|CLAMP_AXIS(X)");
    let words = COMMANDS.replace("SET_FEED_RATE(300.0000)", "SET_FEED_RATE(300.0000, 1)");
    let cut = COMMANDS.split("9|").next().unwrap();
    let again = "[ ! -e again ] || echo more; : > again";
    for (commands, end, parts) in [
        (
            off.as_str(),
            "",
            &["line 8", "in the expanded program", "outside its travel"][..],
        ),
        (&probe, "", &["line 8", "STRAIGHT_PROBE", "probing (G38)"]),
        (&other, "", &["line 7", "CLAMP_AXIS", "is not known"]),
        (
            &words,
            "",
            &["line 4", "SET_FEED_RATE(300.0000, 1)", "other arguments"],
        ),
        (cut, "", &["does not come to an end"]),
        (
            COMMANDS,
            "echo hello",
            &["hello", "not a canonical command"],
        ),
        (COMMANDS, again, &["depends on a parameter", "--var"]),
        (
            COMMANDS,
            "echo executing >&2; echo Division by zero >&2; echo N4 G1 X >&2; exit 1",
            &[
                "line 4",
                "G1 X#1 F300",
                "interpreter refuses it: Division by zero",
            ],
        ),
    ] {
        let (folder, output) = scripted(PROGRAM, commands, end, &[]);
        let said = plain(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        for part in parts {
            assert!(said.contains(part), "`{part}` is not in:\n{said}");
        }
        assert_eq!(folder.names(), ["part.ngc", "setup.toml"]);
    }
}

#[test]
fn the_setup_of_these_tests_has_the_offsets_that_the_script_prints() {
    assert!(SETUP.contains("[offset.G54]\nX = 100\nY = 50\nZ = -350\n"));
}
