//! What is refused: by line and word, with what to do; nothing is written.

use super::{corrected, refuses, refuses_with, with_files};
use crate::program::{Folder, blob, example, plain, refused, trueaxis};

const START: &str = "G21 G90\nG0 X10 Y10 Z50\n";

/// The parts of a message.
fn split(parts: &str) -> Vec<&str> {
    parts.split(" | ").collect()
}

#[test]
fn bad_programs_are_refused_by_line_and_word() {
    for (line, parts) in [
        ("X[1+2]", "line 3 | expression | flat"),
        ("X#5", "line 3 | parameter"),
        ("o100 sub", "line 3 | O-word"),
        ("G1 X5", "line 3 | X5 | feed"),
        ("G187 P1", "line 3 | G187 | --pass G187"),
        ("M100", "line 3 | M100 | --pass M100"),
        ("G0 G1 X5 F1", "line 3 | G1 | second motion word"),
        ("M5 G0 X5 M3", "line 3 | M3 | second word of spindle"),
        (
            "M8 G0 X5 M9",
            "line 3 | M9 | second word of spindle or coolant | two lines",
        ),
        ("G0 X900", "line 3 | X900 | outside its travel | 500"),
        // Its place is within, its correction leads out.
        (
            "G0 Y-50",
            "line 3 | Y-50 | with its correction | `range` | compile again",
        ),
        ("G0 Z99999999", "line 3 | Z9999 | outside its travel"),
        ("G0 Z9999999999", "line 3 | Z9999 | beyond 1e8"),
        ("G10 L2 P1 A9999999999", "line 3 | A9999 | beyond 1e8"),
        ("G0 A5\nA6", "line 4 | A6 | no axis A"),
        ("G55 G0 X5", "line 3 | X5 | G55 | [offset.\"G55\"]"),
        ("G43 H7", "line 3 | G43 | tool 7 | [tool.7]"),
        ("G2 X20 Y10 I3 F100", "line 3 | I3 | radius does not fit"),
        ("G2 X20 Y10 R3 F100", "line 3 | R3 | radius does not fit"),
        ("G2 X20 Y10 F100", "line 3 | without a centre"),
        (
            "G41 D1\nG98 G81 X10 Z5 R20 F100",
            "line 4 | X10 | under G41 | G40",
        ),
        (
            "G4 P1 G2 X10 I5 F100",
            "line 3 | P1 | two others | two lines",
        ),
        ("/G0 X5", "line 3 | --block-delete"),
        ("G0 X5 X6", "line 3 | X6 | second word X"),
        ("G0 X", "line 3 | without a number"),
        (
            "G0 X1e1",
            "line 3 | e1 | an exponent | write the number out",
        ),
        (
            "G0 X1 E1",
            "line 3 | E1 | does not have | --dialect printer",
        ),
        ("G0 X5 \u{e4}", "line 3 | begins no word"),
        (
            "G28\nG0 X5",
            "line 4 | position of Y is unknown here after G28 | [home.G28] Y = ",
        ),
        ("G30\nG0 X5", "line 4 | after G30 | [home.G30] Y = "),
        (
            "G38.2 Z-5 F10\nG1 X5",
            "line 4 | position of Z | after probing | G53 G0 Z",
        ),
        (
            "G2 I0.005 F100",
            "line 3 | I0.005 | radius of 0.0050 mm, less than 0.01 mm",
        ),
        (
            "G2 X10.01 Y10 R.005 F100",
            "line 3 | R.005 | less than 0.01 mm",
        ),
        (
            "G3 I0 J0 F100",
            "line 3 | I0 | radius of 0.0000 mm, less than 0.01 mm",
        ),
        ("M428", "line 3 | M428 | --machine"),
        ("M61", "line 3 | M61 | without Q"),
        ("G92.3", "line 3 | G92.3 | --var"),
        (
            "G81 X12 Y12 Z45 R48 F100",
            "line 3 | G98 | G99 | [start] retract",
        ),
        ("S10 M3\nG53 G33.1 Z45 K1", "line 4 | G53 without G0"),
        ("G53 G38.2 Z45 F100", "line 3 | G53 without G0"),
        ("G52", "line 3 | G52 | without axes"),
        ("G33 X12 K0", "line 3 | K0 | positive"),
        (
            "G98 G81 X12 Y12 Z45 R48 F100\nG92 Z7\nX15",
            "line 5 | X15 | series of cycles | G80",
        ),
        (
            "G98 G81 X12 Y12 Z45 R48 F100\nG18 G81 X15 Y8 Z45 R9",
            "line 4 | series of cycles | G80",
        ),
        (
            "G92 X22\nG10 L2 P1 R-20",
            "line 4 | R-20 | rotation | G92.1",
        ),
        ("G10 L2 P2 X1", "line 3 | G10 | G55 | [offset.\"G55\"]"),
        ("G10 L2 P2 X1 Y2 Z3", "line 3 | rotation | [offset.\"G55\"]"),
        ("G10 L1 P9 Z30", "line 3 | G10 | tool 9 | [tool.9]"),
        ("M6\nG43", "line 4 | G43 | without H | [start] tool"),
    ] {
        refuses(format!("{START}{line}\nM30\n"), &[], &split(parts));
    }
}

#[test]
fn what_is_not_built_is_refused_by_its_name() {
    for (line, parts) in [
        (
            "G5 X1 Y1 I1 J1 P1 Q1",
            "G5 | splines | write the program out",
        ),
        ("G5.1 X1 Y1 I1 J1", "G5.1 | splines | write the program out"),
        ("G5.2 X1 Y1 P1 L3", "G5.2 | splines | write the program out"),
        ("G7", "G7 | lathes | write the program out"),
        ("G8", "G8 | lathes | write the program out"),
        (
            "G76 P1 Z-1 I-1 J1 K1",
            "G76 | threading cycles of lathes | write the program out",
        ),
        (
            "G68 X0 Y0 R10",
            "G68 | rotated coordinates | write the program out",
        ),
        ("G81 @10 ^60 Z1 R2", "@10 | polar coordinates | X and Y"),
        ("G16", "G16 | polar coordinates | write the program out"),
        ("G51 X0 Y0 P2", "G51 | scaled | write the program out"),
        (
            "G87 X1 Z1 R2",
            "G87 | stopped spindle | write the program out",
        ),
        (
            "G88 X1 Z1 R2 P1",
            "G88 | stopped spindle | write the program out",
        ),
        ("G70 Q1", "G70 | lathes | write the program out"),
        ("G10 L10 P1 Z30", "G10 | L10 | setup"),
        ("G10 L11 P1 Z30", "G10 | L11 | setup"),
        ("G10 L0", "G10 | L20 | setup"),
        ("M70", "M70 | stored and brought back"),
        ("M72", "M72 | stored and brought back | the modes"),
        ("M98 P1", "M98 | subprogram | flat"),
        ("G65 P9000", "G65 | macro calls | write the program out"),
    ] {
        let parts = [&["line 3"], &split(parts)[..]].concat();
        refuses(format!("{START}{line}\nM30\n"), &[], &parts);
    }
    let fanuc = ["--dialect", "fanuc"];
    let start = "G21 G90 G17\nG0 X10. Y10. Z50.\n";
    for (line, parts) in [
        ("G68 X0. Y0. R10.", "G68 | rotated coordinates"),
        ("G43.5 H1", "G43.5 | vectors"),
        (
            "G52 X1.\nG92 X0.",
            "line 4 | G92 while G52 is active | take G52 back",
        ),
        (
            "G92 X0.\nG52 X1.",
            "line 4 | G52 while G92 is active | take G92 back",
        ),
        ("M98 P1000", "M98 | no program O1000 | append"),
        ("G99 G81 X1. Z2. R2. F90.", "half a micrometre"),
    ] {
        refuses(format!("{start}{line}\nM30\n"), &fanuc, &split(parts));
    }
    refuses(
        format!("{START}G52 X1\nM30\n"),
        &["--dialect", "grbl"],
        &["line 3", "G52", "--dialect"],
    );
}

#[test]
fn files_that_are_no_programs_are_refused() {
    refuses("", &[], &["line 1", "empty"]);
    refuses("%\n%\n", &[], &["line 2", "empty", "between lines %"]);
    let folder = Folder::new();
    corrected(&folder, "%\n(nothing)\n%\n", &[]);
    for text in [
        "G21\rG90\rG0 X1\r",
        "(part 7)\rG21\r",
        "; part 7\rG21 G90\rG0 X1\r",
        "%\rG21\rM30\r%\r",
    ] {
        refuses(text, &[], &["line 1", "carriage return", "CR alone"]);
    }
    refuses("; part\r".repeat(3000), &[], &["line 1", "CR alone"]);
    for text in [
        "\u{feff}G21\n",
        "\u{feff}%\nG21\nM30\n%\n",
        "\u{feff}(part 7)\nG21\n",
    ] {
        refuses(text, &[], &["line 1", "byte order mark", "UTF-8 without"]);
    }
    refuses("G0 (never ends\n", &[], &["line 1", "does not end"]);
    refuses(vec![b'X'; 30_000], &[], &["line 1"]);
    refuses(vec![0; 300], &[], &["line 1", "NUL", "UTF-16"]);
    refuses(
        b"\xff\xfeG\x002\x001\x00\n\x00",
        &[],
        &["line 1", "the file is UTF-16"],
    );
    refuses("G21\r\r\nG90\r\r\n", &[], &["line 1", "CR CR LF"]);
    refuses(
        "0 BEGIN PGM PLATE MM\n1 BLK FORM 0.1 Z X-60 Y-40 Z-20\n",
        &[],
        &["line 1", "Heidenhain Klartext", "export heidenhain"],
    );
    let control = "export heidenhain";
    for line in [
        "L X+5 Y+5 R0 FMAX",
        "7 L Z+100 R0 FMAX",
        "CC X+0 Y+0",
        "* - Drill",
        "LBL 1",
    ] {
        refuses(
            format!("G21 G90\n{line}\n"),
            &[],
            &["line 2", "Klartext", control],
        );
    }
    for (program, line) in [
        ("%PLATE G71 *\nN10 G30 G17 X+0 Y+0 Z-20 *\n", "line 1"),
        ("N30 T4 G17 S6000 *\n", "line 1"),
        ("G21\nN40 G01 X+5 R F250 *\n", "line 2"),
    ] {
        refuses(program, &[], &[line, "DIN/ISO of a Heidenhain", control]);
    }
    for dialect in ["linuxcnc", "printer"] {
        let parts = ["line 1", "*85", "a checksum", "take the checksums out"];
        refuses("N12 G1 X5*85\n", &["--dialect", dialect], &parts);
    }
    refuses(
        "G21\nG0 X10\n",
        &["--dialect", "fanuc"],
        &["line 2", "X10", "decimal point", "calculator"],
    );
    let remedy = "get the whole file";
    refuses(
        format!("{START}G0 X1"),
        &[],
        &["line 3", "within a line", remedy],
    );
    refuses(
        format!("%\n{START}G0 X1\n"),
        &[],
        &["line 4", "begins with %", remedy],
    );
    refuses(
        format!("%\n{START}G0 X"),
        &[],
        &["line 4", "without a number"],
    );
    // Whole ones.
    let folder = Folder::new();
    for end in ["G0 X1\n", "G0 X1\nM30", "G0 X1\nM2\n%", "%"] {
        let out = corrected(&folder, &format!("{START}{end}"), &[]);
        assert!(out.ends_with(end.split('\n').next_back().unwrap()), "{out}");
    }
    // Lines after the end are not part of the program.
    let out = corrected(
        &folder,
        &format!("%\n{START}%\nwhat [this] is\rnobody knows"),
        &[],
    );
    assert!(out.ends_with("%\nwhat [this] is\rnobody knows"), "{out}");
}

/// What is refused of files beside the program.
fn refuses_files(folder: &Folder, options: &[&str], parts: &[&str]) {
    let (part, out) = (folder.file("part.ngc", START), folder.at("out.ngc"));
    let mut arguments = vec!["gcode", &part, "-o", &out];
    arguments.extend(options);
    refused(&arguments, parts);
    assert!(!folder.names().contains(&"out.ngc".to_owned()));
}

#[test]
fn a_compensation_or_a_machine_for_other_axes_is_refused() {
    let folder = Folder::new();
    let setup = folder.file("setup.toml", super::SETUP);
    let [mill, trunnion] = ["mill-21", "xyzac-trt"].map(blob);
    let machines = ["mill-21/machine.toml", "linuxcnc-xyzac-trt/machine.toml"].map(example);
    let names = ["xyzac-trt", "Mill with 21 errors"];
    let other = "the machine file from which the compensation was compiled";
    for (compensation, machine) in [(&mill, &machines[1]), (&trunnion, &machines[0])] {
        let options = ["--setup", &setup, "--compensation", compensation];
        let options = [&options[..], &["--machine", machine]].concat();
        refuses_files(&folder, &options, &[names[0], names[1], other]);
    }
    // Axes that the program does not name, and whose corrections would be written: where they are is not known.
    refuses_files(
        &folder,
        &["--setup", &setup, "--compensation", &trunnion],
        &["line 2", "position of A is unknown", "[start] A"],
    );
}

#[test]
fn setups_that_cannot_be_are_refused_at_their_place() {
    let folder = Folder::new();
    let mill = blob("mill-21");
    let with = |name: &str, text: &str, option: &str, parts: &[&str]| {
        let file = folder.file(name, text);
        let options = [option, &file, "--units", "mm", "--compensation", &mill];
        refuses_files(&folder, &options, parts);
    };
    for index in ["0", "10", "1.5", "-1"] {
        let text = format!("5221 0\n5220 {index}\n");
        with("linuxcnc.var", &text, "--var", &["5220", "1 to 9"]);
    }
}

/// `rs274 -t` of LinuxCNC 2.9: "Unrecognized line skipped", "Requested tool 2 not found in the tool table".
#[test]
fn a_tool_that_linuxcnc_does_not_read_is_refused_where_a_program_uses_it() {
    let folder = Folder::new();
    let tools = folder.file("tools.tbl", "T1 P1 Z50, D6\nT2 P2 Z 30 D6\nT1 P3 Z60\n");
    let program = |tool: u32| format!("{START}G43 H{tool}\nG0 Z55\nM30\n");
    let files = [&blob("mill-21"), super::SETUP];
    let options = ["--tools", &tools];
    let output = with_files(&folder, program(1), files, &options, trueaxis);
    assert!(output.status.success());
    let said = plain(&output.stderr);
    for warning in [
        "tools.tbl, line 1: LinuxCNC ignores `,` in `Z50,`",
        "tools.tbl, line 2: left out: LinuxCNC skips the line, because `Z`",
        "tools.tbl, line 3: left out: LinuxCNC uses the first tool 1, in line 1",
    ] {
        assert!(said.contains(warning), "{said}");
    }
    let parts = ["line 3", "G43", "tool 2", "[tool.2]"];
    refuses(program(2), &options, &parts);
}

#[test]
fn axes_of_the_compensation_that_nobody_gives_are_named_with_their_machine() {
    let program = "G21 G90\nG1 X5 F100\nM30\n";
    let setup = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -20\n[offset.G54]\n";
    let parts = [
        "line 2",
        "position of A",
        "[start] A = ",
        "axes X Y Z A C of xyzac-trt",
    ];
    refuses_with(program, [&blob("xyzac-trt"), setup], &[], &parts);
}

#[test]
fn a_word_to_pass_is_one_that_a_program_can_have() {
    for (word, example) in [
        ("foo", "--pass G187 or --pass M100"),
        ("TRAORI", "--pass G187 or --pass M100"),
        ("G", "--pass G187 or --pass M100"),
        ("M", "--pass G187 or --pass M100"),
        ("G05.10", "--pass G5.1"),
    ] {
        let named = format!("--pass {word}");
        refuses(START, &["--pass", word], &[&named, example]);
    }
}

#[test]
fn nearly_a_full_turn_under_cutter_compensation_is_refused() {
    // From where the machine stands to the corrected end: that chord says nothing of the centre.
    for end in ["Y50.002", "Y50.01 X0.003"] {
        refuses(
            format!("G21 G90 G17\nG41 D1\nG2 I-3 {end} F100\nG1 X5\nM30\n"),
            &[],
            &["line 3", "arc under cutter compensation", "without G41"],
        );
    }
}

#[test]
fn words_that_move_are_not_passed_and_what_they_end_is() {
    for (word, dialect) in [
        ("G5 I1 J1", "linuxcnc"),
        ("G7", "linuxcnc"),
        ("G12 I5", "fanuc"),
        ("G16", "fanuc"),
        ("G31", "fanuc"),
        ("G43.5", "fanuc"),
        ("G51 P2", "fanuc"),
        ("G60", "fanuc"),
        ("G66 P9100", "fanuc"),
        ("G68 R30.", "fanuc"),
        ("G254", "fanuc"),
    ] {
        let name = word.split(' ').next().unwrap();
        refuses(
            format!("G21 G90\n{word}\nM30\n"),
            &["--pass", name, "--dialect", dialect],
            &["line 2", name],
        );
    }
    let folder = Folder::new();
    for (word, dialect) in [
        ("G8", "linuxcnc"),
        ("G50", "linuxcnc"),
        ("G65 P9832", "fanuc"),
    ] {
        let name = word.split(' ').next().unwrap();
        let out = corrected(
            &folder,
            &format!("G21 G90\n{word}\nM30\n"),
            &["--pass", name, "--dialect", dialect],
        );
        assert!(out.contains(&format!("\n{word}\n")), "{out}");
    }
}

#[test]
fn errors_that_cannot_be_checked_with_leave_no_file() {
    let machine = example("mill-21/machine.toml");
    for errors in ["huron-k2x8/errors-13.toml", "none.toml"] {
        let errors = example(errors);
        refuses(
            "G21 G90\nG0 X10 Y10 Z50\nM30\n",
            &["--check", "--machine", &machine, "--errors", &errors],
            &[&errors],
        );
    }
}

#[test]
fn a_tolerance_that_words_cannot_keep_is_refused() {
    let parts = ["--tolerance 0.2", "between 0.3 and 1000"];
    refuses("G21\n", &["--tolerance", "0.2"], &parts);
}
