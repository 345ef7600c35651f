//! Machines nobody drew, with errors nobody measured: what the scheme `exact` is tried on.
//!
//! Drawn wider than users go: three rotary axes, quills, six axes, tilted frames, rotary travels
//! down to ±3°, error motions of degree 3 in every direction on every axis.

use crate::Fixed;
use std::fmt::Write;
use trueaxis_host::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_host::machine::Machine;

/// A machine that can be corrected, with its errors.
#[derive(Clone, Debug)]
pub struct Case {
    /// Number of the drawing.
    pub seed: u64,
    /// The machine file it was read from.
    pub text: String,
    /// The machine.
    pub machine: Machine,
    /// Its errors.
    pub errors: ErrorModel,
}

/// The first `count` drawings that make a machine that can be corrected: those with parallel or
/// dependent axes are refused when they are read.
#[must_use]
pub fn cases(count: usize) -> Vec<Case> {
    (0..).filter_map(case).take(count).collect()
}

/// One drawing; `None` if the machine is refused.
#[must_use]
pub fn case(seed: u64) -> Option<Case> {
    let mut random = Fixed::new(seed + 1);
    // Seeds that differ little begin alike.
    (0..16).for_each(|_| drop(random.bits()));
    let text = machine(&mut random);
    let machine = Machine::from_toml(&text).ok()?;
    let errors = errors(&machine, &mut random);
    Some(Case {
        seed,
        text,
        machine,
        errors,
    })
}

impl Fixed {
    fn below(&mut self, n: usize) -> usize {
        (u64::from(self.bits()) * n as u64 >> 32) as usize
    }

    fn chance(&mut self, p: f64) -> bool {
        self.within(0.0, 1.0) < p
    }
}

/// Three to six axes in any order in either branch. A quill (W, U) repeats a direction.
const LETTERS: [&str; 16] = [
    "XYZ", "XYZW", "XYZA", "XYZB", "XYZC", "XYZAC", "XYZBC", "XYZAB", "XYZAC", "XYZBC", "XYZABC",
    "XYZABC", "XYZABC", "XYZUC", "XYZWBC", "XYZWAC",
];

fn machine(random: &mut Fixed) -> String {
    let letters = LETTERS[random.below(LETTERS.len())];
    let tilted = random.chance(0.4);
    // Half of the machines have narrow rotary axes: tilting heads, swivelling tables.
    // Three of them are independent on a part of a turn only.
    let three_rotary = letters.ends_with("ABC");
    let narrow = random.chance(if three_rotary { 0.95 } else { 0.5 });
    let mut order: Vec<char> = letters.chars().collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let mut text = String::from("name = \"any\"\n");
    for letter in order {
        let rotary = "ABC".contains(letter);
        let half = match rotary {
            false => random.within(50.0, 500.0),
            true if narrow => [3.0, 10.0, 30.0, 45.0][random.below(4)],
            true => random.within(15.0, 180.0),
        };
        // Around 0, or to one side of it.
        let middle = if random.chance(0.3) {
            random.within(-half, half)
        } else {
            0.0
        };
        let branch = if random.chance(0.5) {
            "tool"
        } else {
            "workpiece"
        };
        let mut three =
            |size: f64| -> [f64; 3] { std::array::from_fn(|_| random.within(-size, size)) };
        let (origin, tilt) = (three(100.0), three(50.0));
        let tilt = if tilted && rotary { tilt } else { [0.0; 3] };
        let reversed = random.chance(0.5);
        let _ = write!(
            text,
            "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [{:?}, {:?}]\n\
             reversed = {reversed}\norigin_mm = {origin:?}\norientation_deg = {tilt:?}\n",
            middle - half,
            middle + half
        );
    }
    text += "[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -120.0]\n";
    if random.chance(0.3) {
        text += "length_range_mm = [70.0, 190.0]\n";
    }
    text
}

/// Size of an error in mm, and in rad.
const SIZE: [f64; 2] = [0.03, 8e-5];
/// Highest degree of error motions.
const DEGREE: u8 = 3;

fn errors(machine: &Machine, random: &mut Fixed) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    // From a few locations to every motion of every axis.
    let density = [0.1, 0.3, 0.6, 1.0][random.below(4)];
    let kinds = [
        random.chance(0.8),
        random.chance(0.4),
        random.chance(0.7),
        random.chance(0.6),
        random.chance(0.6),
        random.chance(0.3),
    ];
    let letters = machine.axes.iter().map(|a| a.letter.char());
    for axis in letters.chain(['S']).collect::<Vec<_>>() {
        // The largest position, in mm or rad: a coefficient of degree k has its effect there.
        let reach = machine.index(axis).map(|i| {
            let axis = &machine.axes[i];
            let ends = axis.travel.map(|t| axis.to_kinematic(t).abs());
            ends[0].max(ends[1])
        });
        for component in 0..6 {
            for (number, &wanted) in kinds.iter().enumerate() {
                let (value, taken) = (random.within(-1.0, 1.0), random.chance(density));
                if !wanted || !taken {
                    continue;
                }
                let (kind, scale) = match (number as u8, reach) {
                    (0, _) => (ParameterKind::Inter, 1.0),
                    (_, None) => continue,
                    (k, Some(reach)) if k <= DEGREE + 1 => {
                        let degree = k - 1;
                        (ParameterKind::Degree(degree), reach.powi(i32::from(degree)))
                    }
                    _ => (ParameterKind::Backlash, 5.0),
                };
                let size = SIZE[component / 3] * value / scale;
                let parameter = Parameter {
                    component,
                    axis,
                    kind,
                };
                assert!(errors.set(machine, parameter, size));
            }
        }
    }
    errors
}
