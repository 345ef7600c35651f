//! Series of cycles that nobody wrote, with R and the level before them nearer to each other than corrections differ.

use super::random::{Trial, backlash, one, try_five};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::fmt::Write;
use trueaxis_gcode::{Dialect, Options};

/// Why a hole may be refused: what moves with the spindle cannot be written out, and R may come to lie below
/// the bottom.
const REFUSALS: [&str; 3] = [
    "cannot be written out",
    "less than half a micrometre",
    "depth is above R",
];
/// A word within so much of 0.
fn word(random: &mut Pcg64Mcg, letter: char, most: f64) -> String {
    format!("{letter}{:.3}", random.random_range(-most..most))
}

fn place(random: &mut Pcg64Mcg) -> String {
    let (x, y) = (word(random, 'X', 100.0), word(random, 'Y', 60.0));
    match random.random_range(0..4) {
        0 => x,
        1 => y,
        _ => format!("{x} {y}"),
    }
}

fn angles(random: &mut Pcg64Mcg) -> String {
    format!("{} {}", word(random, 'A', 40.0), word(random, 'C', 200.0))
}

/// Some series, one behind the other.
fn program(random: &mut Pcg64Mcg, dialect: Dialect) -> String {
    let mut text = "G21 G90 G17 G54 G94\nM3 S100\nF100\n".to_owned();
    let level = one(random, &[3.0, 3.0, 10.0]);
    let _ = write!(
        text,
        "G0 {} {}",
        word(random, 'X', 100.0),
        word(random, 'Y', 60.0)
    );
    let _ = write!(text, " Z{level:.1}");
    if random.random_bool(0.5) {
        let _ = write!(text, " {}", angles(random));
    }
    text.push('\n');
    for _ in 0..random.random_range(1..4) {
        let _ = writeln!(text, "{}", one(random, &["G98", "G99"]));
        series(random, dialect, level, &mut text);
        match random.random_range(0..10) {
            0..3 => {
                let _ = writeln!(text, "G80\nG0 {}", angles(random));
            }
            3 => {
                let to = level + one(random, &[0.0, 0.0004, 5.0]);
                let _ = writeln!(text, "G80\nG0 Z{to:.4}");
            }
            4 => text += "G1 X3. Y5. Z2. F200\n",
            5 | 6 => text += "G80\n",
            _ => {}
        }
    }
    text += one(random, &["G80\n", "", "G80\nG0 X0. Y0. Z20.\n"]);
    text + "M30\n"
}

/// A cycle, and the holes behind it.
fn series(random: &mut Pcg64Mcg, dialect: Dialect, level: f64, text: &mut String) {
    let cycle = one(
        random,
        &["G81", "G82", "G83", "G73", "G84", "G85", "G86", "G89"],
    );
    let above = [
        0.0, 0.0, -0.001, -0.0003, 0.0004, 0.002, -1.0, -0.05, 0.01, -0.2,
    ];
    let r = level + one(random, &above);
    // Shallow ones too, of which a correction is more than 1 %.
    let deepest = one(random, &[9.0, 9.0, 1.0, 0.3]);
    let depth = random.random_range(0.02..deepest);
    let _ = write!(
        text,
        "{cycle} {} {} Z{:.3} R{r:.4}",
        word(random, 'X', 100.0),
        word(random, 'Y', 60.0),
        r - depth
    );
    if matches!(cycle, "G83" | "G73") || cycle == "G84" && dialect == Dialect::Fanuc {
        let _ = write!(text, " Q{:.3}", random.random_range(0.3..3.0));
    }
    if matches!(cycle, "G82" | "G86" | "G89") {
        let milliseconds = dialect == Dialect::Fanuc;
        *text += if milliseconds { " P100" } else { " P0.1" };
    }
    text.push('\n');
    for _ in 0..random.random_range(0..5) {
        *text += &place(random);
        match random.random_range(0..10) {
            0 => {
                let r = level + one(random, &[0.0, 0.001, -0.3]);
                let _ = write!(text, " R{r:.4}");
            }
            1 => {
                let _ = write!(text, " Z{:.3}", random.random_range(-9.0..level - 1.5));
            }
            _ => {}
        }
        text.push('\n');
    }
}

#[test]
fn random_series_of_cycles_near_their_level_are_corrected_and_keep_their_times() {
    let tried = try_five(1000, &REFUSALS, |random| {
        let dialects = [Dialect::LinuxCnc, Dialect::LinuxCnc, Dialect::Fanuc];
        let dialect = one(random, &dialects);
        let options = Options {
            tolerance: one(random, &[0.5e-3, 0.5e-3, 2e-3, 20e-3]),
            hole_tolerance: one(random, &[5e-3, 5e-3, 0.5e-3]),
            decimals: one(random, &[None, None, Some(3)]),
            backlash: backlash(random),
            ..Options::default()
        };
        let text = program(random, dialect);
        Trial {
            text,
            dialect,
            options,
        }
    });
    // Holes that are tapped, for the most part.
    assert_eq!(tried, [959, 41]);
}
