//! How many lines programs of common kinds get where two axes have backlash.

use super::SETUP;
use crate::program::{Folder, answer, example};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Reversal values of X and Y: 30 and 60 µm. A parameter is half of that.
const BACKLASH: &str = "EXXb = 0.015\nEYYb = 0.030\n";
const BEGIN: &str = "G21 G90 G17 G94\nG0 X10 Y10 Z60\n";

/// Moves as a post writes them: only the words that change.
#[derive(Default)]
struct Post {
    text: String,
    at: [Option<String>; 5],
    motion: &'static str,
}

impl Post {
    fn new() -> Self {
        let text = BEGIN.to_owned();
        Self {
            text,
            ..Self::default()
        }
    }

    /// A move, with words for a centre or a feed after the axes.
    fn go(&mut self, motion: &'static str, axes: &[(char, f64)], more: &str) {
        let mut line = String::new();
        let is_arc = matches!(motion, "G2" | "G3");
        if motion != self.motion || is_arc {
            line += motion;
            line.push(' ');
        }
        self.motion = motion;
        for (letter, value) in axes {
            let word = format!("{letter}{value:.3}");
            let place = "XYZAC".find(*letter).unwrap();
            if is_arc || self.at[place].as_ref() != Some(&word) {
                line += &word;
                line.push(' ');
                self.at[place] = Some(word);
            }
        }
        line += more;
        if !line.trim().is_empty() && line.trim() != motion {
            writeln!(self.text, "{}", line.trim()).unwrap();
        }
    }

    fn to(&mut self, x: f64, y: f64) {
        self.go("G1", &[('X', x), ('Y', y)], "");
    }

    fn arc(&mut self, motion: &'static str, to: [f64; 2], centre: [f64; 2]) {
        let more = format!("I{:.3} J{:.3}", centre[0], centre[1]);
        self.go(motion, &[('X', to[0]), ('Y', to[1])], &more);
    }

    /// Down to a depth at a place.
    fn down(&mut self, x: f64, y: f64, z: f64) {
        self.go("G0", &[('Z', 60.0)], "");
        self.go("G0", &[('X', x), ('Y', y)], "");
        self.go("G1", &[('Z', z)], "F800");
    }

    fn end(mut self) -> String {
        self.text += "G0 Z60\nM30\n";
        self.text
    }
}

/// Rows along X, ends joined by steps along Y, on three levels.
fn facing() -> String {
    let mut post = Post::new();
    for level in 0..3 {
        post.down(5.0, 5.0, 52.0 - f64::from(level));
        for row in 0..40 {
            let y = 5.0 + 2.5 * f64::from(row);
            let ends = if row % 2 == 0 {
                [5.0, 145.0]
            } else {
                [145.0, 5.0]
            };
            post.to(ends[0], y);
            post.to(ends[1], y);
        }
    }
    post.end()
}

/// Rows joined by half circles.
fn facing_with_half_circles() -> String {
    let mut post = Post::new();
    post.down(15.0, 10.0, 50.0);
    for row in 0..24 {
        let (y, forth) = (10.0 + 5.0 * f64::from(row), row % 2 == 0);
        let x = if forth { 140.0 } else { 15.0 };
        post.to(x, y);
        let motion = if forth { "G3" } else { "G2" };
        post.arc(motion, [x, y + 5.0], [0.0, 2.5]);
    }
    post.end()
}

/// A slot in loops, each in chords of a few tenths of a millimetre, as adaptive clearing is posted without arcs.
fn adaptive_in_chords() -> String {
    let mut post = Post::new();
    post.down(20.0, 40.0, 45.0);
    for k in 0..40 * 48 {
        let turns = f64::from(k) / 48.0;
        let (s, c) = libm::sincos(TAU * turns);
        post.to(20.0 + 2.5 * turns + 8.0 * c, 40.0 + 8.0 * s);
    }
    post.end()
}

/// An adaptive path in arcs: a half circle that cuts, and a way back of two arcs and a line.
fn adaptive_in_arcs() -> String {
    let mut post = Post::new();
    post.down(20.0, 32.0, 45.0);
    for k in 0..40 {
        let x = 20.0 + 2.5 * f64::from(k);
        post.arc("G3", [x, 48.0], [0.0, 8.0]);
        post.arc("G3", [x - 3.0, 45.0], [0.0, -3.0]);
        post.to(x - 3.0, 35.0);
        post.arc("G3", [x, 32.0], [3.0, 0.0]);
        post.to(x + 2.5, 32.0);
    }
    post.end()
}

/// A plate's outline with rounded corners and two lead-ins, on six levels.
fn contour_with_arcs() -> String {
    let mut post = Post::new();
    for level in 0..6 {
        let z = 50.0 - 2.0 * f64::from(level);
        post.down(60.0, 5.0, z);
        post.arc("G2", [65.0, 10.0], [5.0, 0.0]);
        for x in [90.0, 120.0] {
            // Notches.
            post.to(x, 10.0);
            post.to(x + 4.0, 16.0);
            post.to(x + 10.0, 16.0);
            post.to(x + 14.0, 10.0);
        }
        post.to(140.0, 10.0);
        post.arc("G3", [145.0, 15.0], [0.0, 5.0]);
        post.to(145.0, 90.0);
        post.arc("G3", [140.0, 95.0], [-5.0, 0.0]);
        post.to(20.0, 95.0);
        post.arc("G3", [15.0, 90.0], [0.0, -5.0]);
        post.to(15.0, 15.0);
        post.arc("G3", [20.0, 10.0], [5.0, 0.0]);
        post.to(65.0, 10.0);
    }
    post.end()
}

/// A closed curve of a spline's chords, on four levels.
fn contour_in_chords() -> String {
    let mut post = Post::new();
    for level in 0..4 {
        post.down(125.0, 60.0, 50.0 - 3.0 * f64::from(level));
        for k in 1..=300 {
            let (s, c) = libm::sincos(TAU * f64::from(k) / 300.0);
            let r = 40.0 + 8.0 * libm::sin(5.0 * TAU * f64::from(k) / 300.0);
            post.to(77.0 + r * c + 8.0 * f64::from(k == 300), 60.0 + r * s);
        }
    }
    post.end()
}

/// A pocket from its middle outwards, in one spiral of chords.
fn spiral_pocket() -> String {
    let mut post = Post::new();
    post.down(70.0, 60.0, 46.0);
    for k in 0..14 * 72 {
        let turns = f64::from(k) / 72.0;
        let (s, c) = libm::sincos(TAU * turns);
        post.to(70.0 + 3.0 * turns * c, 60.0 + 3.0 * turns * s);
    }
    post.end()
}

/// A grid of holes in a plate, centred and then pecked, row by row in turn.
fn drilling() -> String {
    let mut text = BEGIN.to_owned();
    for cycle in ["G98 G82 Z48 R55 P0.2 F200", "G98 G83 Z38 R55 Q4 F150"] {
        for row in 0..10 {
            for column in 0..12 {
                let column = if row % 2 == 0 { column } else { 11 - column };
                let (x, y) = (10 + 11 * column, 10 + 10 * row);
                match (row, column) {
                    (0, 0) => writeln!(text, "{cycle} X{x} Y{y}"),
                    _ => writeln!(text, "X{x} Y{y}"),
                }
                .unwrap();
            }
        }
        text += "G80\n";
    }
    text + "G0 Z60\nM30\n"
}

/// Bores by helices of full turns.
fn helical_bores() -> String {
    let mut post = Post::new();
    for hole in 0..8 {
        let x = 20.0 + 15.0 * f64::from(hole);
        post.down(x + 5.0, 50.0, 50.0);
        for turn in 1..=6 {
            let z = 50.0 - 1.5 * f64::from(turn);
            let to = [('X', x + 5.0), ('Y', 50.0), ('Z', z)];
            post.go("G3", &to, "I-5.000 J0.000");
        }
        post.to(x, 50.0);
    }
    post.end()
}

/// A surface in rows of chords, there and back.
fn surface_raster() -> String {
    let mut post = Post::new();
    post.down(10.0, 10.0, 50.0);
    for row in 0..40 {
        let y = 10.0 + f64::from(row);
        for k in 0..=90 {
            let k = if row % 2 == 0 { k } else { 90 - k };
            let x = 10.0 + 1.4 * f64::from(k);
            let z = 45.0 + 4.0 * libm::sin(x / 17.0) * libm::cos(y / 11.0);
            post.go("G1", &[('X', x), ('Y', y), ('Z', z)], "");
        }
    }
    post.end()
}

/// Levels around a dome, in chords.
fn waterlines() -> String {
    let mut post = Post::new();
    for level in 0..20 {
        let r = 15.0 + 2.0 * f64::from(level);
        let z = 52.0 - 0.02 * r * r / 2.0;
        post.down(75.0 + r, 70.0, z);
        let chords = 60 + 4 * level;
        for k in 1..=chords {
            let (s, c) = libm::sincos(TAU * f64::from(k) / f64::from(chords));
            post.to(75.0 + r * c, 70.0 + 0.8 * r * s);
        }
    }
    post.end()
}

/// Letters of short strokes.
fn engraving() -> String {
    let mut post = Post::new();
    for letter in 0..40 {
        let (x, y) = (
            10.0 + 12.0 * f64::from(letter % 10),
            20.0 + 20.0 * f64::from(letter / 10),
        );
        post.down(x, y, 52.7);
        for (u, v) in [
            (0.0, 10.0),
            (4.0, 10.0),
            (6.0, 8.5),
            (6.0, 6.5),
            (4.0, 5.0),
            (0.0, 5.0),
        ] {
            post.to(x + u, y + v);
        }
        post.to(x + 6.0, y);
        post.down(x + 7.0, y, 52.7);
        for k in 0..=12 {
            // A stroke with a bow.
            let (s, c) = libm::sincos(TAU * (0.5 - f64::from(k) / 24.0));
            post.to(x + 8.5 + 1.5 * c, y + 5.0 + 4.0 * s);
        }
    }
    post.end()
}

/// Flow lines on a turned blank under tool-centre-point control.
fn five_axes() -> String {
    let mut post = Post {
        text: "G21 G90 G17 G94\nM428\nG0 X0 Y0 Z60 A0 C0\n".to_owned(),
        ..Post::default()
    };
    for row in 0..20 {
        for k in 0..=80 {
            let k = if row % 2 == 0 { k } else { 80 - k };
            let u = f64::from(k) / 80.0;
            let (x, y) = (60.0 * (u - 0.5), 2.0 * f64::from(row) - 20.0);
            let z = 10.0 + 6.0 * libm::sin(TAU * u);
            let (a, c) = (-20.0 - 15.0 * libm::cos(TAU * u), 30.0 * (u - 0.5));
            let axes = [('X', x), ('Y', y), ('Z', z), ('A', a), ('C', c)];
            let feed = if (row, k) == (0, 0) { "F900" } else { "" };
            post.go("G1", &axes, feed);
        }
    }
    post.text += "M429\nM30\n";
    post.text
}

/// A machine's compensation, with backlash and without.
fn compensations(folder: &Folder, machine: &str, errors: &str) -> [String; 2] {
    let machine = example(machine);
    let errors = std::fs::read_to_string(example(errors)).unwrap();
    let lines = errors.lines().filter(|line| !line.contains("b = "));
    let without: String = lines.map(|line| format!("{line}\n")).collect();
    let with = without.replacen("[parameters]", &format!("[parameters]\n{BACKLASH}"), 1);
    [without, with].map(|text| {
        let (errors, blob) = (folder.file("errors.toml", &text), folder.at("made.trax"));
        let options = ["--random", "200"];
        answer(
            0,
            &[&["compile", &machine, &errors, "-o", &blob], &options[..]].concat(),
        );
        let name = if text.contains("EXXb") {
            "backlash.trax"
        } else {
            "without.trax"
        };
        std::fs::rename(&blob, folder.at(name)).unwrap();
        folder.at(name)
    })
}

/// Lines after, for one line before, of a corrected program that its check accepts.
fn growth(folder: &Folder, program: &str, blob: &str, tolerance: &str, more: &[&str]) -> f64 {
    let (part, out) = (folder.file("part.ngc", program), folder.at("out.ngc"));
    let fixed = [
        "gcode",
        &part,
        "-o",
        &out,
        "--compensation",
        blob,
        "--check",
    ];
    answer(0, &[&fixed[..], &["--tolerance", tolerance], more].concat());
    let lines = |path: &str| std::fs::read_to_string(path).unwrap().lines().count() as f64;
    // One line more is the comment that says where it comes from.
    (lines(&out) - 1.0) / lines(&part)
}

#[test]
fn the_manual_says_how_many_lines_backlash_adds() {
    let folder = Folder::new();
    let three = compensations(&folder, "mill-21/machine.toml", "mill-21/errors-21.toml");
    let other = Folder::new();
    let trunnion = "linuxcnc-xyzac-trt/machine.toml";
    let five = compensations(&other, trunnion, "linuxcnc-xyzac-trt/errors-11.toml");
    let setup = folder.file("setup.toml", SETUP);
    let start = "units = \"mm\"\n[start]\nX = 200\nY = 150\nZ = -120\nA = 0\nC = 0\n[offset.G54]\nX = 200\nY = 150\nZ = -180\n";
    let turned = folder.file("five.toml", start);
    let machine = example(trunnion);
    let programs = [
        ("facing", facing()),
        ("facing, half circles", facing_with_half_circles()),
        ("adaptive, chords", adaptive_in_chords()),
        ("adaptive, arcs", adaptive_in_arcs()),
        ("contour, arcs", contour_with_arcs()),
        ("contour, chords", contour_in_chords()),
        ("spiral pocket", spiral_pocket()),
        ("drilling", drilling()),
        ("helical bores", helical_bores()),
        ("3-D raster", surface_raster()),
        ("waterlines", waterlines()),
        ("engraving", engraving()),
        ("five axes, TCP", five_axes()),
    ];
    let mut table = String::new();
    for tolerance in ["1", "5"] {
        for (backlash, name) in ["without", "30 and 60 µm"].into_iter().enumerate() {
            let mut all: Vec<(f64, &str)> = Vec::new();
            for (kind, program) in &programs {
                let grown = match *kind == "five axes, TCP" {
                    true => {
                        let more = ["--setup", &turned, "--machine", &machine];
                        growth(&folder, program, &five[backlash], tolerance, &more)
                    }
                    false => growth(
                        &folder,
                        program,
                        &three[backlash],
                        tolerance,
                        &["--setup", &setup],
                    ),
                };
                all.push((grown, kind));
            }
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let median = all[all.len() / 2].0;
            assert!(median <= 1.15, "{all:?}");
            let [(least, _), .., (most, kind)] = all[..] else {
                panic!("{all:?}");
            };
            writeln!(
                table,
                "| {tolerance} µm | {name} | {median:.2} | {least:.2} to {most:.2} ({kind}) |"
            )
            .unwrap();
        }
    }
    let manual = include_str!("../../../../../docs/src/gcode.md");
    assert!(manual.contains(&table), "the manual should have\n{table}");
}

/// Where Y really is: it follows what is written but for its lost motion.
fn follow(actual: &mut f64, written: f64, lost: f64) {
    *actual = actual.clamp(written - 0.5 * lost, written + 0.5 * lost);
}

#[test]
fn an_axis_that_the_program_holds_still_takes_its_lost_motion_up_where_its_correction_goes_back() {
    let folder = Folder::new();
    let [machine, error] = [example("mill-21/machine.toml"), folder.at("errors.toml")];
    // Along X, Y is to go 40 µm up and down again, and has a lost motion of 30 µm.
    let bow = "machine = \"Mill with 21 errors\"\n[parameters]\nEYYb = 0.015\n[tabulated.EYX]\nat = [0.0, 250.0, 500.0]\nvalue = [0.0, 0.04, 0.0]\n";
    folder.file("errors.toml", bow);
    let [blob, out] = ["bow.trax", "out.ngc"].map(|name| folder.at(name));
    answer(0, &["compile", &machine, &error, "-o", &blob]);
    let setup = folder.file("setup.toml", SETUP);
    let part = folder.file(
        "part.ngc",
        "G21 G90 G94\nG0 X-90 Y0 Z60\nG0 Y10\nG1 X390 F800\nG1 X-90\nG0 Y20\nM30\n",
    );
    let fixed = ["gcode", &part, "-o", &out, "--compensation", &blob];
    let told = ["--setup", &setup, "--machine", &machine, "--errors", &error];
    let more = ["--check", "--json"];
    let said = answer(0, &[&fixed[..], &told, &more].concat());
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let path = &said["check"]["tool_path"];
    // 0.5 µm of tolerance, 0.1 of the tables, and Y may go back by its reversal threshold of 1 µm before it counts.
    let left = path["after_um"]["max"].as_f64().unwrap();
    assert!(left < 1.6, "{said}");
    let text = std::fs::read_to_string(&out).unwrap();
    let word = |line: &str, letter: char| -> Option<f64> {
        let mut words = line.split_whitespace();
        words.find_map(|word| word.strip_prefix(letter)?.parse().ok())
    };
    let (mut x, mut y, mut actual, mut cuts) = (0.0, 0.0, -1.0, 0);
    for line in text.lines().filter(|line| !line.starts_with('(')) {
        let along = word(line, 'X').is_some_and(|to: f64| (to - x).abs() > 1.0);
        x = word(line, 'X').unwrap_or(x);
        y = word(line, 'Y').unwrap_or(y);
        follow(&mut actual, y, 0.03);
        if (9.0..11.0).contains(&y) && along {
            // G54 begins at X = 100; X carries the workpiece, so the tip is EYX less far on it.
            let tip = actual - 0.04 * (1.0 - (x + 100.0 - 250.0).abs() / 250.0);
            assert!((tip - 10.0).abs() < 1.6e-3, "{line}: {tip}\n{text}");
            cuts += 1;
        }
    }
    assert!(cuts > 2, "{text}");
}
