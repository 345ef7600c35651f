//! What an attack with another interpreter and other kinematics has found: full turns, moves that begin beside the
//! corrected path.

use super::{corrected, refuses, refuses_with, run, with_files, written};
use crate::program::{Folder, answer, blob, example};
use std::time::Instant;

/// A setup for `xyzac-trt` in the middle of its travel, with every axis known to have gone up.
const FIVE: &str = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -125\nA = 0\nC = 0\n\
travel = { X = \"+\", Y = \"+\", Z = \"+\", A = \"+\", C = \"+\" }\n[offset.G54]\nX = 200\nY = 150\nZ = -125\n";

/// Corrects a program for `xyzac-trt`, which the check must accept.
fn five(folder: &Folder, program: &str, options: &[&str]) -> String {
    five_from(folder, FIVE, program, options)
}

/// Like `five`, with another setup.
fn five_from(folder: &Folder, setup: &str, program: &str, options: &[&str]) -> String {
    let files = [&blob("xyzac-trt"), setup];
    with_files(folder, program, files, options, |words| answer(0, words));
    written(folder)
}

#[test]
fn the_first_motion_tells_directions_that_are_not_known() {
    let folder = Folder::new();
    let unknown: String = FIVE
        .lines()
        .filter(|line| !line.starts_with("travel"))
        .fold(String::new(), |text, line| text + line + "\n");
    let program = "G21 G90\nG1 X10 C49 F50\nX20 C60\nM30\n";
    let [step, _, leave] = ["move", "blend", "leave"].map(|backlash| {
        let options = ["--check", "--backlash", backlash];
        let out = five_from(&folder, &unknown, program, &options);
        let (_, rest) = out.split_once('\n').unwrap();
        rest.to_owned()
    });
    // No axis turns round: nothing is left out.
    assert_eq!(step, leave);
}

#[test]
fn the_check_says_how_far_off_blended_steps_are() {
    let folder = Folder::new();
    let program = "G21 G90\nG0 X10 Y0 Z0 A0 C0\nG1 X20 F800\nX10\nX30\nM30\n";
    let said = |backlash: &str| {
        let files = [&blob("xyzac-trt"), FIVE];
        let options = ["--check", "--backlash", backlash];
        with_files(&folder, program, files, &options, |words| answer(0, words))
    };
    // The table of X by its direction holds 4 µm.
    let blended = said("blend");
    let off = blended.split_once("blended into the move: ").unwrap().1;
    let off: f64 = off.split(' ').next().unwrap().parse().unwrap();
    assert!((off - 8.0).abs() < 0.1, "{blended}");
    assert!(!said("move").contains("blended"));
}

#[test]
fn a_straight_move_makes_up_a_step_that_the_tolerance_allows() {
    // X comes back while Y moves: the step of 8 µm is across the move, not along it.
    let program = "G21 G90\nG0 X10 Y0 Z0 A0 C0\nG1 X20 F800\nX19.5 Y30\nM30\n";
    let lines = |tolerance: &str| {
        let options = ["--check", "--tolerance", tolerance];
        let out = five(&Folder::new(), program, &options);
        out.lines().count() - program.lines().count()
    };
    // One line more is the head.
    assert!(lines("1") > 1);
    assert_eq!(lines("50"), 1);
}

#[test]
fn what_is_written_for_cycles_and_small_turns_is_accepted_whatever_becomes_of_reversals() {
    let folder = Folder::new();
    for program in [
        // Cycles that stay cycles while X comes back.
        "G21 G90 G98 F200\nG81 X10 Y10 Z1 R5\nX20\nG83 X30 Z0 R4 Q1\nG99 G82 X5 Z2 R3 P0.1\nG80\nM30\n",
        // A hole where the machine stands, uncorrected.
        "G21 G90 G98 F200\nG92 X0 Y0 Z3\nG81 Z2.9 R3\nG80\nM30\n",
        // The same, written out.
        "G21 G90 G98 F200\nG92 X0 Y0 Z3\nG83 Z2.9 R3 Q0.2 L2\nG80\nM30\n",
        "G21 G90 G99 F200\nG92 X0 Y0 Z3\nG18 G85 Y-0.1 R0 L2\nG80\nM30\n",
        // Modes in the line of a cycle that has a line before it.
        "G21 G90 G98 F200\nG10 L2 P2 X200 Y150 Z-165 A0 C0.5 R0\nG91\nG81 X0 Z1 R4 G90 G55\nG80\nM30\n",
        // Rotary axes that go back by as much as their last digits.
        "G21 G90\nG0 C1.027\nC10\nC1.017\nC1.02702\nC1.027\nC1.017\nC1.027 X0\nM30\n",
        // Turns that are hardly larger than the steps at their reversals.
        "G21 G90 G17 F300\nG2 J0.019\nG3 I-0.022\nG2 I0.1 J0.1\nM30\n",
    ] {
        for backlash in ["move", "blend", "leave"] {
            five(&folder, program, &["--check", "--backlash", backlash]);
        }
    }
}

#[test]
fn a_line_before_the_last_one_ends_where_that_has_no_end() {
    let folder = Folder::new();
    // The rotary axes are corrected at the hole before its cycle, which stays one.
    let out = five(
        &folder,
        "G21 G90 G98 F200\nG81 X10 Y10 Z4.9 R5 M30",
        &["--check"],
    );
    let lines: Vec<&str> = out.lines().collect();
    let [.., before, last] = lines[..] else {
        panic!("{out}");
    };
    assert!(
        before.starts_with("G0 ") && last.starts_with("G81 "),
        "{out}"
    );
}

#[test]
fn holes_of_a_series_have_each_the_r_that_is_corrected_there() {
    let folder = Folder::new();
    // The program stays at R between them; corrected, R is some micrometres lower at the second.
    let program = "G21 G90 G17 F300\nG0 X151.6 Y176.1 Z127\nG99 G89 X151.6 Z125.8 R126.3 P0.1\nX188.3\nG80\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    assert!(said.contains("cycles: 2 stay"), "{said}");
    let r: Vec<&str> = out
        .split_whitespace()
        .filter(|w| w.starts_with('R'))
        .collect();
    assert_ne!(r[0], r[1], "{out}");
}

#[test]
fn feeds_out_of_a_hole_end_at_its_own_r() {
    let folder = Folder::new();
    // R is the level before the series; corrected, it is some micrometres lower at the second hole.
    let program =
        "G21 G90 G17 F300\nG0 X151.6 Y176.1 Z127\nG98 G89 Z125.8 R127 P0.1\nX188.3\nG80\nM30\n";
    let (_, said) = run(&folder, program, &["--check"]);
    assert!(said.contains("cycles: 2 stay, 0 are written out"), "{said}");
}

#[test]
fn turns_behind_a_step_onto_the_path_stay_as_many() {
    let folder = Folder::new();
    let program = "G21 G90 G17 F300\nG2 I0.5 P2 (round)\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    assert!(said.contains("arcs: 1 stay"), "{said}");
    assert!(out.contains("P2"), "{out}");
}

#[test]
fn hundreds_of_turns_take_the_time_of_their_arcs() {
    let folder = Folder::new();
    // It is compiled once, and not counted.
    blob("mill-21");
    let timed = |turns: usize| {
        let start = Instant::now();
        let program = format!("G21 G90 G17 F800\nG0 X50 Y50 Z50\nG2 I-12 P{turns}\nM30\n");
        let (out, _) = run(&folder, &program, &["--check"]);
        (start.elapsed(), out)
    };
    let (few, _) = timed(90);
    let (many, out) = timed(900);
    // 0.6 s alone, and 0.1 s for a tenth; a hundred times as long where each arc looked at all turns that were left.
    assert!(many < 30 * few, "{many:?}, {few:?}");
    assert!(out.lines().count() > 1000);
}

#[test]
fn a_full_turn_stays_an_arc_without_an_end_that_rounding_could_move() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X50.0123 Y50 Z50\nG1 X50 F300\nG2 I1 (round)\nG3 X50 Y50 I0 J0.5 Z49.9 (helix)\n\
                   G91 G2 X0 I-1 (again)\nG20\nF20\nG2 I0.02 (inches)\nM30\n";
    let (out, said) = run(&folder, program, &["--check"]);
    assert!(said.contains("arcs: 4 stay, 0 are chords"), "{said}\n{out}");
    for comment in ["(round)", "(helix)", "(again)", "(inches)"] {
        let line = out.lines().find(|l| l.contains(comment)).unwrap();
        assert!(!line.contains(['X', 'Y']), "{line}");
    }
    // Nearly closed, rounding could make it a full turn, or nothing.
    let nearly = "G21 G90 G17\nG0 X50 Y50 Z50\nG2 X50 Y50.0005 I1 F300\nM30\n";
    let (_, said) = run(&folder, nearly, &["--check"]);
    assert!(said.contains("arcs: 0 stay, 1 are chords"), "{said}");
}

#[test]
fn a_move_that_feeds_begins_on_the_corrected_path() {
    let folder = Folder::new();
    // From an uncorrected start, and from over a hole, where the correction is that of its bottom.
    for before in ["", "G98 G81 X20 Y20 Z-20 R-19 F90\nG80\n"] {
        let program = format!("G21 G90 G17 F300\n{before}G1 X30 (on)\nG2 I2 (round)\nM30\n");
        let (out, _) = run(&folder, &program, &["--check"]);
        let first = out.lines().find(|l| l.contains("(on)")).unwrap();
        let word = first.split_whitespace().find(|w| w.starts_with('X'));
        let x: f64 = word.map_or(0.0, |w| w[1..].parse().unwrap());
        assert!(x < 25.0, "it does not step onto the path first: {out}");
    }
    let program = "G21 G90 G17 F300\nG2 I0.5 (round)\nG1 X1\nM30\n";
    let (out, _) = run(&folder, program, &["--check"]);
    let round = out.lines().find(|l| l.contains("(round)")).unwrap();
    assert!(round.starts_with("G1 "), "{out}");
}

#[test]
fn an_arc_while_an_axis_turns_takes_its_time_in_every_dialect() {
    let folder = Folder::new();
    // Grbl and Fanuc count degrees like mm, in arcs too; LinuxCNC counts the arc alone.
    let program = "G21 G90 G17\nG0 X0. Y0. Z0. A0. C0.\nG1 X1. F300.\nG2 C-0.9 J0.02\nM30\n";
    for dialect in ["linuxcnc", "grbl", "fanuc"] {
        // The check counts the moves whose time differs by more than 1 %.
        let out = five(&folder, program, &["--dialect", dialect, "--check"]);
        assert!(out.contains("G2 "), "{dialect}: {out}");
    }
    // X turns round and back again: pieces of the arc before are no steps at a reversal.
    let twice = "G21 G90 G17\nG0 X0 Y0 Z0 A0 C0\nG1 X1 F300\nG3 C-14 I1 P2\nM30\n";
    five(&folder, twice, &["--check"]);
    // An arc that is shorter than the last digit of words: nothing is written for it, or as good as nothing.
    let tiny = "G21 G90 G17\nG0 X0 Y0 Z0 A0 C0\nG1 X1 F300\nG2 X1.0001 R24\nG1 X2\nM30\n";
    five(&folder, tiny, &["--check"]);
}

#[test]
fn an_axis_that_goes_back_by_little_more_than_its_reversal_threshold_has_turned_round() {
    let folder = Folder::new();
    // The arc goes back by its sagitta, 0.9998 to 1.0204 µm of 1 µm, and does so twice; it ends where X turns again.
    for end in [
        "0.4471", "0.4472", "0.448", "0.449", "0.450", "0.451", "0.4517",
    ] {
        let program =
            format!("G21 G90 G17\nG0 X0 Y0 Z0 A0 C0\nG1 X1 F300\nG3 Y-{end} R25 P2\nM30\n");
        five(&folder, &program, &["--check"]);
    }
}

#[test]
fn an_axis_that_follows_the_tip_slowly_turns_round_where_its_words_say() {
    let folder = Folder::new();
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    // X comes back by its reversal threshold so slowly that the last digits of words, and of f32, are some of its way.
    for (from, to, c) in [
        (200, 2.42, -20),
        (300, 0.99, -20),
        (316, 0.64, 0),
        (180, 0.48, 10),
        (180, 1.73, 0),
        (300, 1.64, 40),
    ] {
        let program = format!("G21 G90\nM428\nG0 C{from}\nG94 G1 X{to} C{c} F5\nM429\nM30\n");
        five(&folder, &program, &["--machine", &machine, "--check"]);
    }
}

#[test]
fn levels_that_are_the_same_and_no_more_once_they_are_corrected_are_followed() {
    let folder = Folder::new();
    let begin = "G21 G90 G17 F100\nM3 S100\n";
    // R and the level before the series differ by less than corrections do, from hole to hole.
    for program in [
        "G0 X77.627 Y-17.377 Z3\nG98 G73 X91.324 Y-23.276 Z-1.441 R3.0004 Q2.228\nX-3.77 R3\nG80\nG0 A10 C-145\n",
        "G0 X-38 Y-44 Z10 A38 C-52\nG98 G84 X-60.46 Y-18.51 Z7.527 R9.999\nX33.14 Y32.767\nX64.75\nG89 X94.635 Y7.284 Z5.703 R10.0004 P0.1\n",
        "G0 X12 Y-36 Z3\nG98 G85 X87.591 Y-6.766 Z1.819 R3\nX-23.041\nG80\nG0 Z3\n",
        "G0 X-29 Y57 Z3 A32 C77\nG98 G86 X40.438 Y-56.089 Z-3.218 R2 P0.1\nG80\nG0 Z3.0004\nG81 X-9.686 Y12.163 Z-4.126 R2.999\n",
        "G0 X-74 Y20 Z10\nG98 G86 X85 Y48 Z2.571 R10 P0.1\nX26 Y-57\nG80\nG0 Z10\nG99 G86 X-11 Y-53 Z6.253 R10.01 P0.1\n",
        "G98 G83 Z0 R0.1 Q1\n",
        "G0 X31 Y-55 Z3 A15 C-49\nG98 G84 X8.055 Y48.553 Z-5.468 R2.8\nX24.226 Y25.162\n",
    ] {
        for options in [
            &["--backlash", "leave", "--tolerance", "20"][..],
            &["--tolerance", "2"],
        ] {
            let program = format!("{begin}{program}G80\nG0 Z20\nM30\n");
            five(&folder, &program, &[options, &["--check"]].concat());
        }
    }
}

#[test]
fn steps_are_told_from_motions_as_short() {
    let folder = Folder::new();
    let tip =
        "G0 Y-0.642 Z0.96 A-23.003 C-195.711\nG1 A-27.689 C114.917\nG1 X-0.969 Z0.181 C37.261\n";
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let errors = example("linuxcnc-xyzac-trt/errors-11.toml");
    for (program, options) in [
        // A step of 0.2 µm behind a motion that goes nowhere.
        ("G0 X1. Y2.\nG1 Y2. F100\nG1 Y2.\nC-7.\n", &[][..]),
        ("G1 A-0.\nX-0.002 C-0.01\n", &[]),
        (
            "G91\nG1 A-0.\nA-0.00001\nA0.00002\n",
            &["--backlash", "blend", "--tolerance", "5"],
        ),
        ("G1 X-45.\nG91\nX0.002\n", &["--tolerance", "50"]),
        (
            "G0 X1. Y2. Z3. A1.\nC11.\nX-4. C8.\n",
            &["--tolerance", "2"],
        ),
        // An arc of 2 µm, and one that is smaller than the tolerance.
        (
            "G0 X7.96 Y-30.8\nG2 X7.941 Y-30.75502 R0.02\nG3 X7.94 Y-30.757 I0.1 J0.\n",
            &["--backlash", "leave"],
        ),
        (
            "G0 X14.\nG2 I0.012\nX14.4 R0.4\n",
            &["--backlash", "blend", "--tolerance", "50"],
        ),
        // Whether an axis has turned round at the end the last digits decide.
        (
            &format!(
                "M428\nG0 X0.331 Y-0.968 Z-0.053 A-29.122 C21.595\nG1 X0\nX-0.257\nY0.145 Z0.654 C1.89\n{tip}M429\n"
            ),
            &[
                "--tolerance",
                "2",
                "--machine",
                &machine,
                "--errors",
                &errors,
            ],
        ),
    ] {
        let program = format!("G21 G90 G17 G54 G94 F600\n{program}M30\n");
        five(&folder, &program, &[options, &["--check"]].concat());
    }
}

#[test]
fn what_counts_from_the_axes_or_from_the_tip_is_no_line_with_the_switch() {
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    refuses_with(
        "G21 G90\nM428 G92 X0\nM30\n",
        [&blob("xyzac-trt"), FIVE],
        &["--machine", &machine],
        &["line 2", "M428", "two lines"],
    );
}

#[test]
fn pecks_and_turns_without_end_are_refused() {
    let start = "G21 G90 G98 F100\nG0 X0 Y0 Z50\n";
    for (line, parts) in [
        (
            "G83 X1 Z0 R10 Q0.0001",
            &["line 3", "Q0.0001", "10000 pecks"][..],
        ),
        (
            "G83 X1 Z0 R10 Q.000000000000000000001",
            &["line 3", "pecks"],
        ),
        ("G83 X1 Z0 R10 Q1 L5000", &["line 3", "pecks"]),
        (
            "G81 X1 Z10 R10.0001",
            &["line 3", "less than half a micrometre"],
        ),
        ("G2 I1 P5000", &["line 3", "P5000", "1000 turns"]),
        // Turns that cannot stay arcs.
        (
            "G2 I60 J60 P900",
            &["line 3", "100000 places", "several moves"],
        ),
    ] {
        refuses(format!("{start}{line}\nM30\n"), &[], parts);
    }
}

#[test]
fn thousands_of_incremental_lines_end_where_absolute_ones_do() {
    let folder = Folder::new();
    let mut incremental = String::from("G21 G90\nG0 X0 Y0 Z50\nG91 F600\n");
    let mut absolute = String::from("G21 G90\nG0 X0 Y0 Z50\nF600\n");
    for k in 1..=4000 {
        incremental += "G1 X0.0123 Y0.007\n";
        absolute += &format!(
            "G1 X{:.4} Y{:.4}\n",
            0.0123 * f64::from(k),
            0.007 * f64::from(k)
        );
    }
    let out = corrected(&folder, &incremental, &["--check"]);
    let (mut at, mut relative) = ([0.0; 3], false);
    for line in out.lines() {
        relative |= line.contains("G91");
        for word in line.split_whitespace() {
            if let Some(axis) = "XYZ".find(&word[..1]) {
                let value: f64 = word[1..].parse().unwrap();
                at[axis] = if relative { at[axis] + value } else { value };
            }
        }
    }
    let out = corrected(&folder, &absolute, &["--check"]);
    let last = out.lines().last().unwrap();
    for (axis, letter) in ["X", "Y"].iter().enumerate() {
        let word = last.split_whitespace().find(|w| w.starts_with(letter));
        let expected: f64 = word.unwrap()[1..].parse().unwrap();
        // Both are rounded once, to four decimals.
        assert!((at[axis] - expected).abs() < 1.1e-4, "{at:?} {last}");
    }
}

#[test]
fn the_step_of_a_reversal_stands_before_the_move_that_reverses() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEYYb = 5e-3\n",
    );
    let setup = folder.file(
        "setup.toml",
        "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -200\ntravel = { Y = \"+\" }\n\
         [offset.G54]\nX = 200\nY = 150\nZ = -200\n",
    );
    let (trax, out) = (folder.at("backlash.trax"), folder.at("out.ngc"));
    let machine = example("mill-21/machine.toml");
    answer(0, &["compile", &machine, &errors, "-o", &trax]);
    // Y goes back by 5 µm on the second move, of which the reversal threshold takes a part.
    let part = folder.file(
        "part.ngc",
        "G21 G90 G17\nG0 X0 Y10 Z0\nG1 X50 Y9.9 F300\nX100 Y9.905\nM30\n",
    );
    let lines = |backlash: &str| -> Vec<String> {
        let arguments = ["gcode", &part, "-o", &out, "--compensation", &trax];
        let options = ["--setup", &setup, "--check", "--backlash", backlash];
        answer(0, &[&arguments[..], &options].concat());
        let text = std::fs::read_to_string(&out).unwrap();
        text.lines().skip(3).map(str::to_owned).collect()
    };
    let value = |line: &str, letter: char| -> Option<f64> {
        let mut words = line.split(' ');
        words.find_map(|word| word.strip_prefix(letter)?.parse().ok())
    };
    // A move of its own, of 10 µm, at X50.
    let moved = lines("move");
    let [.., end, step, last, _] = &moved[..] else {
        panic!("{moved:?}");
    };
    let by = value(step, 'Y').unwrap() - value(end, 'Y').unwrap();
    assert!((by.abs() - 0.01).abs() < 2e-4, "{moved:?}");
    let x = value(step, 'X').or(value(end, 'X')).unwrap();
    assert!(
        (x - 50.0).abs() < 1e-3 && value(last, 'X') == Some(100.0),
        "{moved:?}"
    );
    // Taken up over the first millimetre.
    let blended = lines("blend");
    let [.., first, last, _] = &blended[..] else {
        panic!("{blended:?}");
    };
    assert!(
        (value(first, 'X').unwrap() - 51.0).abs() < 1e-3,
        "{blended:?}"
    );
    assert_eq!(value(last, 'X'), Some(100.0));
}
