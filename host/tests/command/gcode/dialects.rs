//! What words mean to one controller and not to another.

use super::{corrected, refuses, run};
use crate::program::Folder;

const FANUC: [&str; 3] = ["--dialect", "fanuc", "--check"];

/// How Fanuc's programs begin here.
const BEGIN: &str = "%\nO1001 (PART)\nG21 G17 G90 G94 G98\nG0 X10. Y10. Z50.\n";

/// A corrected program without its mark.
fn fanuc(folder: &Folder, lines: &str) -> Vec<String> {
    let out = corrected(folder, &format!("{BEGIN}{lines}M30\n%\n"), &FANUC);
    let lines = out.lines().filter(|l| !l.starts_with("(trueaxis"));
    lines.map(str::to_owned).collect()
}

#[test]
fn the_time_of_fanuc_s_g4_may_be_an_x_or_a_u() {
    let folder = Folder::new();
    let moves = "G1 Z-1. F200.\nG4 X1.5\nX20.\nG4 X2\nG4 U2.\nG04 P500\nY20.\n";
    let out = fanuc(&folder, moves);
    for line in ["G4 X1.5", "G4 X2", "G4 U2.", "G04 P500"] {
        assert!(out.iter().any(|l| l == line), "{line} in {out:?}");
    }
    let waits = |l: &&str| !l.starts_with("G4") && !l.starts_with("G04");
    let without: String = moves
        .lines()
        .filter(waits)
        .fold(String::new(), |all, l| all + l + "\n");
    let rest: Vec<String> = out.into_iter().filter(|l| waits(&l.as_str())).collect();
    assert_eq!(rest, fanuc(&folder, &without));
    for (line, part) in [
        ("G4 X1. Y2.", "one time"),
        ("G4 X1. P500", "one time"),
        ("G4", "one time"),
        ("G4 X1. G1 Y5. F90.", "one time"),
    ] {
        refuses(
            format!("{BEGIN}{line}\nM30\n%\n"),
            &FANUC,
            &["line 5", part],
        );
    }
    // Elsewhere it waits for P, and X is the motion that holds.
    let out = corrected(
        &folder,
        "G21 G90\nG0 X10 Y10 Z50\nG4 P1 X20\n",
        &["--check"],
    );
    assert!(
        out.lines().last().unwrap().starts_with("G4 P1 X20.0"),
        "{out}"
    );
}

#[test]
fn a_letter_that_nothing_in_its_line_uses_is_refused() {
    let nothing = "nothing in its line uses";
    for line in [
        "G1 X20 F100 R2",
        "G1 X20 F100 P3",
        "G0 X20 K1",
        "G0 Z20 H1",
        "G0 X20 D1",
        "G2 I5 L2 F100",
        "G98 G81 X12 Y12 Z45 R48 K3 F100",
        "G98 G81 X12 Y12 Z45 R48 I3 F100",
        "M3 S100\nM8 I2",
        "G30 P3",
        "G4 P1 R2",
        "Q5",
        "G92 X0 L3",
    ] {
        let last = line.lines().last().unwrap().split(' ').next_back().unwrap();
        let letter = &format!("`{last}`");
        let program = format!("G21 G90\nG0 X10 Y10 Z50\n{line}\nM30\n");
        match line.contains("F100") && !last.starts_with('F') {
            true => refuses(program, &[], &[letter, nothing]),
            false => refuses(program, &[], &[nothing]),
        }
    }
    for (line, part) in [
        ("G1 X20. F100. R2.", "R2."),
        ("G2 I5. P2 F100.", "P2"),
        ("H2", "H2"),
        ("G83 X12. Y12. Z45. R48. I1. J.1 K.5 F100.", "I1."),
    ] {
        let program = format!("{BEGIN}{line}\nM30\n%\n");
        refuses(program, &FANUC, &["line 5", &format!("`{part}`"), nothing]);
    }
    // Those of a word that is passed are its own.
    let folder = Folder::new();
    let passed = "G5.1 Q1\nG187 P3 E0.01\nG8 P1\nG0 X20.\n";
    let mut options = FANUC.to_vec();
    for word in ["G5.1", "G187", "G8"] {
        refuses(
            format!("{BEGIN}{word} Q1\nM30\n%\n"),
            &FANUC,
            &["line 5", word, "not known", &format!("--pass {word}")][..1],
        );
        options.extend(["--pass", word]);
    }
    let out = corrected(&folder, &format!("{BEGIN}{passed}M30\n%\n"), &options);
    assert!(
        out.contains("G5.1 Q1\nG187 P3 E0.01\nG8 P1\nG0 X20."),
        "{out}"
    );
}

#[test]
fn fanuc_s_g54_with_p_is_g54_1_and_haas_writes_g154() {
    let folder = Folder::new();
    let set = "G10 L20 P2 X100. Y60. Z-300.\n";
    let ends = |word: &str| {
        let out = fanuc(&folder, &format!("{set}{word} G0 X20. Y5.\nZ10.\n"));
        out[out.len() - 5..].join("\n").replace(word, "SYSTEM")
    };
    let expected = ends("G54.1 P2");
    assert!(expected.contains("SYSTEM G0 X"), "{expected}");
    assert_eq!(ends("G54 P2"), expected);
    assert_eq!(ends("G154 P2"), expected);
    assert_ne!(ends("G54"), expected);
    let line = format!("{BEGIN}G54 P2 G0 X5.\nM30\n%\n");
    refuses(line, &FANUC, &["line 5", "G54.1 P2", "setup"]);
    let line = format!("{BEGIN}{set}G54 P2 G4\nM30\n%\n");
    refuses(
        line,
        &FANUC,
        &["line 6", "a word that two others of its line use"],
    );
}

#[test]
fn fanuc_s_k_is_how_often_a_cycle_is_done() {
    let folder = Folder::new();
    let holes = |word: &str| {
        let cycle = format!("G91 G99 G81 X5. Y1. Z-3. R-40. F100. {word}\nG80\nG90\n");
        fanuc(&folder, &cycle)
    };
    let three = holes("K3");
    assert_eq!(three, holes("L3"));
    let feeds = |out: &[String]| out.iter().filter(|l| l.contains("G1 ")).count();
    assert_eq!(feeds(&three), 3 * feeds(&holes("")), "{three:?}");
    for (word, part) in [
        ("K0", "never"),
        ("K3 L3", "how often"),
        ("K.5", "a length"),
        ("K2.5", "a length"),
    ] {
        let line = format!("{BEGIN}G81 X5. Y1. Z3. R4. F100. {word}\nG80\nM30\n%\n");
        refuses(line, &FANUC, &["line 5", part]);
    }
}

#[test]
fn behind_fanuc_s_g80_the_motion_before_the_cycles_holds() {
    let folder = Folder::new();
    let out = fanuc(
        &folder,
        "G0 G17 G40 G49 G80 G90\nG81 X12. Y12. Z45. R48. F100.\nG80\nX30.\nG1 Y30. F200.\nG81 Z45. R48.\nG80 Z49.\nZ50.\n",
    );
    let ends: Vec<&String> = out.iter().rev().skip(2).take(3).collect();
    // The first one is G0 again, the others G1.
    let g0 = out.iter().find(|l| l.contains("X30.")).unwrap();
    assert!(g0.contains("G0") || !g0.contains("G1"), "{out:?}");
    assert!(
        ends[0].starts_with("Z50.") || ends[0].starts_with("Z49."),
        "{out:?}"
    );
    refuses(
        format!("{BEGIN}G80 G81 X12. Y12. Z45. R48. F100.\nM30\n%\n"),
        &FANUC,
        &["line 5", "G80 and a cycle"],
    );
    // LinuxCNC's ends all motion.
    refuses(
        "G21 G90\nG0 X10 Y10 Z50\nG98 G81 X12 Y12 Z45 R48 F100\nG80\nX30\nM30\n",
        &[],
        &["line 5", "axes without a motion word"],
    );
}

#[test]
fn h0_is_no_offset_on_fanuc_s_controllers_and_not_known_on_linuxcnc() {
    let folder = Folder::new();
    let with = fanuc(&folder, "G43 Z50. H1\nG1 Z40. F100.\nG43 Z60. H0\n");
    let off = fanuc(&folder, "G43 Z50. H1\nG1 Z40. F100.\nG49 Z60.\n");
    let last = |out: &[String]| out[out.len() - 3].split("Z6").nth(1).map(str::to_owned);
    assert_eq!(last(&with).map(|l| l.replace(" H0", "")), last(&off));
    refuses(
        "G21 G90\nG0 X10 Y10 Z50\nG43 H0\nM2\n",
        &[],
        &["line 3", "G43", "H0"],
    );
}

#[test]
fn where_an_offset_may_move_z_it_is_not_known() {
    let folder = Folder::new();
    for (lines, number) in [
        ("G43 H1\nX30.\n", "line 6"),
        ("G43 Z60. H1\nG49\nX30.\n", "line 7"),
        ("G43 H1 X30.\n", "line 5"),
    ] {
        let program = format!("{BEGIN}{lines}M30\n%\n");
        let what = "behind G43 or G49 without an absolute Z";
        refuses(program, &FANUC, &[number, what, "write Z in that line"]);
    }
    let out = corrected(
        &folder,
        &format!("{BEGIN}G49 G40 G80\nX30.\nG43 H1\nG0 Z40.\nX5.\nG49\nG28\nM30\n%\n"),
        &FANUC,
    );
    assert!(out.contains("G43 H1\nG0 Z39.99"), "{out}");
    // LinuxCNC's moves nothing.
    corrected(
        &folder,
        "G21 G90\nG0 X10 Y10 Z50\nG43 H1\nX30\nM2\n",
        &["--check"],
    );
}

#[test]
fn fanuc_s_g30_has_other_points_than_the_second() {
    let program = format!("{BEGIN}G91 G30 P3 Z0.\nG90 X20.\nM30\n%\n");
    let parts = ["line 6", "position of Z", "G30 to another point"];
    refuses(program, &FANUC, &parts);
    let folder = Folder::new();
    let (_, said) = run(
        &folder,
        &format!("{BEGIN}G91 G30 P3 Z0.\nG90 G0 Z60.\nX20.\nM30\n%\n"),
        &FANUC,
    );
    assert!(
        said.contains("not corrected: G28 and G30 (1 times)"),
        "{said}"
    );
}

#[test]
fn behind_its_end_a_program_goes_on_for_grbl_alone() {
    let program = "G21 G90\nG0 X10 Y10 Z50\nM2\n(end)\n\nG0 X30\n";
    let folder = Folder::new();
    let out = corrected(&folder, program, &["--check"]);
    assert!(out.ends_with("M2\n(end)\n\nG0 X30\n"), "{out}");
    let grbl = ["--dialect", "grbl"];
    let parts = ["line 6", "`G0`", "behind the end of the program"];
    refuses(program, &grbl, &parts);
    let program = "%\nG21 G90\nG0 X10 Y10 Z50\n%\nG0 X30\n";
    refuses(program, &grbl, &["line 5", "behind the end of the program"]);
    corrected(&folder, "G21 G90\nG0 X10 Y10 Z50\nM30\n%\n(end)\n", &grbl);
}
