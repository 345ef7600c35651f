//! What words mean to one controller and not to another.

use super::{corrected, refuses, run, with_files, written};
use crate::program::{Folder, answer, blob, example};

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
    let unknown = format!("{BEGIN}G187 P3\nM30\n%\n");
    refuses(
        unknown,
        &FANUC,
        &["line 5", "no G word that is known", "--pass G187"],
    );
    options.extend(["--pass", "G187"]);
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
        let what = "after G43 or G49 without an absolute Z";
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
    let parts = ["line 6", "`G0`", "after the end of the program"];
    refuses(program, &grbl, &parts);
    let program = "%\nG21 G90\nG0 X10 Y10 Z50\n%\nG0 X30\n";
    refuses(program, &grbl, &["line 5", "after the end of the program"]);
    corrected(&folder, "G21 G90\nG0 X10 Y10 Z50\nM30\n%\n(end)\n", &grbl);
    // The spindle stops, and nothing moves.
    corrected(
        &folder,
        "G21 G90\nG0 X10 Y10 Z50\nM2\nM9 ; air\nM5\n",
        &grbl,
    );
}

#[test]
fn fanuc_s_r_and_depth_stay_where_they_are_under_g91() {
    let folder = Folder::new();
    let grid = "G99 G81 X12. Y12. Z45. R48. F100.\nG91 X5. L2\nG80\n";
    let one_by_one = "G99 G81 X12. Y12. Z45. R48. F100.\nX17.\nX22.\nG80\n";
    let depths = |lines: &str| -> Vec<String> {
        let out = fanuc(&folder, lines);
        let words = out.iter().flat_map(|l| l.split_whitespace());
        let feeds = words.filter(|w| w.starts_with("Z44.9") || w.starts_with("Z45.0"));
        feeds.map(|w| w[..6].to_owned()).collect()
    };
    assert_eq!(
        depths(one_by_one).len(),
        3,
        "{:?}",
        fanuc(&folder, one_by_one)
    );
    // Increments, down from R by three millimetres, in a line for each hole.
    let out = fanuc(&folder, grid);
    let down: Vec<&String> = out.iter().filter(|l| l.contains("Z-3. R-")).collect();
    assert!(down.len() == 2 && down[0].starts_with("G91 X"), "{out:?}");
    assert!(!down.iter().any(|l| l.contains('L')), "{out:?}");
}

#[test]
fn a_line_that_goes_home_may_have_g0() {
    let folder = Folder::new();
    let out = fanuc(&folder, "G0 G91 G28 Z0.\nG90 Z60.\n");
    assert!(out.iter().any(|l| l == "G0 G91 G28 Z0."), "{out:?}");
    refuses(
        "G21 G90\nG0 X10 Y10 Z50\nG0 G28 Z60\nM2\n",
        &[],
        &["line 3", "two words in the line that take the axes"],
    );
}

#[test]
fn what_ends_modes_that_are_not_followed_passes_and_what_moves_is_refused_by_name() {
    let folder = Folder::new();
    let ends = "G90 G54 G64 G50 G17 G40 G80 G94 G91.1 G49\nG15\nG69\nG67\nG0 X20\n";
    let out = corrected(
        &folder,
        &format!("G21\nG0 X10 Y10 Z50\n{ends}M2\n"),
        &["--check"],
    );
    assert!(out.contains("G91.1 G49\nG15\nG69\nG67\n"), "{out}");
    // Mach's first line.
    corrected(
        &folder,
        "G00G21G17G90G40G49G80\nG0X10Y10Z50\nM2\n",
        &["--check"],
    );
    for word in [
        "G12", "G31", "G44", "G60", "G76", "G110", "G150", "G234", "G254", "G68.2",
    ] {
        let line = format!("{BEGIN}{word}\nM30\n%\n");
        let mut options = FANUC.to_vec();
        options.extend(["--pass", word]);
        refuses(
            line,
            &options,
            &["line 5", &format!("`{word}`"), "write the program out"],
        );
    }
}

#[test]
fn home_and_probing_under_a_rotation_leave_x_and_y_unknown() {
    let turned = "G21 G90\nG10 L2 P1 X100 Y50 Z-350 R30\nG0 X10 Y10 Z50\n";
    for line in ["G28 X5\nG53 G0 Y90", "G38.2 X5 F100\nG53 G0 Y90"] {
        let parts = ["line 5", "position of X", "under a rotation", "G53 G0 X"];
        refuses(format!("{turned}{line}\nM2\n"), &[], &parts);
    }
}

#[test]
fn under_a_rotation_a_rapid_brings_x_and_y_both_to_their_places() {
    let folder = Folder::new();
    // A correction of X alone in the first line, and one of Y where C is turned.
    let errors = "machine = \"xyzac-trt\"\n[parameters]\nEXXb = 4e-3\nEYCs1 = 10e-3\n";
    let (errors, trax) = (folder.file("errors.toml", errors), folder.at("c.trax"));
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    answer(0, &["compile", &machine, &errors, "-o", &trax]);
    let setup = format!(
        "{}[offset.G54]\nX = 200\nY = 150\nZ = -125\n[offset.G55]\nX = 100\nY = 75\nZ = -60\nR = 30\n",
        super::five_axes::START
    );
    let program = "G21 G90 G42 G1 A1 F9\nG55 G0 C40\nM30\n";
    let files = [&*trax, &setup];
    with_files(&folder, program, files, &["--check"], |words| {
        answer(0, words)
    });
    let out = written(&folder);
    let words = |line: &str, letter: char| {
        let line = out.lines().find(|l| l.contains(line)).unwrap();
        line.split_whitespace().any(|w| w.starts_with(letter))
    };
    assert!(words("G42", 'X') && !words("G42", 'Y'), "{out}");
    assert!(words("G55", 'X') && words("G55", 'Y'), "{out}");
}

#[test]
fn behind_home_z_moves_again_with_its_offset_alone() {
    let folder = Folder::new();
    let begin = format!("{BEGIN}G43 Z40. H1\nG53 G0 Z-1.\n");
    for line in ["Z50.", "G1 X20. F100.", "G91 Z5."] {
        let parts = [
            "line 7",
            "whether the tool offset of G43 is still active",
            "G43 with H",
        ];
        let options = [&FANUC[..], &["--decimals", "4"]].concat();
        refuses(format!("{begin}{line}\nM30\n%\n"), &options, &parts);
    }
    // Above the part it is moved without a word of Z.
    let out = fanuc(
        &folder,
        "G43 Z40. H1\nG53 G0 Z-1.\nX20. Y20.\nG43 Z50. H1\n",
    );
    let from = out.iter().rposition(|l| l.contains("G53")).unwrap();
    let to = out.iter().rposition(|l| l.contains("G43")).unwrap();
    let way = &out[from + 1..to];
    assert!(
        !way.is_empty() && way.iter().all(|l| !l.contains('Z')),
        "{out:?}"
    );
}

#[test]
fn an_axis_that_nobody_has_commanded_has_no_word_in_a_rapid() {
    let folder = Folder::new();
    let out = corrected(
        &folder,
        "G21 G90\nG53 G0 Z-20\nG0 Z50\nX10 Y10\nZ20\nG1 X20 F500\nM6\nG0 Z60\nX0\nY0\nM2\n",
        &["--check"],
    );
    let lines: Vec<&str> = out.lines().collect();
    let only_z = |l: &&str| !l.contains('X') && !l.contains('Y');
    // Up in machine coordinates, then down to Z50, before anything is said of X and Y.
    let first = lines.iter().position(|l| !only_z(l)).unwrap();
    assert!(lines[2].starts_with("G53 G0 Z-"), "{out}");
    assert!(
        lines[first - 1].contains("Z50.") || lines[first - 1].contains("Z49.9"),
        "{out}"
    );
    // The same behind a tool change, up to `X0`, which leaves Y alone.
    let change = lines.iter().position(|l| *l == "M6").unwrap();
    let next = lines[change..].iter().position(|l| !only_z(l)).unwrap() + change;
    assert!(
        lines[change + 1].starts_with("G0 Z") && lines[next].starts_with('X'),
        "{out}"
    );
    assert!(!lines[next].contains('Y'), "{out}");
}

#[test]
fn a_tool_that_was_touched_off_has_a_length_beside_its_offset() {
    let folder = Folder::new();
    let setup = "units = \"mm\"\n[start]\nX = 100\nY = 100\nZ = -100\n[offset.G54]\nX = 100\nY = 50\nZ = 0\n\
                 [tool.1]\nlength = 100\noffset = -310\n";
    let program = "G21 G90\nG43 H1\nG0 X10 Y10 Z50\nG1 X20 F100\nM2\n";
    let (machine, mill) = (example("mill-21/machine.toml"), blob("mill-21"));
    let options = ["--machine", &machine, "--json"];
    let said = with_files(&folder, program, [&mill, setup], &options, |words| {
        answer(0, words)
    });
    let used = said.split("used_mm").nth(1).unwrap();
    assert!(
        used.contains("100.0") && !used[..40].contains("310"),
        "{said}"
    );
}
