//! Cycles, and threads: what is written is what another interpreter makes of the program, corrected.

use super::{SETUP, corrected, refuses, with_files, written};
use crate::program::{Folder, answer, example};

#[test]
fn pecks_end_where_their_corrections_lead() {
    let folder = Folder::new();
    // Scales alone: one straight line over any depth.
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEXX1 = 200e-6\nEYY1 = -300e-6\nEZZ1 = 400e-6\n",
    );
    let trax = folder.at("scales.trax");
    answer(
        0,
        &[
            "compile",
            &example("mill-21/machine.toml"),
            &errors,
            "-o",
            &trax,
        ],
    );
    for cycle in ["G83", "G73"] {
        for q in ["Q1.3", "Q5", "Q0.7", "Q150"] {
            let program = format!(
                "G21 G90 G98 G17 F300\nG0 X100 Y100 Z250\n{cycle} X120 Y110 Z228.5 R240 {q}\nX150\nG80\nM30\n"
            );
            let files = [&trax, SETUP];
            let said = with_files(&folder, program, files, &["--check"], |w| answer(0, w));
            assert!(said.contains("cycles: 2 stay"), "{said}");
        }
    }
}

#[test]
fn incremental_cycles_count_r_from_the_level_before_their_series() {
    let folder = Folder::new();
    let program = "G21 G90 G17 F300\nG0 X100 Y100 Z250\nG99 G81 X110 Y110 Z225 R230\nG91 G81 X5 Z-7 R0 L2\nG80\nM30\n";
    let out = corrected(&folder, program, &["--check"]);
    let kept: Vec<&str> = out.lines().skip_while(|l| !l.starts_with("G91")).collect();
    assert!(
        kept[0].starts_with("G91 G81 X5") && !kept[0].contains('L'),
        "{out}"
    );
    assert!(
        kept[1].starts_with("X5") || kept[1].starts_with("X4.99"),
        "{out}"
    );
    // Written out, where a hole may hardly be off.
    let out = corrected(&folder, program, &["--check", "--hole-tolerance", "0.3"]);
    let behind = out.lines().skip_while(|line| !line.starts_with("G0 X100"));
    let height = |line: &str| -> f64 {
        let word = line.split_whitespace().find(|word| word.starts_with('Z'));
        word.map_or(0.0, |word| word[1..].parse().unwrap())
    };
    // Down to 225 and up to 230, then to 250, 7 mm down and up again, twice: LinuxCNC's interpreter goes the same way.
    let (mut at, mut bottoms, mut relative) = (0.0, Vec::new(), false);
    for line in behind {
        relative |= line.contains("G91");
        at = match height(line) {
            by if relative => at + by,
            0.0 => at,
            to => to,
        };
        if line.starts_with("G1") {
            bottoms.push(at);
        }
    }
    assert_eq!(bottoms.len(), 3, "{out}");
    for height in bottoms
        .into_iter()
        .zip([225.0, 243.0, 243.0])
        .chain([(at, 250.0)])
    {
        assert!((height.0 - height.1).abs() < 0.01, "{height:?}: {out}");
    }
}

#[test]
fn a_thread_that_comes_back_is_corrected_at_its_end() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X100 Y100 Z250\nS100 M3\nG33.1 Z245 K1\nG1 X120 F100\nM30\n";
    let out = corrected(&folder, program, &["--check"]);
    let line = out.lines().find(|line| line.starts_with("G33.1")).unwrap();
    assert!(
        line.starts_with("G33.1 Z24") && line.ends_with(" K1"),
        "{out}"
    );
}

#[test]
fn behind_a_thread_that_comes_back_the_axes_stand_where_they_stood() {
    // At the start, which is not corrected: the move that feeds steps onto its path.
    let program = "G21 G90 G17\nS100 M3\nG33.1 Z245 K1\nG93 G1 X100 F10\nM30\n";
    let out = corrected(&Folder::new(), program, &["--check"]);
    let first = out.lines().find(|line| line.starts_with("G93"));
    assert!(first.is_some_and(|line| line.contains("X0.0")), "{out}");
}

#[test]
fn a_thread_that_goes_nowhere_is_a_motion() {
    let folder = Folder::new();
    let program = "G21 G90 G17\nG0 X100 Y100 Z250\nS100 M3\nG33.1 Z250 K1\nG1 X120 F100\nM30\n";
    corrected(&folder, program, &["--check"]);
}

#[test]
fn boring_that_is_written_out_stops_the_spindle_and_starts_it_as_it_was() {
    for (spindle, word) in [("M4 S500", "M4"), ("M4\nM5\nM3", "M3")] {
        let folder = Folder::new();
        let program = format!(
            "G21 G90 G17 F300\n{spindle}\nG0 X100 Y100 Z250\nG98 G86 X120 Y110 Z120 R240 P.5\nX150\nG80\nM30\n"
        );
        let out = corrected(&folder, &program, &["--check"]);
        // LinuxCNC's order: down, wait, stop, rapid to the level before the cycle, start.
        let holes: Vec<&str> = out.lines().skip_while(|l| !l.starts_with("G98")).collect();
        let others = holes
            .iter()
            .filter(|l| l.starts_with("G4 ") || l.starts_with('M'));
        let others: Vec<&str> = others.copied().collect();
        let hole = ["G4 P0.5", "M5", word];
        assert_eq!(others, [&hole[..], &hole, &["M30"]].concat(), "{out}");
        for pair in holes.windows(2) {
            match pair[1] {
                up if pair[0] == "M5" => assert!(up.starts_with("G0 "), "{out}"),
                next if next == word => assert!(pair[0].contains("Z249.99"), "{out}"),
                _ => {}
            }
        }
    }
}

#[test]
fn boring_is_written_out_only_if_the_spindle_is_known_to_turn() {
    for before in ["", "M3\nM5\n", "M3\nT1 M6\n", "M3\nM19 R0\n"] {
        let program = format!(
            "G21 G90 G98 G17 F300\n{before}G0 X100 Y100 Z250\nG86 X120 Y110 Z120 R240 P.5\nM30\n"
        );
        refuses(program, &[], &["known to turn", "M3 or M4"]);
    }
}

#[test]
fn boring_needs_its_time_in_linuxcnc_alone() {
    let program =
        "G21 G90 G98 G17 G54 F300.\nM3\nG0 X100. Y100. Z250.\nG86 X120. Y110. Z120. R240.\nM30\n";
    refuses(program, &[], &["P, the time at the bottom"]);
    let out = corrected(&Folder::new(), program, &["--dialect", "fanuc", "--check"]);
    assert!(out.contains("M5\n") && !out.contains("G4"), "{out}");
}

#[test]
fn holes_and_levels_that_are_hardly_apart_are_accepted() {
    let start = "G21 G90 G17 G98 F300\nG0 X100 Y100 Z245\n";
    for series in [
        // R is above the level by less than corrections differ, at another place.
        "G81 X110 Z240 R244.5\nG80\nG81 X20 Z235 R245.001\nX150\nG81 X30 R245.003 Z240",
        "G99 G81 X110 Z240 R244.5\nX20 R244.501\nX150 R244.503\nX30 R244.5",
        // Holes half a millimetre apart, which is what corrections may differ over a hole.
        "G85 X20 Z235 R240\nX20.5\nX20\nX20.501\nX20.002",
        "G99 G81 X20 Z235 R240\nX20.3\nX20\nX20.3 R240.2\nX20 R240",
    ] {
        let program = format!("{start}{series}\nG80\nM30\n");
        // With room for cycles that stay, and written out.
        for tolerance in ["0.3", "0.5", "100"] {
            let options = ["--check", "--tolerance", tolerance];
            corrected(&Folder::new(), &program, &options);
        }
    }
}

#[test]
fn a_cycle_with_backlash_of_its_axis_stays_one_whatever_becomes_of_reversals() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEXXb = 4e-3\nEYYb = 3e-3\nEZZb = 5e-3\n",
    );
    let setup = format!("{SETUP}[home.G28]\n").replace(
        "Z = -100\n[",
        "Z = -100\ntravel = { X = \"+\", Y = \"+\", Z = \"-\" }\n[",
    );
    let trax = folder.at("backlash.trax");
    let machine = example("mill-21/machine.toml");
    answer(0, &["compile", &machine, &errors, "-o", &trax]);
    for backlash in ["move", "blend", "leave"] {
        for cycle in ["G81", "G83 Q3", "G73 Q3", "G85", "G84", "G74", "G89 P1"] {
            let program = format!(
                "G21 G90 G98 G17 F300\nM3 S100\nG0 X100 Y100 Z250\n{cycle} X120 Y110 Z230 R240\nX150\nX130\nG80\nM30\n"
            );
            let files = [&*trax, &setup];
            let options = ["--check", "--backlash", backlash];
            let said = with_files(&folder, &program, files, &options, |w| answer(0, w));
            assert!(said.contains("cycles: 3 stay, 0 are written out"), "{said}");
            let lines = written(&folder).lines().count();
            assert_eq!(lines, program.lines().count() + 1, "{cycle} {backlash}");
        }
    }
}

#[test]
fn what_cannot_be_written_out_is_refused_with_a_remedy_that_helps() {
    let begin = "G21 G90 G98 G17 F300\nM3 S100\nG0 X100 Y100 Z250\n";
    let program = format!("{begin}G84 X120 Y110 Z120 R240\nG80\nM30\n");
    let parts = ["line 4", "G84 cannot be written out", "--hole-tolerance"];
    refuses(&program, &[], &parts);
    let options = ["--hole-tolerance", "20", "--check"];
    let out = corrected(&Folder::new(), &program, &options);
    assert!(out.contains("\nG84 X120."), "{out}");
}
