//! Programs as posts of CAM systems write them.

use super::five_axes;
use super::{SETUP, corrected, refuses, refuses_with, run, with_files, with_setup, words, written};
use crate::program::{Folder, answer, blob, example};

#[test]
fn the_header_of_vcarve_has_inches_and_mm_as_g70_and_g71() {
    let program = |unit: &str| {
        format!(
            "%\n(HEADER)\nG00G21G17G90G40G49G80\n{unit}G91.1\nT1M06\nG00G43Z60.320H1\nS12000M03\nG94\n\
             X0.000Y0.000F2540.0\nG00X10.000Y10.000Z6.000\nG1X10.000Y10.000Z-1.000F762.0\n\
             G3X20.000Y20.000I0.000J10.000F2540.0\nG00Z20.320\nM09\nM30\n%\n"
        )
    };
    let folder = Folder::new();
    let [own, usual] = ["G71", "G21"].map(|unit| corrected(&folder, &program(unit), &["--check"]));
    let rest = |text: &str| text.split_once("HEADER)").unwrap().1.replace("G71", "G21");
    assert_eq!(rest(&own), rest(&usual));
    refuses(
        "G21 G90\nG71 P1 Q2 D3\n",
        &[],
        &["line 2", "G71", "cycles of lathes"],
    );
}

#[test]
fn a_feed_beside_another_unit_counts_in_the_unit_before_on_linuxcnc_and_in_the_new_one_on_grbl() {
    let folder = Folder::new();
    let feeds = |dialect: &str| {
        let program = "G21 G90 G0 X0 Y0 Z50\nG20 G1 X0.5 F254\nX1 F20\nM2\n";
        words(
            &corrected(&folder, program, &["--check", "--dialect", dialect]),
            'F',
        )
    };
    for dialect in ["linuxcnc", "grbl"] {
        assert_eq!(feeds(dialect), [254.0, 20.0], "{dialect}");
    }
    // The same in two lines: what F is there, in inches.
    let minutes = |program: &str, dialect: &str| {
        let out = super::run(&folder, program, &["--check", "--dialect", dialect]).1;
        out.split("feed moves take ").nth(1).unwrap()[..4].to_owned()
    };
    let together = "G21 G90 G0 X0 Y0 Z50\nG20 G1 X2 F254\nM2\n";
    let apart = |feed: &str| format!("G21 G90 G0 X0 Y0 Z50\nG20\nG1 X2 F{feed}\nM2\n");
    assert_eq!(
        minutes(together, "linuxcnc"),
        minutes(&apart("10"), "linuxcnc")
    );
    assert_eq!(minutes(together, "grbl"), minutes(&apart("254"), "grbl"));
    refuses(
        "G21 G90 G0 X0 Y0 Z50.\nG20 G1 X2. F254.\nM2\n",
        &["--dialect", "fanuc"],
        &["line 2", "another unit and F"],
    );
}

#[test]
fn a_motion_before_the_first_word_is_that_of_grbl_or_of_the_setup() {
    let program = "G21 G90\nX10 Y10 Z50\nG1 X20 F300\nM2\n";
    let folder = Folder::new();
    let out = corrected(&folder, program, &["--check", "--dialect", "grbl"]);
    assert!(words(&out, 'X').len() >= 2, "{out}");
    refuses(
        program,
        &[],
        &["line 2", "none is active", "[start] motion"],
    );
    let setup = SETUP.replace("[start]\n", "[start]\nmotion = \"G0\"\n");
    with_setup(program, &setup, &[]);
    corrected(
        &folder,
        &format!("$I ; build\n$$\n?\n{program}"),
        &["--check", "--dialect", "grbl"],
    );
    refuses(
        format!("$H\n{program}"),
        &["--dialect", "grbl"],
        &["line 1", "$H", "it may home"],
    );
}

#[test]
fn lengths_without_a_point_count_what_the_setup_says() {
    let setup = |decimals: &str| format!("decimals = \"{decimals}\"\n{SETUP}");
    let program = "%\nO1\nG21 G17 G90 G94\nG0 X100 Y20 Z50000\nG1 X110. F300\nM30\n%\n";
    let least = program.replace("X100 Y20", "X100000 Y20000");
    let calculator = program.replace("Z50000", "Z50");
    let fanuc = ["--dialect", "fanuc"];
    let [one, other] = [
        with_setup(&least, &setup("least"), &fanuc),
        with_setup(&calculator, &setup("calculator"), &fanuc),
    ];
    for letter in ['X', 'Y', 'Z'] {
        assert_eq!(words(&one, letter), words(&other, letter));
    }
    let parts = ["decimals", "take it out of the setup"];
    refuses_with(program, [&blob("mill-21"), &setup("least")], &[], &parts);
}

#[test]
fn words_of_fanuc_s_and_haas_s_have_three_decimals_and_four_in_inches() {
    let places = |program: &str, dialect: &str| {
        let out = corrected(&Folder::new(), program, &["--check", "--dialect", dialect]);
        let words = out.lines().filter(|line| !line.starts_with('('));
        let words = words.flat_map(str::split_whitespace).map(str::to_owned);
        let words = words.filter(|word| word.starts_with(['X', 'Y', 'Z', 'I', 'J']));
        words
            .map(|word| word.split_once('.').unwrap().1.len())
            .max()
    };
    let moves = "G0 X1. Y1. Z2.\nG1 X1.5 F30.\nG2 X2.5 Y2. I0. J1.\nM30\n%\n";
    for dialect in ["fanuc", "haas"] {
        assert_eq!(
            places(&format!("%\nO1\nG20 G17 G90 G94\n{moves}"), dialect),
            Some(4)
        );
        assert_eq!(
            places(&format!("%\nO1\nG21 G17 G90 G94\n{moves}"), dialect),
            Some(3)
        );
    }
}

#[test]
fn a_retract_to_the_end_of_the_travel_stays_within_it() {
    let setup = "units = \"mm\"\n[start]\nX = 100\nY = 100\nZ = -100\n[offset.G54]\nX = 100\nY = 50\nZ = -350\n\
                 [tool.1]\nlength = 100\n";
    let program = "%\nO1\nG21 G17 G90 G94\nG0 X100. Y20. Z50.\nG1 X110. F300.\nG53 G0 Z0.\nG53 G0 X500. Y0.\nM30\n%\n";
    for dialect in ["fanuc", "haas"] {
        let out = with_setup(program, setup, &["--dialect", dialect]);
        let machine = out.lines().filter(|line| line.contains("G53"));
        for line in machine {
            for (letter, [low, high]) in [
                ('X', [0.0, 500.0]),
                ('Y', [0.0, 300.0]),
                ('Z', [-400.0, 0.0]),
            ] {
                for word in words(line, letter) {
                    assert!((low..=high).contains(&word), "{line}");
                }
            }
        }
    }
    // Anything else that leads beyond it is refused.
    let program = program.replace("G53 G0 Z0.", "G0 Z350.");
    let parts = ["line 6", "with its correction"];
    let haas = ["--dialect", "haas"];
    refuses_with(program, [&blob("mill-21"), setup], &haas, &parts);
}

#[test]
fn tool_centre_point_control_may_begin_in_a_line_that_moves() {
    let machine = example("linuxcnc-xyzac-trt/machine.toml");
    let errors = example("linuxcnc-xyzac-trt/errors-11.toml");
    let options = [
        "--machine",
        &machine,
        "--errors",
        &errors,
        "--dialect",
        "fanuc",
        "--decimals",
        "4",
    ];
    let setup = "[offset.G54]\nX = 200\nY = 150\nZ = -280\n[tool.1]\nlength = 100\n";
    let rest = "G1 X20. Y10. A-30. C60. F500.\nX10. A-40.\nG49\nM30\n%\n";
    for turned in ["A0. C0.", "A-20. C30."] {
        let program = format!(
            "%\nO1\nG21 G17 G90 G94\nG0 X0. Y0. {turned}\nG0 G43.4 H1 X0. Y0. Z60.\n{rest}"
        );
        let (text, said) = five_axes::run(&program, setup, &options);
        let path = &said["check"]["tool_path"];
        assert!(path["before_um"]["max"].as_f64().unwrap() > 20.0, "{said}");
        assert!(path["after_um"]["max"].as_f64().unwrap() < 1.0, "{said}");
        assert!(text.contains("G0 G43.4 H1 X"), "{text}");
        // The same places as where it is switched on before.
        let apart = program.replace("G0 G43.4 H1 X0.", "G43.4 H1\nG0 X0.");
        let (apart, _) = five_axes::run(&apart, setup, &options);
        for letter in ['X', 'Y', 'Z', 'A', 'C'] {
            let [one, other] = [&text, &apart].map(|text| words(text, letter).pop());
            let off = one.unwrap() - other.unwrap();
            assert!(off.abs() < 2e-4, "{letter}: {text}{apart}");
        }
    }
}

#[test]
fn an_ordinary_program_of_a_sinumerik_is_corrected() {
    let setup = format!("{SETUP}[tool.\"MILL 10\"]\nlength = 100\n[tool_change]\nZ = -10\n");
    let program = "; %_N_PART_MPF\nN10 G17 G90 G94 G71 G40\nN20 G0 SUPA Z0 D0\nN30 T=\"MILL 10\"\nN40 M6\n\
                   N50 S6000 M3\nN60 G54 D1\nN70 CYCLE832(0.01,_FINISH,1)\nN80 MSG(\"contour (1)\")\n\
                   N90 G0 X10 Y10 Z-20\nN100 G1 Z-25 F300\nN110 X=60.5 F=800\nN120 G3 X70.5 Y20 CR=10\n\
                   N130 G2 X80.5 Y30 I10 J0\nN140 G4 F2\nN150 X100 Y50 CR=-30\nN160 G0 Z0\nN170 G0 SUPA Z0 D0\nN180 M30\n";
    let out = with_setup(program, &setup, &["--dialect", "siemens"]);
    assert!(out.contains(";trueaxis corrected: part.ngc "), "{out}");
    assert!(
        out.contains("N30 T=\"MILL 10\"\n") && out.contains("N170 G0 SUPA Z"),
        "{out}"
    );
    assert!(!out.contains("CR="), "arcs have a fitted centre: {out}");
    let siemens = ["--dialect", "siemens"];
    for (line, part) in [
        ("CYCLE83(50,0,2,-20)", "a cycle of a Sinumerik"),
        ("CYCLE800(0,\"\",0)", "swivelled plane"),
        ("TRANS X10", "a frame"),
        ("R1=10", "parameter"),
        ("X=DC(10)", "no number"),
        ("G0 SUPA Z=AC(0) D0", "AC or IC beside"),
        ("G58 X10", "(G58, G59 of a Sinumerik)"),
        ("G500", "offsets beyond G57"),
        ("G75 Z0", "moves the machine"),
        ("GOTOF END", "jump"),
        ("G0 X10 D2", "further cutting edge"),
        ("D1", "the tool in the spindle is unknown"),
    ] {
        refuses(
            format!("G71 G90\n{line}\nM30\n"),
            &siemens,
            &["line 2", part],
        );
    }
    refuses(
        "G700\nG0 X1 Y1 Z1\nG70\nM30\n",
        &siemens,
        &["line 3", "G700 or G710"],
    );
}

/// Where a Sinumerik's program is after each line that names X or Y.
fn places(text: &str) -> Vec<[f64; 2]> {
    let (mut at, mut incremental, mut places) = ([0.0; 2], false, Vec::new());
    for line in text.lines().filter(|line| !line.starts_with(';')) {
        incremental = !line.contains("G90") && (incremental || line.contains("G91"));
        let before = at;
        for word in line.split_whitespace() {
            let Some(axis) = ["X", "Y"].iter().position(|name| word.starts_with(name)) else {
                continue;
            };
            let value = &word[1..];
            let (own, number) = match value.split_once('(') {
                Some((own, number)) => (own == "=IC", number.trim_end_matches(')')),
                None => (incremental, value),
            };
            let value: f64 = number.parse().unwrap();
            at[axis] = if own { before[axis] + value } else { value };
        }
        places.extend((at != before).then_some(at));
    }
    places
}

#[test]
fn ac_and_ic_of_a_sinumerik_lead_where_plain_words_lead() {
    let of = |lines: &str| {
        let program = format!("G17 G90 G94 G71\nG0 X10 Y10 Z50\nG1 Z40 F300\n{lines}\nM30\n");
        with_setup(&program, SETUP, &["--dialect", "siemens"])
    };
    let plain = of(
        "X150 Y30\nX155 Y90\nG3 X145 Y100 I-10 J0\nG2 X125 Y120 I0 J20\nG1 X20 Y110\nX25 Y120\nG3 X25 Y120 I5 J0",
    );
    let own = of(
        "X=IC(140) Y=AC(30)\nG91 X5 Y=AC(90)\nG90 G3 X=IC(-10) Y=IC(10) I=AC(145) J=AC(90)\nG2 X=IC(-20) Y120 I=IC(0) J=AC(120)\n\
         G1 X=ac(20) Y110\nG91 X5. Y=IC(10)\nG90 G3 X25 Y120 I=AC(30)",
    );
    let [expected, found] = [&plain, &own].map(|text| places(text));
    assert_eq!(found.len(), expected.len(), "{own}{plain}");
    assert!(
        expected.len() > 12 && own.contains("=IC(") && own.contains("I=AC("),
        "{own}"
    );
    for (found, expected) in found.iter().zip(&expected) {
        // Words of four decimals; increments are counted from rounded places.
        let off = |k: usize| (found[k] - expected[k]).abs();
        assert!(
            off(0) < 2e-4 && off(1) < 2e-4,
            "{found:?} {expected:?}: {own}"
        );
    }
}

#[test]
fn what_only_looks_ahead_passes_and_paths_of_the_controller_do_not() {
    let setup = format!("decimals = \"calculator\"\n{SETUP}");
    let ahead = "G5.1 Q1\nG05.1 Q1 R5\nG8 P1\nG5 P10000\nG05 P0\nG5.4 Q1\nG61.1\nG62\nG64\n";
    let program = |lines: &str| {
        format!("G21 G90 G17 G94\nG0 X10 Y10 Z50\n{lines}G1 X20 F300\nG5.1 Q0\nM30\n")
    };
    for dialect in ["fanuc", "haas"] {
        let out = with_setup(&program(ahead), &setup, &["--dialect", dialect]);
        assert!(out.contains(ahead), "{out}");
        for line in ["G5.1 Q2 X0 Y0 Z0", "G5.1 Q3", "G5 P2", "G8", "G5.1 Q1 X0"] {
            let parts = ["line 2", "only looking ahead", "in a line without axes"];
            let options = ["--dialect", dialect];
            refuses(format!("G21 G90\n{line}\nM30\n"), &options, &parts);
        }
    }
    let smooth = "SOFT\nFFWON\nCOMPCAD\nG642\nDYNFINISH\nCTOL=0.01\nCYCLE832(0.01,_FINISH,1)\n";
    let program = format!("G71 G90 G17 G94\nG0 X10 Y10 Z50\n{smooth}G1 X20 F300\nM30\n");
    let out = with_setup(&program, SETUP, &["--dialect", "siemens"]);
    assert!(out.contains(smooth), "{out}");
}

#[test]
fn subprograms_in_the_file_are_corrected_where_they_are_called() {
    let called = "%\nO1 (MAIN)\nG21 G17 G90 G94\nG0 X10. Y10. Z50.\nG1 Z40. F300.\nM98 P2 L2\nG0 Z60.\nM30\n\
                  O2 (SUB)\nG91 G1 X20.\nY10.\nG90\nM99\n%\n";
    let flat = "%\nO1 (MAIN)\nG21 G17 G90 G94\nG0 X10. Y10. Z50.\nG1 Z40. F300.\nG91 G1 X20.\nY10.\nG90\nG91 G1 X20.\nY10.\nG90\n\
                G0 Z60.\nM30\n%\n";
    let folder = Folder::new();
    for dialect in ["fanuc", "haas"] {
        let options = ["--check", "--dialect", dialect];
        let [called, flat] = [called, flat].map(|program| corrected(&folder, program, &options));
        for letter in ['X', 'Y', 'Z'] {
            assert_eq!(words(&called, letter), words(&flat, letter), "{called}");
        }
    }
    // Places are those of the file.
    let wrong = called.replace("Y10.\nG90", "Y9999.\nG90");
    refuses(
        &wrong,
        &["--dialect", "fanuc"],
        &["line 11", "Y9999.", "outside its travel"],
    );
    refuses(
        called.replace("P2 L2", "P3"),
        &["--dialect", "haas"],
        &["line 6", "no program O3", "append"],
    );
    // What nothing calls stays after the end, but another main program does not.
    let unused = "O7 (UNUSED)\nG1 X9999.\nN5 X0. M99\nN8 G0 X1.\nM99\n%\n";
    let more = |last: &str| called.strip_suffix("%\n").unwrap().to_owned() + last;
    let out = corrected(&folder, &more(unused), &["--check", "--dialect", "haas"]);
    assert!(out.ends_with(unused), "{out}");
    for last in [
        "O7\nX1.\nM30\n%\n",
        "O7\nX1.\nO8\nM99\n%\n",
        "O7\nX1.\n%\n",
        "O7\nX1.\n",
    ] {
        let parts = ["line 14", "O7", "another program"];
        refuses(more(last), &["--dialect", "haas"], &parts);
    }
}

#[test]
fn a_feed_without_a_point_is_refused_where_another_is_needed() {
    // 200 mm under G93 need several pieces, each with its own F.
    let program = "%\nO1\nG21 G90 G17 G93\nG0 X0. Y0. Z60.\nG1 X200. F4\nM30\n%\n";
    for dialect in ["fanuc", "haas"] {
        let parts = ["line 5", "F4", "without a decimal point", "F100."];
        refuses(program, &["--dialect", dialect], &parts);
    }
    let folder = Folder::new();
    let options = ["--dialect", "haas", "--check"];
    let out = corrected(&folder, &program.replace("F4", "F4."), &options);
    assert!(words(&out, 'F').len() > 3, "{out}");
    // Kept as it is where no other F is needed.
    let out = corrected(&folder, &program.replace("G93", "G94"), &options);
    assert_eq!(out.matches('F').count(), 1, "{out}");
    assert!(out.contains("F4\n"), "{out}");
    let setup = format!("decimals = \"calculator\"\n{SETUP}");
    with_setup(program, &setup, &["--dialect", "fanuc"]);
}

#[test]
fn a_haas_smooths_by_p_and_e() {
    let folder = Folder::new();
    let program = "%\nO1\nG21 G90 G17 G94\nG187 P3 E0.02\nG0 X10. Y10. Z50.\nM30\n%\n";
    let out = corrected(&folder, program, &["--dialect", "haas"]);
    assert!(out.contains("\nG187 P3 E0.02\n"), "{out}");
}

#[test]
fn the_time_of_holes_in_a_row_is_counted_once() {
    let program = "G21 G90 G17 G98\nG0 X10 Y10 Z60\nG91 G81 X40 Z-20 R-5 F100 L4\nG90 G80\nM2\n";
    let (_, said) = super::run(&Folder::new(), program, &["--check"]);
    // Four holes of 20 mm at 100 mm/min.
    assert!(
        said.contains("feed moves take 0.80 min, before 0.80 min"),
        "{said}"
    );
}

#[test]
fn a_comment_within_a_comment_is_named() {
    refuses(
        "G21 (a (b) c) G90\n",
        &[],
        &["line 1", "comment within a comment"],
    );
}

#[test]
fn a_full_circle_is_as_few_arcs_as_keep_it() {
    let program = "G21 G90 G17\nG0 X150 Y100 Z50\nG1 X150 F500\nG3 X150 Y100 I-100\nM30\n";
    let arcs = |tolerance: &str| {
        let out = corrected(
            &Folder::new(),
            program,
            &["--check", "--tolerance", tolerance],
        );
        words(&out, 'I').len()
    };
    // The longest fit one after the other gives 25 and 9; a tenth more is allowed.
    let [fine, coarse] = ["0.5", "1"].map(arcs);
    assert!(fine <= 27 && coarse <= 9, "{fine} {coarse}");
}

#[test]
fn arcs_that_use_all_of_the_tolerance_do_not_exceed_it() {
    // Deviations that are largest between the nodes, and full turns whose centres are rounded.
    for (program, tolerance) in [
        (
            "G0 X4.656 Y138.5712 Z50\nG1 X4.656 F500\nG3 X4.656 Y138.5712 I72.9273 J-35.1982\n",
            1.0,
        ),
        (
            "G0 X136.4126 Y63.7855 Z50\nG1 X136.4126 F500\nG3 X136.4126 Y63.7855 Z51.947 I-32.7407 J75.51\n",
            5.0,
        ),
    ] {
        let text = format!("G21 G90 G17\n{program}M30\n");
        let options = ["--check", "--tolerance", &tolerance.to_string()];
        let (_, said) = run(&Folder::new(), &text, &options);
        let (before, _) = said.split_once(" µm from the corrected path").unwrap();
        let off: f64 = before.rsplit(' ').next().unwrap().parse().unwrap();
        assert!(off > 0.5 * tolerance && off <= tolerance, "{said}");
    }
}

#[test]
fn a_step_along_the_move_that_reverses_needs_no_line() {
    let folder = Folder::new();
    let errors = folder.file(
        "errors.toml",
        "machine = \"Mill with 21 errors\"\n[parameters]\nEXXb = 10e-3\nEYYb = 8e-3\n",
    );
    let setup = SETUP.replace("[offset", "travel = { X = \"+\", Y = \"+\" }\n[offset");
    let trax = folder.at("backlash.trax");
    let machine = example("mill-21/machine.toml");
    answer(0, &["compile", &machine, &errors, "-o", &trax]);
    let lines = |moves: &str| {
        let program = format!("G21 G90 G17\nG0 X-2 Y-2 Z0\nG0 X0 Y0\nG1 X1 Y1 F300\n{moves}M30\n");
        let options = ["--check", "--machine", &machine, "--errors", &errors];
        let files = [&*trax, &setup];
        let said = with_files(&folder, program, files, &options, |words| answer(0, words));
        assert!(
            said.contains("0.1 µm after") || said.contains("0.0 µm after"),
            "{said}"
        );
        let text = written(&folder);
        text.lines().count() - 1 - 5 - moves.lines().count()
    };
    assert_eq!(lines("X50\nY40\nX1\nY1\nX50\nY20\nX1\nY1\n"), 0);
    // Across the move it would be off.
    assert_eq!(lines("X50 Y40\nX1 Y50\n"), 1);
}
