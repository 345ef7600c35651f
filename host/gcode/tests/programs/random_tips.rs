//! Programs of the tip that nobody wrote, with slow axes, reversals, inverse time and arcs.

use super::random::{Trial, backlash, one, try_five};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::fmt::Write;
use trueaxis_gcode::{Dialect, Options};
use trueaxis_tests::usual_or_all;

/// Why a program may be refused: nobody asked whether the machine gets there.
const REFUSALS: [&str; 4] = [
    "outside its travel",
    "singular",
    "no axis positions",
    "radius does not fit",
];
/// How far each axis goes from the middle of a part of this size (mm, degrees).
fn ways(size: f64) -> [(char, f64); 5] {
    [
        ('X', size),
        ('Y', size),
        ('Z', size),
        ('A', 60.0),
        ('C', 300.0),
    ]
}

/// Some of the axes, somewhere within so many mm of the part's middle.
fn words(random: &mut Pcg64Mcg, size: f64) -> String {
    let mut words = String::new();
    for (axis, most) in ways(size) {
        if random.random_bool(0.5) {
            let _ = write!(words, " {axis}{:.3}", random.random_range(-most..most));
        }
    }
    if words.is_empty() {
        words += " X1";
    }
    words
}

fn program(random: &mut Pcg64Mcg) -> String {
    let size = one(random, &[1.0, 5.0, 40.0]);
    let mut text = "G21 G90 G17\nM428\nG0".to_owned();
    for (axis, most) in ways(size) {
        let _ = write!(text, " {axis}{:.3}", random.random_range(-most..most));
    }
    text += one(random, &["\nG1 X0 F300\n", "\nF300\n"]);
    for _ in 0..random.random_range(1..6) {
        let words = words(random, size);
        let _ = match random.random_range(0..20) {
            0..3 => writeln!(text, "G0{words}"),
            3..6 => {
                let share = random.random_range(0.5..30.0);
                writeln!(text, "G93\nG1{words} F{share:.2}\nG94\nF300")
            }
            6 | 7 => {
                let [x, y] = [(); 2].map(|()| random.random_range(-size..size));
                let c = random.random_range(-30.0..30.0);
                let r = 3.0 * size;
                writeln!(text, "G1 A0 C{c:.3}\nG2 X{x:.3} Y{y:.3} R{r}")
            }
            _ => writeln!(text, "G1{words}"),
        };
    }
    text + "M429\nM30\n"
}

#[test]
fn random_programs_of_the_tip_are_corrected_within_the_tolerance_and_keep_their_times() {
    let count = usual_or_all(200, 1000);
    let tried = try_five(count, &REFUSALS, |random| {
        let options = Options {
            tolerance: one(random, &[0.5e-3, 0.5e-3, 2e-3]),
            decimals: one(random, &[None, None, Some(4)]),
            backlash: backlash(random),
            ..Options::default()
        };
        Trial {
            text: program(random),
            dialect: Dialect::LinuxCnc,
            options,
        }
    });
    assert_eq!(tried, [count, 0]);
}
