//! Draws a machine file.

use crate::Fixed;
use std::fmt::Write;

/// Three to six axes in any order in either branch. A quill (W, U) repeats a direction.
const LETTERS: [&str; 16] = [
    "XYZ", "XYZW", "XYZA", "XYZB", "XYZC", "XYZAC", "XYZBC", "XYZAB", "XYZAC", "XYZBC", "XYZABC",
    "XYZABC", "XYZABC", "XYZUC", "XYZWBC", "XYZWAC",
];

/// Half the width of a narrow rotary travel (deg).
const NARROW: [f64; 4] = [3.0, 10.0, 30.0, 45.0];

pub fn draw(random: &mut Fixed) -> String {
    let letters = LETTERS[random.below(LETTERS.len())];
    let tilted = random.chance(0.4);
    // Half of the machines have narrow rotary axes: tilting heads, swivelling tables. Three of them are independent
    // only on part of a turn.
    let narrow = random.chance(if letters.ends_with("ABC") { 0.95 } else { 0.5 });
    let rotary: Vec<char> = letters.chars().filter(|l| "ABC".contains(*l)).collect();
    // Usually a round table; the last letter is C if there is one.
    let endless = rotary.last().filter(|_| random.chance(0.3)).copied();
    let mut order: Vec<char> = letters.chars().collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let mut text = String::from("name = \"any\"\n");
    for letter in order {
        text += &axis(random, letter, endless == Some(letter), narrow, tilted);
    }
    text += "[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -120.0]\n";
    if random.chance(0.3) {
        text += "length_range_mm = [70.0, 190.0]\n";
    }
    text
}

fn axis(random: &mut Fixed, letter: char, endless: bool, narrow: bool, tilted: bool) -> String {
    let rotary = "ABC".contains(letter);
    let half = match rotary {
        false => random.within(50.0, 500.0),
        true if narrow => NARROW[random.below(NARROW.len())],
        true => random.within(15.0, 180.0),
    };
    // Around 0, or to one side of it.
    let middle = match random.chance(0.3) {
        true => random.within(-half, half),
        false => 0.0,
    };
    let range = match (endless, random.chance(0.5)) {
        (false, _) => [middle - half, middle + half],
        (true, false) => [-180.0, 180.0],
        (true, true) => [0.0, 360.0],
    };
    let branch = match random.chance(0.5) {
        true => "tool",
        false => "workpiece",
    };
    let (origin, tilt) = (random.three(100.0), random.three(50.0));
    let tilt = if tilted && rotary { tilt } else { [0.0; 3] };
    let reversed = random.chance(0.5);
    let mut text = format!(
        "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = {range:?}\n\
         reversed = {reversed}\norigin_mm = {origin:?}\norientation_deg = {tilt:?}\n"
    );
    if endless {
        let _ = writeln!(text, "modulo = true");
    }
    text
}
