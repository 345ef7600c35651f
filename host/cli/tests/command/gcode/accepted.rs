//! Programs as posts and people write them.

use super::{SETUP, corrected, refuses, refuses_with, run, with_setup};
use crate::program::{Folder, blob};

#[test]
fn numbers_of_programs_are_passed_in_every_dialect() {
    for number in ["O1001 (PART)", "o12", ":1001", "%\nO0003"] {
        for dialect in ["linuxcnc", "grbl", "grblhal", "fanuc"] {
            let program = format!("{number}\nG21 G90 G17\nG0 X10. Y10. Z50.\nM30\n");
            let options = ["--check", "--dialect", dialect];
            let out = corrected(&Folder::new(), &program, &options);
            assert!(out.starts_with(number), "{out}");
        }
    }
    for flow in ["o100 call", "O100 if [1 GT 2]", "O<part> sub"] {
        refuses(format!("G21\n{flow}\nM2\n"), &[], &["line 2", "O-word"]);
    }
}

#[test]
fn a_zero_across_the_plane_of_an_arc_is_left_out_with_a_warning() {
    let program = "G21 G90 G17\nG0 X10 Y10 Z50\nG2 X20 Y10 I5. J0. K0.000 F300\nM30\n";
    let (out, said) = run(&Folder::new(), program, &["--check"]);
    assert!(!out.contains('K'), "{out}");
    assert!(
        said.contains("warning: 1 words I, J or K across the plane"),
        "{said}"
    );
    refuses(
        program.replace("K0.000", "K1"),
        &[],
        &["line 3", "K1", "normal of the plane"],
    );
}

#[test]
fn centres_that_are_absolute_are_told() {
    let program = "G21 G90 G17\nG0 X10 Y10 Z50\nG2 X20 Y10 I15 J10 F300\nM30\n";
    refuses(program, &[], &["line 3", "radius does not fit", "G90.1"]);
    let right = program.replace("G2 ", "G90.1\nG2 ");
    corrected(&Folder::new(), &right, &["--check"]);
}

#[test]
fn an_axis_that_the_machine_does_not_have_may_be_named_if_it_stays() {
    let program = "G21 G90 G17\nG0 X10 Y10 Z50 A0.\nG1 X20 A0. F300\nX30 A0.\nM30\n";
    let (out, said) = run(&Folder::new(), program, &["--check"]);
    assert_eq!(out.matches(" A0.").count(), 3, "{out}");
    assert!(said.contains("words of A are passed"), "{said}");
    let moves = program.replace("X30 A0.", "X30 A1.");
    refuses(
        moves,
        &[],
        &["line 4", "A1.", "no axis A, and it moves here"],
    );
}

#[test]
fn modes_before_the_first_line_are_those_of_the_setup_or_of_the_dialect() {
    // Neither plane nor distance are said: those after power-on hold.
    let program = "G21\nG0 X10. Y10. Z50.\nG2 X20. Y10. I5. F300.\nM30\n";
    for dialect in ["linuxcnc", "fanuc"] {
        with_setup(program, SETUP, &["--dialect", dialect]);
    }
    let other = SETUP.replace(
        "[start]\n",
        "[start]\nplane = \"G18\"\ndistance = \"G91\"\nfeed = \"G93\"\n",
    );
    let out = with_setup("G0 X5 Z50\nG1 X1 F2\nG3 X2 I1 F2\nM30\n", &other, &[]);
    assert!(out.contains("G0 X5.") || out.contains("G0 X4.99"), "{out}");
    let wrong = SETUP.replace("[start]\n", "[start]\nplane = \"XY\"\n");
    let parts = ["no mode of this kind", "\"G17\" or \"G18\""];
    refuses_with(program, [&blob("mill-21"), &wrong], &[], &parts);
}

#[test]
fn grblhal_drills() {
    let program = "G21 G90 G17 G98\nM3 S500\nG0 X10 Y10 Z50\nG81 X12 Y12 Z45 R48 F100\nX20\nG83 X30 Z44 R48 Q1\nG80\nM30\n";
    let (out, said) = run(
        &Folder::new(),
        program,
        &["--check", "--dialect", "grblhal"],
    );
    assert!(out.contains("G81 X12.") && out.contains("G83 X"), "{out}");
    assert!(said.contains("cycles: 3 stay"), "{said}");
    refuses(program, &["--dialect", "grbl"], &["line 1", "G98"]);
}

#[test]
fn words_have_the_decimals_that_are_asked_for() {
    let program = "G21 G90 G17\nG0 X10 Y10 Z50\nG1 X20.00001 Y30 F300\nG2 X40 Y30 I10\nM30\n";
    let (out, said) = run(&Folder::new(), program, &["--check", "--decimals", "3"]);
    let decimals = |word: &str| word.split_once('.').map_or(0, |(_, digits)| digits.len());
    let words = out.lines().skip(1).flat_map(str::split_whitespace);
    let places = words.filter(|w| w.starts_with(['X', 'Y', 'Z', 'I', 'J']));
    assert!(places.map(decimals).all(|count| count <= 3), "{out}");
    assert!(
        said.contains("words have 3 decimals: rounding costs up to 1.73 µm"),
        "{said}"
    );
}

#[test]
fn inserted_lines_have_no_number_or_a_sub_number() {
    let program = "G21 G90 G17\nG0 X0 Y0 Z50\nN10 G1 X200 Y200 F300\nN20 M30\n";
    let numbers = |options: &[&str]| -> Vec<String> {
        let out = corrected(&Folder::new(), program, options);
        let lines = out.lines().skip(3);
        lines
            .map(|l| l.split(' ').next().unwrap().to_owned())
            .collect()
    };
    let plain = numbers(&["--check"]);
    assert!(plain[0] == "N10" && plain[1].starts_with('X'), "{plain:?}");
    let numbered = numbers(&["--check", "--sub-numbers"]);
    assert_eq!(numbered[..3], ["N10", "N10.1", "N10.2"]);
    assert_eq!(numbered.last().unwrap(), "N20");
}
