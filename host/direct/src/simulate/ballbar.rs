//! Circular tests (ISO 230-4) with a ball-bar.

use super::runs::OfReadings;
use crate::ballbar::BallBarTurns;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::fmt::Write;
use trueaxis_model::explain::{Bench, BenchState};
use trueaxis_model::machine::{Machine, PerAxis};

/// A circle in the plane of two linear axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedCircle {
    /// The two axes (by index); the angle is measured from the first towards the second.
    pub plane: [usize; 2],
    /// Axis positions at its centre (mm, rad).
    pub centre: PerAxis,
    /// Radius (mm).
    pub radius: f64,
    /// Number of readings per turn.
    pub count: u32,
}

/// Distance (rad) before a position at which its direction of travel is evaluated.
const BEFORE: f64 = 1e-6;

/// A turn in each direction. The tool was set up at the centre, with unknown directions of approach.
#[must_use]
pub fn circle(bench: &Bench<'_>, circle: &SimulatedCircle, disturbed: &OfReadings) -> BallBarTurns {
    let mut random = Pcg64Mcg::seed_from_u64(disturbed.seed);
    let centre = BenchState::at(circle.centre);
    let radial = |angle: f64, way: f64| {
        let mut state = centre;
        let [a, b] = circle.plane;
        state.q[a] += circle.radius * libm::cos(angle);
        state.q[b] += circle.radius * libm::sin(angle);
        let before = angle - way * BEFORE;
        state.sign[a] = (-way * libm::sin(before)).signum();
        state.sign[b] = (way * libm::cos(before)).signum();
        let actual = bench.actual(&state).t - bench.actual(&centre).t;
        let nominal = bench.nominal(&state.q).t - bench.nominal(&centre.q).t;
        actual.norm() - nominal.norm()
    };
    let count = circle.count.max(1);
    let mut read = |way: f64, turn: u32| -> Vec<(f64, f64)> {
        (0..count)
            .map(|step| {
                let step = f64::from(step);
                let angle = std::f64::consts::TAU * step / f64::from(count);
                // Starts at 360° if it turns clockwise.
                let time = match way > 0.0 {
                    true => step,
                    false => f64::from(count) - step,
                } + f64::from(turn * count);
                let reading =
                    radial(angle, way) + disturbed.draw(&mut random, time / f64::from(2 * count));
                (angle, reading)
            })
            .collect()
    };
    BallBarTurns {
        counter_clockwise: read(1.0, 0),
        clockwise: read(-1.0, 1),
    }
}

/// As CSV: angle (deg) and radial deviations (µm) in both directions.
#[must_use]
pub fn write(machine: &Machine, circle: &SimulatedCircle, read: &BallBarTurns) -> String {
    let letter = |i: usize| machine.axes[i].letter;
    let [a, b] = circle.plane.map(letter);
    let centre = machine.to_command(&circle.centre);
    let places = machine.axes.iter().zip(centre);
    let places = places.map(|(axis, at)| format!("{} = {at:?}", axis.letter));
    let places: Vec<String> = places.collect();
    let mut text = format!(
        "# machine = {}\n# plane = \"{a}{b}\"\n# radius_mm = {:?}\n# at = {{ {} }}\n# unit = \"um\"\nangle,ccw,cw\n",
        toml::Value::from(machine.name.as_str()),
        circle.radius,
        places.join(", ")
    );
    let both = read
        .counter_clockwise
        .iter()
        .zip(&read.clockwise)
        .enumerate();
    for (step, ((_, forth), (_, back))) in both {
        let angle = 360.0 * step as f64 / f64::from(circle.count.max(1));
        let angle = (angle * 1e9).round() / 1e9;
        let [forth, back] = [forth, back].map(|mm| (mm * 1e7).round() / 1e4 + 0.0);
        let _ = writeln!(text, "{angle},{forth:.4},{back:.4}");
    }
    text
}
