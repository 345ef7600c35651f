//! Draws a machine file.

use crate::class::Class;
use std::fmt::Write;
use trueaxis_tests::Fixed;

/// Pairs of rotary axes.
const PAIRS: [[char; 2]; 3] = [['A', 'C'], ['B', 'C'], ['A', 'B']];

fn is_true(random: &mut Fixed) -> bool {
    random.bits() & 1 == 0
}

/// A machine of a class, as people build them: linear axes next to the foundation, rotary axes at the ends.
#[must_use]
pub fn draw(class: Class, number: usize, random: &mut Fixed) -> String {
    let mut linear = vec!['X', 'Y', 'Z'];
    for i in (1..linear.len()).rev() {
        linear.swap(i, random.below(i + 1));
    }
    let mut rotary = match class {
        Class::ThreeAxis | Class::Thermal => Vec::new(),
        Class::TwoRotary | Class::Tilted | Class::Rich => PAIRS[random.below(3)].to_vec(),
        Class::SixAxes if is_true(random) => {
            linear.push('W');
            PAIRS[random.below(2)].to_vec()
        }
        Class::SixAxes => vec!['A', 'B', 'C'],
    };
    if is_true(random) {
        rotary.reverse();
    }
    let narrow = rotary.len() == 3;
    let tilted = (class == Class::Tilted).then(|| random.below(2));
    let mut text = format!("name = \"machine {number}\"\n");
    for letter in linear {
        let half = match letter {
            'W' => random.within(50.0, 100.0),
            _ => random.within(200.0, 500.0),
        };
        // A quill is next to the spindle.
        let branch = branch(letter == 'W' || is_true(random));
        let reversed = is_true(random);
        axis(&mut text, letter, branch, half, reversed, "");
    }
    for (k, letter) in rotary.into_iter().enumerate() {
        rotary_axis(&mut text, letter, narrow, tilted == Some(k), random);
    }
    let tip = -random.within(100.0, 250.0).round();
    let _ = write!(
        text,
        "\n[spindle]\naxis = \"z\"\n\n[tool]\ntip_mm = [0.0, 0.0, {tip:?}]\n"
    );
    text
}

/// Writes a rotary axis; with three of them, or tilted about an axis that is not its own.
fn rotary_axis(text: &mut String, letter: char, narrow: bool, is_tilted: bool, random: &mut Fixed) {
    let half = match (letter, narrow) {
        // Three are independent only on part of a turn.
        (_, true) => random.within(20.0, 40.0),
        ('C', false) => 180.0,
        (_, false) => random.within(30.0, 110.0),
    };
    let origin: [f64; 3] = std::array::from_fn(|_| random.within(-80.0, 80.0).round());
    let mut rest = format!("origin_mm = {origin:?}\n");
    if is_tilted {
        let tilt = random.within(20.0, 50.0).round();
        let tilt = if is_true(random) { tilt } else { -tilt };
        let turned = match letter {
            'A' => [0.0, 0.0, tilt],
            'B' => [tilt, 0.0, 0.0],
            _ => [0.0, tilt, 0.0],
        };
        let _ = writeln!(rest, "orientation_deg = {turned:?}");
    }
    let branch = branch(is_true(random));
    let reversed = is_true(random);
    axis(text, letter, branch, half.round(), reversed, &rest);
}

fn branch(is_tool: bool) -> &'static str {
    if is_tool { "tool" } else { "workpiece" }
}

fn axis(text: &mut String, letter: char, branch: &str, half: f64, reversed: bool, rest: &str) {
    let half = half.round();
    let _ = write!(
        text,
        "\n[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [{:?}, {half:?}]\nreversed = {reversed}\n{rest}",
        -half
    );
}
