//! `trueaxis gcode`: programs corrected.

mod accepted;
mod backlash;
mod cycles;
mod dialects;
mod five_axes;
mod hemisphere;
mod posts;
mod printer;
mod refused;
mod reversals;
mod tool_length;
mod wrapped;

use crate::program::{Folder, answer, blob, example, refused};

/// The machine `mill-21` in the middle of its travel.
pub const SETUP: &str = "units = \"mm\"\n[start]\nX = 100\nY = 100\nZ = -100\n\
[offset.G54]\nX = 100\nY = 50\nZ = -350\n[tool.1]\nlength = 100\n";

/// Corrects a program for `mill-21`: what is written.
fn corrected(folder: &Folder, program: &str, options: &[&str]) -> String {
    let (out, _) = run(folder, program, options);
    out
}

/// The corrected program, and what is said.
fn run(folder: &Folder, program: &str, options: &[&str]) -> (String, String) {
    let files = [&blob("mill-21"), SETUP];
    let said = with_files(folder, program, files, options, |words| answer(0, words));
    (written(folder), said)
}

/// What is refused, with parts of the message; nothing is written.
fn refuses(program: impl AsRef<[u8]>, options: &[&str], parts: &[&str]) {
    refuses_with(program, [&blob("mill-21"), SETUP], options, parts);
}

/// Like `refuses`, with another compensation and another setup.
fn refuses_with(program: impl AsRef<[u8]>, files: [&str; 2], options: &[&str], parts: &[&str]) {
    let folder = Folder::new();
    with_files(&folder, program, files, options, |words| {
        refused(words, parts)
    });
    assert_eq!(folder.names(), ["part.ngc", "setup.toml"]);
}

/// Corrects and checks a program for `mill-21` with a setup of its own: what is written.
fn with_setup(program: &str, setup: &str, options: &[&str]) -> String {
    let folder = Folder::new();
    let options = [options, &["--check"]].concat();
    let files = [&blob("mill-21"), setup];
    with_files(&folder, program, files, &options, |words| answer(0, words));
    written(&folder)
}

/// Runs the command with a program, a compensation and the text of a setup, into `out.ngc`.
fn with_files<T>(
    folder: &Folder,
    program: impl AsRef<[u8]>,
    [compensation, setup]: [&str; 2],
    options: &[&str],
    run: impl FnOnce(&[&str]) -> T,
) -> T {
    let part = folder.file("part.ngc", program);
    let setup = folder.file("setup.toml", setup);
    let out = folder.at("out.ngc");
    let mut arguments = vec!["gcode", &part, "-o", &out];
    arguments.extend(["--compensation", compensation, "--setup", &setup]);
    arguments.extend(options);
    run(&arguments)
}

/// The corrected program.
fn written(folder: &Folder) -> String {
    std::fs::read_to_string(folder.at("out.ngc")).unwrap()
}

#[test]
fn everything_that_is_not_changed_is_passed_byte_for_byte() {
    let folder = Folder::new();
    let program = "%\r\n(a comment, 100% of it)\r\nN10  g21 G90 ; modes\r\n\r\n/ M8\r\nN20 G0 X0.0 Y0 Z5 (there)\r\nN30 M3 S1000\r\nM30\r\n%\r\nnotes [behind] the end\r\n";
    let out = corrected(&folder, program, &["--tolerance", "1000"]);
    let lines: Vec<&str> = out.split_inclusive("\r\n").collect();
    assert!(
        lines[1].starts_with("(trueaxis corrected: part.ngc "),
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
fn a_corrected_program_names_its_original_and_is_not_corrected_twice() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nG1 X20 Y5 F600\nG2 X30 Y15 I0 J10\nM30\n";
    let out = corrected(&folder, program, &[]);
    refuses(&out, &[], &["line 1", "corrected already", "first comment"]);
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(program.as_bytes());
    let names = format!("(trueaxis corrected: part.ngc {sum:08x}, compensation mill-21");
    assert!(out.starts_with(&names), "{out}");
}

#[test]
fn arcs_stay_arcs() {
    let folder = Folder::new();
    let program =
        "G21 G90 G17\nG0 X50 Y50 Z50\nG2 X52 Y50 R1 F300 (small)\nG3 X150 Y50 R49\nX60 I-45\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    let small = out.lines().find(|l| l.contains("(small)")).unwrap();
    assert!(
        small.starts_with("G2 X52.") && small.contains(" I") && !small.contains('R'),
        "{small}"
    );
    // With another centre, and no radius.
    assert_eq!(out.matches(" R").count(), 0, "{out}");
    assert!(said.contains("arcs: 3 stay, 0 are chords"), "{said}");
}

#[test]
fn a_full_circle_becomes_at_most_sixteen_arcs() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEC0X = 50e-6\nEXX1 = 40e-6\nEYY1 = -30e-6\nEZZ1 = 20e-6\n\
         EXXb = 4e-3\nEYYb = 3e-3\nEZZb = 5e-3\n",
    );
    let setup = folder.file(
        "setup.toml",
        "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -200\ntravel = { X = \"+\", Y = \"+\", Z = \"-\" }\n\
         [offset.G54]\nX = 200\nY = 150\nZ = -200\n",
    );
    let (trax, out) = (folder.at("backlash.trax"), folder.at("out.ngc"));
    let machine = example("mill-21/machine.toml");
    answer(0, &["compile", &machine, &errors, "-o", &trax]);
    for radius in [10, 50, 100] {
        for circle in ["G17 G2 I", "G17 G3 Z-5 I", "G18 G2 I", "G19 G3 J"] {
            // Where it fits into the travel of Y.
            let radius = if circle.starts_with("G19") {
                radius.min(70)
            } else {
                radius
            };
            let start = if circle.starts_with("G19") {
                "X0 Y-"
            } else {
                "Y0 X-"
            };
            let program =
                format!("G21 G90\nG0 {start}{radius} Z0\nG1 F600\n{circle}{radius}\nM30\n");
            let part = folder.file("part.ngc", &program);
            let arguments = ["gcode", &part, "-o", &out, "--compensation", &trax];
            let said = answer(
                0,
                &[&arguments[..], &["--setup", &setup, "--check"]].concat(),
            );
            assert!(said.contains("arcs: 1 stay, 0 are chords"), "{said}");
            let text = std::fs::read_to_string(&out).unwrap();
            let arcs = text
                .lines()
                .filter(|l| l.contains(" I") || l.contains(" J"));
            assert!(arcs.count() <= 16, "{text}");
        }
    }
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
    let (out, said) = run(&folder, program, &["--check", "--hole-tolerance", "9"]);
    assert!(said.contains("cycles: 3 stay"), "{said}\n{out}");
    assert!(out.contains("G81 X") && out.contains("G83 X"), "{out}");
    let (out, said) = run(&folder, program, &["--check"]);
    assert!(
        said.contains("cycles: 2 stay, 1 are written out"),
        "{said}\n{out}"
    );
    assert!(said.contains("line 6 is written out: G83: the correction changes by 8.8 µm"));
    assert!(!out.contains("G83") && !out.contains('Q'), "{out}");
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
    refuses(
        "G21 G90\nG187 X0\nM30\n",
        &["--pass", "G187"],
        &["line 2", "G187", "their meaning is unknown"],
    );
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

/// The words of an axis.
fn words(text: &str, letter: char) -> Vec<f64> {
    let words = text.lines().filter(|line| !line.starts_with(['(', ';']));
    let words = words.flat_map(str::split_whitespace);
    let words = words.filter_map(|word| word.strip_prefix(letter)?.parse().ok());
    words.collect()
}

#[test]
fn g52_and_a_tool_that_the_program_sets_shift_words_and_no_positions() {
    let folder = Folder::new();
    let plain = "G21 G90\nG0 X20 Y10 Z50\nG1 X40 Y30 F500\nM30\n";
    let shifted = "G21 G90\nG52 X5\nG10 L1 P1 Z10\nG43 H1\nG0 X15 Y10 Z40\nG1 X35 Y30 F500\nM30\n";
    let (plain, _) = run(&folder, plain, &["--check"]);
    let (shifted, _) = run(&folder, shifted, &["--check"]);
    assert!(
        shifted.contains("\nG52 X5\nG10 L1 P1 Z10\nG43 H1\n"),
        "{shifted}"
    );
    let same = |letter: char, from: usize, by: f64| {
        let (plain, shifted) = (words(&plain, letter), words(&shifted, letter));
        assert_eq!(plain.len(), shifted[from..].len());
        let off = plain.iter().zip(&shifted[from..]);
        let off = off.map(|(a, b)| (a - b - by).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{letter} {off}");
    };
    same('X', 1, 5.0);
    same('Y', 0, 0.0);
    same('Z', 1, 10.0);
}

#[test]
fn moves_under_cutter_compensation_are_cut_only_if_asked() {
    let folder = Folder::new();
    // Along the first motion the path gets its offset, along the one behind G40 it loses it.
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nG41 D1\nG1 X10 F500\nX200\nG40\nG1 X350\nX0\nM30\n";
    let count = |out: &str, from: &str, to: &str| -> usize {
        let lines = out.lines().skip_while(|l| !l.starts_with(from));
        lines.take_while(|l| !l.starts_with(to)).count() - 1
    };
    let (out, said) = run(&folder, program, &["--check"]);
    assert_eq!(count(&out, "G41", "G40"), 2, "{out}");
    assert!(said.contains("3 moves under G41 or G42"), "{said}");
    // One of them leads out, the next one is cut.
    assert!(count(&out, "G40", "M30") > 3, "{out}");
    let leads_out = out.lines().skip_while(|l| !l.starts_with("G40")).nth(1);
    assert!(leads_out.unwrap().starts_with("G1 X350.0"), "{out}");
    let (out, said) = run(&folder, program, &["--check", "--cut-under-g41"]);
    assert!(count(&out, "G41", "G40") > 5, "{out}");
    assert!(said.contains("2 moves under G41 or G42"), "{said}");
    let leads_out = out.lines().skip_while(|l| !l.starts_with("G40")).nth(1);
    assert!(leads_out.unwrap().starts_with("G1 X350.0"), "{out}");
}

#[test]
fn arcs_under_cutter_compensation_stay_arcs_whatever_that_costs() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nG41 D1\nG1 X20 F500\nG3 X220 Y200 R200\nG2 X20 Y0 I-200\nG40\nG1 X0\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    assert_eq!(out.lines().filter(|l| l.contains(" I")).count(), 2, "{out}");
    assert!(said.contains("4 moves under G41 or G42"), "{said}");
}

#[test]
fn feeds_per_revolution_take_revolutions() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nS1000 M3\nG95 G1 X50 F0.1\nG94 G1 X100 F100\nM30\n";
    let (_, said) = run(&folder, program, &["--check"]);
    assert!(said.contains("before 0.50 min"), "{said}");
    assert!(said.contains("before 500.00 revolutions"), "{said}");
}

#[test]
fn what_is_nowhere_the_largest_has_no_line() {
    let folder = Folder::new();
    let (_, said) = run(&folder, "G21 G90\nM30\n", &["--check"]);
    assert!(said.contains("0.00 µm from the corrected path\n"), "{said}");
    assert!(!said.contains("line 0"), "{said}");
}
