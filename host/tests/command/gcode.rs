//! `trueaxis gcode`: programs corrected.

mod random;
mod reversals;

use crate::program::{Folder, answer, blob, example, refused};

/// The machine `mill-21` in the middle of its travel.
pub const SETUP: &str = "units = \"mm\"\n[start]\nX = 100\nY = 100\nZ = -100\n\
[offset.G54]\nX = 100\nY = 50\nZ = -350\n[tool.1]\nlength = 100\n";

/// Corrects a program for `mill-21`: what is written.
fn corrected(folder: &Folder, program: &str, options: &[&str]) -> String {
    let (out, _) = run(folder, program, options);
    out
}

/// The same, and what is said.
fn run(folder: &Folder, program: &str, options: &[&str]) -> (String, String) {
    let said = with_mill_21(folder, program, options, |arguments| answer(0, arguments));
    let out = std::fs::read_to_string(folder.at("out.ngc")).unwrap();
    (out, said)
}

/// What is refused, with parts of the message; nothing is written.
fn refuses(program: impl AsRef<[u8]>, options: &[&str], parts: &[&str]) {
    let folder = Folder::new();
    with_mill_21(&folder, program, options, |arguments| {
        refused(arguments, parts);
    });
    assert_eq!(folder.names(), ["part.ngc", "setup.toml"]);
}

/// Runs the command with a program for `mill-21`, into `out.ngc`.
fn with_mill_21<T>(
    folder: &Folder,
    program: impl AsRef<[u8]>,
    options: &[&str],
    run: impl FnOnce(&[&str]) -> T,
) -> T {
    let part = folder.file("part.ngc", program);
    let setup = folder.file("setup.toml", SETUP);
    let (out, compensation) = (folder.at("out.ngc"), blob("mill-21"));
    let mut arguments = vec!["gcode", &part, "-o", &out];
    arguments.extend(["--compensation", &compensation, "--setup", &setup]);
    arguments.extend(options);
    run(&arguments)
}

#[test]
fn everything_that_is_not_changed_is_passed_byte_for_byte() {
    let folder = Folder::new();
    let program = "%\r\n(a comment, 100% of it)\r\nN10  g21 G90 ; modes\r\n\r\n/ M8\r\nN20 G0 X0.0 Y0 Z5 (there)\r\nN30 M3 S1000\r\nM30\r\n%\r\nnotes [behind] the end\r\n";
    let out = corrected(&folder, program, &["--tolerance", "1000"]);
    let lines: Vec<&str> = out.split_inclusive("\r\n").collect();
    assert!(
        lines[1].starts_with("(trueaxis corrected: mill-21 "),
        "{out}"
    );
    assert!(lines[1].contains("machine Mill with 21 errors, setup setup.toml"));
    let mut rest = lines.clone();
    rest.remove(1);
    let original: Vec<&str> = program.split_inclusive("\r\n").collect();
    assert_eq!(rest.len(), original.len());
    for (line, (new, old)) in rest.iter().zip(&original).enumerate() {
        if line == 5 {
            assert!(
                new.starts_with("N20 G0 X") && new.ends_with(" (there)\r\n"),
                "{new}"
            );
        } else {
            assert_eq!(new, old);
        }
    }
}

#[test]
fn end_points_are_those_of_eval_and_moves_are_cut_only_where_it_bends() {
    let folder = Folder::new();
    let out = corrected(&folder, "G21 G90\nG0 X0 Y0 Z50\nG1 X20 F600\nX21\n", &[]);
    // X100 Y50 Z-300 of the machine, then X120, X121.
    let positions = folder.file("p.csv", "X,Y,Z\n100,50,-300\n120,50,-300\n121,50,-300\n");
    let printed = answer(0, &["eval", &blob("mill-21"), "--positions", &positions]);
    let mut rows = printed.lines();
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    let x = header.iter().position(|h| *h == "dX").unwrap();
    let rows: Vec<f64> = rows
        .map(|r| r.split(',').nth(x).unwrap().parse().unwrap())
        .collect();
    for (row, nominal) in rows.iter().zip([0.0, 20.0, 21.0]) {
        let expected = nominal + row;
        let found = out.lines().any(|line| {
            let word = line.split_whitespace().find(|w| w.starts_with('X'));
            word.is_some_and(|w| (w[1..].parse::<f64>().unwrap() - expected).abs() < 5.1e-5)
        });
        assert!(found, "no X{expected} in\n{out}");
    }
    let last = out.lines().last().unwrap();
    assert!(last.starts_with("X21."), "a millimetre needs no cut: {out}");
}

#[test]
fn modes_and_offsets_of_a_line_hold_for_its_own_motion() {
    let folder = Folder::new();
    let apart =
        "G21\nG90\nG54\nG0 X10 Y10 Z50\nT1 M6\nG43 H1\nG0 Z-10\nG20\nF30\nG1 X0.5\nG91\nG1 Y0.1\n";
    let together =
        "G21 G90 G54 G0 X10 Y10 Z50\nT1 M6\nG43 H1 G0 Z-10\nG20 G0\nF30\nG1 X0.5\nG91 G1 Y0.1\n";
    let ends = |program: &str| {
        let out = corrected(&folder, program, &["--check"]);
        let words = out
            .split_whitespace()
            .filter(|w| w.starts_with(['X', 'Y', 'Z']));
        words.map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(ends(apart), ends(together));
    let one = "G20 G90 G54 G0 X0.5 Y0.5 Z2 (in one line)\nF10\nG21 G91 G0 X1\n";
    corrected(&folder, one, &["--check"]);
}

#[test]
fn a_corrected_program_is_not_corrected_twice_and_can_be_undone() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nG1 X20 Y5 F600\nG2 X30 Y15 I0 J10\nM30\n";
    let out = corrected(&folder, program, &[]);
    refuses(&out, &[], &["line 1", "corrected already", "--undo"]);
    let back = corrected(&folder, &out, &["--undo"]);
    assert!(!back.contains("trueaxis"), "{back}");
    // Every original end point is there again, to the resolution of the words.
    let ends = [[0.0, 0.0, 50.0], [20.0, 5.0, 50.0], [30.0, 15.0, 50.0]];
    let mut at = [100.0, 100.0, -100.0];
    let mut next = 0;
    for line in back.lines() {
        for word in line.split_whitespace() {
            if let Some(axis) = "XYZ".find(&word[..1]) {
                at[axis] = word[1..].parse().unwrap();
            }
        }
        let near = |end: &[f64; 3]| end.iter().zip(at).all(|(e, a)| (e - a).abs() < 1.1e-4);
        if next < 3 && near(&ends[next]) {
            next += 1;
        }
    }
    assert_eq!(next, 3, "{back}");
}

#[test]
fn arcs_stay_arcs_where_they_can_and_nothing_of_them_is_left_where_not() {
    let folder = Folder::new();
    let program =
        "G21 G90 G17\nG0 X50 Y50 Z50\nG2 X52 Y50 R1 F300 (small)\nG3 X150 Y50 R49\nX60 I-45\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    let small = out.lines().find(|l| l.contains("(small)")).unwrap();
    assert!(
        small.starts_with("G2 X52.") && small.contains(" I") && !small.contains('R'),
        "{small}"
    );
    // The second one becomes chords: no radius, no centre, until the third.
    assert_eq!(out.matches(" R").count(), 0, "{out}");
    assert!(said.contains("arcs: 1 stay, 2 are chords"), "{said}");
}

#[test]
fn g92_says_the_same_of_a_corrected_position() {
    let folder = Folder::new();
    // The same place by two ways.
    let program = "G21 G90\nG0 X20 Y10 Z50\nG92 X0 Y0\nG0 X5 Y5\nG92.1\nG0 X25 Y15\nM30\n";
    let out = corrected(&folder, program, &["--check"]);
    let word = |line: &str, letter: char| -> Option<f64> {
        let word = line.split_whitespace().find(|w| w.starts_with(letter))?;
        word[1..].parse().ok()
    };
    let shifted = out.lines().find(|l| l.starts_with("G92 ")).unwrap();
    let before = out
        .lines()
        .take_while(|l| !l.starts_with("G92 "))
        .filter_map(|l| word(l, 'X'))
        .last()
        .unwrap();
    // What the position is more than X20 the word is more than X0.
    assert!(
        (word(shifted, 'X').unwrap() - (before - 20.0)).abs() < 1.1e-5,
        "{out}"
    );
    // At the end nothing moves: it is there already.
    let last = out.lines().rev().find(|l| l.starts_with("G0 ")).unwrap();
    let previous = out
        .lines()
        .filter(|l| l.starts_with("G0 X5.") || l.starts_with("G0 X4."))
        .filter_map(|l| word(l, 'X'))
        .next_back()
        .unwrap();
    assert!(
        (word(last, 'X').unwrap() - previous - 20.0).abs() < 2.1e-4,
        "{out}"
    );
}

#[test]
fn cycles_stay_cycles_or_are_written_out() {
    let folder = Folder::new();
    let program = "G21 G90 G98\nG0 X20 Y10 Z50\nG81 X30 Y30 Z45 R47 F100\nX40\nG80\nG83 X50 Z1 R47 Q20\nG80\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    assert!(
        said.contains("cycles: 2 stay, 1 are written out"),
        "{said}\n{out}"
    );
    assert!(out.contains("G81 X"), "{out}");
    assert!(!out.contains("G83") && !out.contains('Q'), "{out}");
}

#[test]
fn bad_programs_are_refused_by_line_and_word() {
    let start = "G21 G90\nG0 X10 Y10 Z50\n";
    for (line, parts) in [
        ("X[1+2]", &["line 3", "expression", "flat"][..]),
        ("X#5", &["line 3", "parameter"]),
        ("o100 sub", &["line 3", "O-word"]),
        ("G1 X5", &["line 3", "X5", "feed"]),
        ("G187 P1", &["line 3", "G187", "--pass G187"]),
        ("M100", &["line 3", "M100", "--pass M100"]),
        ("G0 G1 X5 F1", &["line 3", "G1", "second motion word"]),
        ("G0 X900", &["line 3", "X900", "outside its travel", "500"]),
        ("G0 A5", &["line 3", "A5", "no axis A"]),
        ("G55 G0 X5", &["line 3", "X5", "G55", "[offset.\"G55\"]"]),
        ("G43 H7", &["line 3", "G43", "tool 7", "[tool.7]"]),
        (
            "G2 X20 Y10 I3 F100",
            &["line 3", "I3", "radius does not fit"],
        ),
        (
            "G2 X20 Y10 R3 F100",
            &["line 3", "R3", "radius does not fit"],
        ),
        ("G2 X20 Y10 F100", &["line 3", "without a centre"]),
        ("/G0 X5", &["line 3", "--block-delete"]),
        ("G0 X5 X6", &["line 3", "X6", "second word X"]),
        ("G0 X", &["line 3", "without a number"]),
        ("G0 X5 \u{e4}", &["line 3", "begins no word"]),
        ("G68 X0 Y0 R10", &["line 3", "G68"]),
        ("G28\nG0 X5", &["line 4", "position of Y is not known"]),
        ("M428", &["line 3", "M428", "--machine"]),
    ] {
        refuses(format!("{start}{line}\nM30\n"), &[], parts);
    }
    refuses("", &[], &["empty"]);
    refuses("G21\rG90\rG0 X1\r", &[], &["line 1", "carriage return"]);
    refuses("\u{feff}G21\n", &[], &["line 1", "byte order mark"]);
    refuses("G0 (never ends\n", &[], &["line 1", "does not end"]);
    refuses(vec![b'X'; 30_000], &[], &["line 1"]);
    refuses(
        "G21\nG0 X10\n",
        &["--dialect", "fanuc"],
        &["line 2", "X10", "decimal point"],
    );
}

#[test]
fn words_that_are_named_are_passed_and_pass_nothing_else() {
    let folder = Folder::new();
    let out = corrected(
        &folder,
        "G21 G90\nG187 P1\nG0 X1 Y1 Z50\n",
        &["--pass", "G187"],
    );
    assert!(out.contains("\nG187 P1\n"));
}

#[test]
fn check_shows_what_is_left_on_the_part() {
    let folder = Folder::new();
    let program =
        "G21 G90 G17\nG0 X0 Y0 Z50\nG1 X200 F600\nY100\nG3 X0 Y100 R100\nG1 Y0 Z20\nM30\n";
    let machine = example("mill-21/machine.toml");
    let errors = example("mill-21/errors-21.toml");
    let options = [
        "--check",
        "--machine",
        &machine,
        "--errors",
        &errors,
        "--json",
    ];
    let (_, said) = run(&folder, program, &options);
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let check = &said["check"];
    let path = &check["tool_path"];
    assert!(path["before_um"]["max"].as_f64().unwrap() > 20.0, "{said}");
    // The tolerance, the chord, and what the compensation leaves.
    assert!(path["after_um"]["max"].as_f64().unwrap() < 1.6, "{said}");
    assert_eq!(check["times_differ"], 0);
    let [before, after] = [0, 1].map(|k| check["minutes"][k].as_f64().unwrap());
    assert!((before / after - 1.0).abs() < 1e-3);
}

#[test]
fn tool_centre_point_programs_stay_what_they_are() {
    let folder = Folder::new();
    let setup = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -20\nA = 0\nC = 0\n\
travel = { X = \"+\", Y = \"+\", Z = \"+\", A = \"+\", C = \"+\" }\n[offset.G54]\nX = 200\nY = 150\nZ = -180\n";
    let setup = folder.file("setup.toml", setup);
    let program = "G21 G90\nM428\nG0 X30 Y0 Z20 A0 C0\nG93\nG1 A-30 C40 F20\nG1 X20 Y10 A-60 C90 F6\nG94\nG1 X10 F500\nM429\nM30\n";
    let part = folder.file("part.ngc", program);
    let out = folder.at("out.ngc");
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let errors = example("linuxcnc-xyzac-trt/errors-11.toml");
    let compensation = blob("xyzac-trt");
    let said = answer(
        0,
        &[
            "gcode",
            &part,
            "-o",
            &out,
            "--compensation",
            &compensation,
            "--setup",
            &setup,
            "--machine",
            &machine,
            "--errors",
            &errors,
            "--check",
            "--json",
        ],
    );
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let path = &said["check"]["tool_path"];
    assert!(path["before_um"]["max"].as_f64().unwrap() > 20.0, "{said}");
    assert!(path["after_um"]["max"].as_f64().unwrap() < 0.7, "{said}");
    assert_eq!(said["check"]["times_differ"], 0, "{said}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("\nM428\n") && text.contains("\nM429\n"));
}

#[test]
fn a_purely_rotary_move_does_not_rush() {
    let folder = Folder::new();
    let setup = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -20\nA = 0\nC = 0\n\
travel = { X = \"+\", Y = \"+\", Z = \"+\", A = \"+\", C = \"+\" }\n[offset.G54]\n";
    let setup = folder.file("setup.toml", setup);
    let part = folder.file(
        "part.ngc",
        "G21 G90\nG0 X200 Y150 Z-21 A1 C1\nG1 A2 C1.5 F360\nG1 X201 F360\nM30\n",
    );
    let out = folder.at("out.ngc");
    let said = answer(
        0,
        &[
            "gcode",
            &part,
            "-o",
            &out,
            "--compensation",
            &blob("xyzac-trt"),
            "--setup",
            &setup,
            "--check",
            "--json",
        ],
    );
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["check"]["times_differ"], 0, "{said}");
    let text = std::fs::read_to_string(&out).unwrap();
    let feed = |line: &str| -> Option<f64> {
        let word = line.split_whitespace().find(|w| w.starts_with('F'))?;
        word[1..].parse().ok()
    };
    let slow = text
        .lines()
        .find(|l| l.starts_with("G1 A"))
        .and_then(feed)
        .unwrap();
    // A few µm in the time of 1.1 degrees at 360 degrees per minute.
    assert!(slow < 5.0, "{text}");
    let back = text
        .lines()
        .find(|l| l.starts_with("G1 X"))
        .and_then(feed)
        .unwrap();
    assert_eq!(back, 360.0);
}
