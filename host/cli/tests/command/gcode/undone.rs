//! Corrections taken away: every line of the program leads again where it led.

use super::five_axes::START;
use super::programs::program;
use super::random::{Bench, boxes, rules};
use super::{corrected, refuses};
use crate::program::{Folder, answer, blob, refused};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;
use std::fmt::Write;
use trueaxis::{Axis, Direction, Draft, DraftBank, Interpolation, Policy, SampleFormat, Term};
use trueaxis_controllers::gcode::axes::{COUNT, PerLetter, is_rotary};
use trueaxis_controllers::gcode::check::check;
use trueaxis_controllers::gcode::words::Block;
use trueaxis_controllers::gcode::{Backlash, Corrector, Options, Rules, State, Tables, stream};
use trueaxis_tables::validate::Runtime;

const ALL: [Backlash; 3] = [Backlash::Move, Backlash::Blend, Backlash::Leave];

/// What a position may be off: four roundings to the last digits of words (mm, degrees).
const NEAR: [f64; 2] = [2.5e-4, 2.5e-5];

/// Half of the step where X turns round (mm): it goes on in the direction before, farther than the program went.
const AHEAD: f32 = -0.018;
/// The same back, with the axis.
const BACK: f32 = 0.018;

/// Steps where X turns round, of 12 µm where Y does, and where C does of 8 µm on X, 24 µm on Y and 0.006 degrees on C; a
/// curve along X, so that moves are cut. `period` is that of C, or 0.
fn steps(period: f32, of_x: f32) -> Draft {
    let axis = |name: u8, travel: [f32; 2], period: f32| Axis {
        name,
        travel,
        period,
        value_bound: 1.0,
        rate_bound: 1.0,
        // Programs have whole micrometres: none comes back by just so much.
        hysteresis: 0.00137,
        ramp_rate: 1.0,
    };
    let bank =
        |input: u8, start: f32, step: f32, direction: Direction, column: Vec<f32>| DraftBank {
            input,
            start,
            step,
            modulo: input == 4 && period > 0.0,
            direction,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![column],
        };
    let term = |output: u8, weight: f32, factor: u8| Term {
        output,
        weight,
        limits: None,
        factors: [factor].into_iter().collect(),
    };
    let of_c = match period > 0.0 {
        true => bank(4, -180.0, 90.0, Direction::Signed, vec![0.004; 4]),
        false => bank(4, -720.0, 90.0, Direction::Signed, vec![0.004; 17]),
    };
    let curve = (0..9).map(|k| 0.002 * f32::from(k as u8) * f32::from((k % 3) as u8));
    let (x, y, c) = (0, 1, 4);
    Draft {
        machine: "steps".to_owned(),
        policy: Policy::default(),
        axes: vec![
            axis(b'X', [-1000.0, 1000.0], 0.0),
            axis(b'Y', [-1000.0, 1000.0], 0.0),
            axis(b'Z', [-1000.0, 1000.0], 0.0),
            axis(b'A', [-360.0, 360.0], 0.0),
            match period > 0.0 {
                true => axis(b'C', [f32::MIN, f32::MAX], period),
                false => axis(b'C', [-720.0, 720.0], 0.0),
            },
        ],
        auxiliaries: Vec::new(),
        banks: vec![
            bank(x, -1000.0, 2000.0, Direction::Signed, vec![of_x; 2]),
            bank(y, -1000.0, 2000.0, Direction::Signed, vec![0.006; 2]),
            of_c,
            bank(x, -1000.0, 250.0, Direction::Both, curve.collect()),
        ],
        terms: vec![
            term(x, 1.0, 0),
            term(y, 1.0, 1),
            term(x, 1.0, 2),
            term(y, -3.0, 2),
            term(c, 0.75, 2),
            term(x, 1.0, 3),
            term(y, -1.0, 3),
        ],
        grids: Vec::new(),
    }
}

/// Where the machine stands behind each line of a program, told by its comment.
fn ends(text: &str, rules: &Rules) -> BTreeMap<usize, Vec<PerLetter>> {
    let mut state = State::new(rules);
    let (mut block, mut ends) = (Block::default(), BTreeMap::<usize, Vec<PerLetter>>::new());
    let mut number = 0;
    for line in text.lines() {
        if let Some((_, comment)) = line.split_once("(#") {
            number = comment.trim_end_matches(')').parse().unwrap();
        }
        block.scan(line.as_bytes(), rules.dialect).unwrap();
        state.step(&block, rules).unwrap();
        ends.entry(number).or_default().push(state.position.at);
    }
    ends
}

fn off(a: &PerLetter, b: &PerLetter) -> f64 {
    let off = (0..COUNT).map(|i| (a[i] - b[i]).abs() / NEAR[usize::from(is_rotary(i))]);
    off.fold(0.0, f64::max)
}

/// How far a place is from the straight way between two others.
fn beside(at: &PerLetter, from: &PerLetter, to: &PerLetter) -> f64 {
    let by: PerLetter = std::array::from_fn(|i| to[i] - from[i]);
    let square: f64 = by.iter().map(|b| b * b).sum();
    let along: f64 = (0..COUNT).map(|i| (at[i] - from[i]) * by[i]).sum();
    let t = if square > 0.0 {
        (along / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    off(at, &std::array::from_fn(|i| from[i] + t * by[i]))
}

/// Corrects a program, or takes the correction away.
fn correct(
    text: &str,
    rules: &Rules,
    tables: &Tables<'_>,
    (backlash, undo): (Backlash, bool),
) -> String {
    let options = Options {
        backlash,
        undo,
        ..Options::default()
    };
    let mut corrector = Corrector::new(rules, tables, None, options, None).unwrap();
    let mut written = Vec::new();
    stream::correct(text.as_bytes(), &mut written, &mut corrector, |_| {})
        .unwrap_or_else(|e| panic!("undo {undo}: {e}\n{text}"));
    String::from_utf8(written).unwrap()
}

/// What is written for a program, which the check must accept.
fn checked(text: &str, rules: &Rules, tables: &Tables<'_>, backlash: Backlash) {
    let there = correct(text, rules, tables, (backlash, false));
    let options = Options {
        backlash,
        ..Options::default()
    };
    let (before, after) = (text.as_bytes(), there.as_bytes());
    let found = check(before, after, rules, tables, None, None, options);
    let found = found.unwrap_or_else(|e| panic!("{e}\n{text}\n{there}"));
    assert!(found.holds(&options), "{found:?}\n{text}\n{there}");
}

/// Corrects a program and takes the correction away: every line leads where it led, and what a straight one became
/// stays on its way.
fn comes_back(text: &str, rules: &Rules, tables: &Tables<'_>, backlash: Backlash, name: &str) {
    let lines = text.lines().enumerate();
    let text: String = lines.fold(String::new(), |mut text, (number, line)| {
        let _ = writeln!(text, "{line} (#{number})");
        text
    });
    let there = correct(&text, rules, tables, (backlash, false));
    let back = correct(&there, rules, tables, (backlash, true));
    let (expected, undone) = (ends(&text, rules), ends(&back, rules));
    let mut from = None;
    let mut in_cycle = false;
    for (number, to) in &expected {
        let shown = || format!("{name}, line {number}\n{text}\n{there}\n{back}");
        let (to, places) = (to.last().unwrap(), &undone[number]);
        let last = places.last().unwrap();
        assert!(off(last, to) < 1.0, "{last:?} for {to:?}: {}", shown());
        let line = text.lines().nth(*number).unwrap();
        let has = |words: &[&str]| words.iter().any(|word| line.contains(word));
        in_cycle = has(&["G73", "G8"]) || in_cycle && !has(&["G0", "G1 "]);
        let straight = !in_cycle && !has(&["G2", "G3"]);
        if let (Some(from), true) = (from, straight) {
            for place in places {
                let off = beside(place, from, to);
                assert!(off < 2.0, "{place:?}, {off} beside: {}", shown());
            }
        }
        from = Some(to);
    }
}

fn with_steps(period: f32, of_x: f32, run: impl Fn(&Bench, &Tables<'_>, &Rules)) {
    let blob = steps(period, of_x).encode().unwrap();
    let bench = Bench::of(
        blob,
        "linuxcnc-xyzac-trt/machine.toml",
        "linuxcnc-xyzac-trt/errors-11.toml",
    );
    let runtime = Runtime::load(&bench.blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    run(&bench, &tables, &rules(&bench, &tables));
}

#[test]
fn random_programs_come_back_whatever_becomes_of_reversals() {
    // Blended, a step ahead may be more than a chord goes back: nothing tells which of them is the program's.
    let ways = [
        (AHEAD, [Backlash::Move, Backlash::Leave]),
        (BACK, [Backlash::Move, Backlash::Blend]),
    ];
    for (period, (of_x, choices)) in [0.0, 360.0].into_iter().flat_map(|p| ways.map(|w| (p, w))) {
        with_steps(period, of_x, |bench, tables, rules| {
            for seed in 0..150 {
                let mut random = Pcg64Mcg::seed_from_u64(seed);
                let text = program(&mut random, rules, &boxes(&bench.machine), 12);
                for backlash in choices {
                    let name = format!("seed {seed}, period {period}, {of_x}, {backlash:?}");
                    comes_back(&text, rules, tables, backlash, &name);
                }
            }
        });
    }
}

/// Short and long ways, several axes at once, arcs that turn C, back and forth.
fn back_and_forth(random: &mut Pcg64Mcg, c: f64) -> String {
    let mut text = String::from("G21 G90 G17 F900\nG0 X200 Y150 Z-100 A0 C0\n");
    for _ in 0..25 {
        let lengths = [0.003, 0.04, 0.5, 30.0];
        let around = |random: &mut Pcg64Mcg, middle: f64| {
            let most = lengths[random.random_range(0..4)];
            middle + most * (random.random::<f64>() - 0.5)
        };
        let mut line = String::from(["G0", "G1"][random.random_range(0..2)]);
        if random.random_range(0..4) == 0 {
            let [i, j] = [0, 1].map(|_| 3.0 + 9.0 * random.random::<f64>());
            line = format!("G{} I{i:.4} J-{j:.4}", random.random_range(2..4));
        } else {
            for (letter, middle) in [('X', 200.0), ('Y', 150.0)] {
                if random.random_range(0..2) == 0 {
                    let _ = write!(line, " {letter}{:.3}", around(random, middle));
                }
            }
        }
        if random.random_range(0..3) == 0 {
            let _ = write!(line, " C{:.3}", c * (random.random::<f64>() - 0.5));
        }
        text += &(line + "\n");
    }
    text
}

#[test]
fn axes_that_go_back_and_forth_come_back_by_less_and_more_than_their_steps() {
    for (period, c) in [(0.0, 1000.0), (360.0, 1500.0), (360.0, 30.0)] {
        with_steps(period, AHEAD, |_, tables, rules| {
            for seed in 0..150 {
                let mut random = Pcg64Mcg::seed_from_u64(seed);
                let text = back_and_forth(&mut random, c);
                // A blended step may be all of a short move: what is the program's and what is the step nothing tells.
                for backlash in [Backlash::Move, Backlash::Leave] {
                    let name = format!("seed {seed}, {c} of {period}, {backlash:?}");
                    comes_back(&text, rules, tables, backlash, &name);
                }
            }
        });
    }
}

#[test]
fn turns_of_more_than_half_a_period_are_taken_the_way_they_go() {
    with_steps(360.0, AHEAD, |_, tables, rules| {
        for c in [
            "181", "190", "350", "1000", "-181", "-190", "-350", "-720", "30000",
        ] {
            for line in ["G0", "G1", "G2 I3", "G3 I3 Z-90"] {
                let text = format!(
                    "G21 G90 G17 F900\nG0 X200 Y150 Z-100 A0 C0\n{line} C{c}\nG1 X190\nC-11\n"
                );
                for backlash in ALL {
                    checked(&text, rules, tables, backlash);
                    comes_back(&text, rules, tables, backlash, &format!("{line} C{c}"));
                }
            }
        }
    });
}

#[test]
fn circles_that_are_hardly_larger_than_steps_at_reversals_are_accepted() {
    with_steps(0.0, AHEAD, |_, tables, rules| {
        for radius in ["0.0101", "0.012", "0.0173", "0.03", "0.2"] {
            for turn in ["G2 I-", "G3 I-", "G2 J", "G3 J-"] {
                let text = format!(
                    "G21 G90 G17 F9\nG0 X200 Y150 Z-100 A0 C0\n{turn}{radius} P22\nG1 X201\n"
                );
                checked(&text, rules, tables, Backlash::Move);
            }
        }
    });
}

#[test]
fn behind_a_thread_axes_have_turned_round() {
    with_steps(0.0, AHEAD, |_, tables, rules| {
        for (there, behind) in [
            ("X200.5 Z-101", "G1 X150"),
            ("Y150.5", "G1 Y170 C5"),
            ("C1 Z-101", "G1 A-3 F22"),
            ("X200.4 Y150.3", "G0 X150"),
        ] {
            let text = format!(
                "G21 G90 G17 F900\nS100 M3\nG0 X200 Y150 Z-100 A0 C0\nG1 X200.1 Y150.1\nG33.1 {there} K1\n{behind}\nG1 X210\n"
            );
            checked(&text, rules, tables, Backlash::Move);
        }
    });
}

#[test]
fn axes_that_turn_round_on_the_way_to_a_hole_come_back() {
    with_steps(0.0, AHEAD, |_, tables, rules| {
        let text = "G21 G90 G98 G17 F900\nG0 X200 Y150 Z-80 A0 C0\nG0 Y155\nG81 X201 Y152 Z-90 R-88\nX205\nX203 Y160\n\
                    G80\nG0 X200\nY165\nY150 X210\nM2\n";
        for backlash in ALL {
            comes_back(text, rules, tables, backlash, &format!("{backlash:?}"));
        }
    });
}

#[test]
fn what_was_added_at_reversals_is_left_out_again() {
    with_steps(0.0, AHEAD, |_, tables, rules| {
        let text =
            "G21 G90 G17 F900\nG0 X200 Y150 Z-100 A0 C0\nG1 X210\nX205\nY140 (back)\nC5\nC2\nM2\n";
        let there = correct(text, rules, tables, (Backlash::Move, false));
        assert_eq!(there.lines().count(), 11, "{there}");
        let back = correct(&there, rules, tables, (Backlash::Move, true));
        assert_eq!(back.lines().count(), 9, "{back}");
        assert!(back.contains("Y150.0000 (back)\nY140.0000\n"), "{back}");
    });
}

/// The checksum in the first line of a corrected program.
fn checksum(corrected: &str) -> &str {
    let mark = corrected.lines().next().unwrap();
    mark.split([' ', ',']).nth(3).unwrap()
}

#[test]
fn what_was_corrected_with_another_compensation_or_not_at_all_is_not_undone() {
    let folder = Folder::new();
    let program = "G21 G90\nG0 X10 Y10 Z50\nM30\n";
    let out = corrected(&folder, program, &["--backlash", "blend"]);
    assert!(
        !out.contains("backlash"),
        "no axis of this machine steps: {out}"
    );
    let own = checksum(&out);
    let undo = ["--undo"];
    let other = out.replacen(own, "0badc0de", 1);
    let parts = [
        "line 1",
        own,
        "another checksum",
        "with the checksum 0badc0de",
    ];
    refuses(other, &undo, &parts);
    let not_corrected = ["no comment before it", own, "never corrected"];
    let told = |line: &'static str| [&[line], &not_corrected[..]].concat();
    refuses(program, &undo, &told("line 1"));
    refuses(
        format!("%\n(a part)\n\n{program}%\n"),
        &undo,
        &told("line 4"),
    );
    refuses("(a part)\n", &undo, &told("line 1"));
    let edited = format!("(trueaxis corrected: something)\n{program}");
    refuses(edited, &undo, &["line 1", "does not say", own]);
    // Controllers that know capitals only.
    corrected(&folder, &out.to_uppercase(), &undo);
    let behind = out.replacen("(trueaxis", "%\n(a part)\n(trueaxis", 1);
    corrected(&folder, &behind, &undo);
}

#[test]
fn reversals_are_taken_away_as_they_were_corrected() {
    let folder = Folder::new();
    let setup = folder.file("setup.toml", format!("{START}[offset.G54]\n"));
    let part = folder.file("part.ngc", "G21 G90\nG0 X200 Y150 Z-21 A0 C0\nM30\n");
    let [out, back, compensation] = [
        folder.at("out.ngc"),
        folder.at("back.ngc"),
        blob("xyzac-trt"),
    ];
    let arguments = |from: &'static str, options: &[&'static str]| {
        let [from, to] = match from {
            "part" => [&part, &out],
            _ => [&out, &back],
        };
        let mut all = vec!["gcode", from, "-o", to, "--setup", &setup];
        all.extend(["--compensation", &compensation]);
        all.extend(options);
        all.into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    for (name, other) in [("move", "leave"), ("blend", "move"), ("leave", "move")] {
        let there = arguments("part", &["--backlash", name]);
        answer(0, &there.iter().map(String::as_str).collect::<Vec<_>>());
        let mark = std::fs::read_to_string(&out).unwrap();
        let mark = mark.lines().next().unwrap();
        let said = format!(", backlash {name})");
        assert_eq!(mark.ends_with(&said), name != "move", "{mark}");
        let wrong = arguments("out", &["--undo", "--backlash", other]);
        let parts = [
            "line 1",
            &format!("corrected with --backlash {name}"),
            &format!("--backlash {other} is given"),
            &format!("give --backlash {name}"),
        ];
        refused(
            &wrong.iter().map(String::as_str).collect::<Vec<_>>(),
            &parts,
        );
        let right = arguments("out", &["--undo", "--backlash", name]);
        answer(0, &right.iter().map(String::as_str).collect::<Vec<_>>());
    }
}

#[test]
fn the_check_accepts_what_is_written_whatever_becomes_of_reversals() {
    for (period, c) in [(0.0, 1000.0), (360.0, 1500.0)] {
        for of_x in [AHEAD, BACK] {
            with_steps(period, of_x, |bench, tables, rules| {
                // Among them steps of two axes one behind the other, both longer than the move.
                for seed in 20..90 {
                    let mut random = Pcg64Mcg::seed_from_u64(seed);
                    let texts = [
                        back_and_forth(&mut random, c),
                        program(&mut random, rules, &boxes(&bench.machine), 12),
                    ];
                    for (text, backlash) in texts.iter().flat_map(|t| ALL.map(|b| (t, b))) {
                        checked(text, rules, tables, backlash);
                    }
                }
            });
        }
    }
}
