//! How an axis makes up its backlash, and what is left of a circle meanwhile.

use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use trueaxis::{AUXILIARIES, AuxiliaryKind, Axis, Direction, Travel};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::validate::{Command, Runtime};

/// Number of positions along the travel at which the step is taken.
const POSITIONS: u16 = 256;
/// Radius (mm) of the circle of [`Reversal::beside_circles`].
pub const RADIUS: f64 = 30.0;
/// Feeds (mm/min).
pub const FEEDS: [f64; 3] = [600.0, 1800.0, 6000.0];
/// Bisections to find a time: far below a servo period.
const BISECTIONS: usize = 60;

/// A reversal of an axis whose correction depends on its direction of travel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reversal {
    /// Letter of the axis.
    pub axis: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// The largest step of its correction (mm, deg).
    pub step: f64,
    /// How far the command comes back before the axis counts as reversed (mm, deg).
    pub reversal_threshold: f64,
    /// Rate at which the step is made up (mm/s, deg/s).
    pub rate: f64,
    /// Acceleration (mm/s², deg/s²).
    pub acceleration: f64,
}

/// The reversals of a compensation, one for each axis with backlash of its own; the other axes are in the middle of their
/// travels, auxiliaries at their references.
#[must_use]
pub fn reversals(runtime: &Runtime<'_>) -> Vec<Reversal> {
    let compensation = runtime.compensation();
    let axes = compensation.axes().iter().enumerate();
    let depends = |index: usize| {
        let mut banks = compensation.banks().iter();
        banks.any(|bank| usize::from(bank.input) == index && bank.direction != Direction::Both)
    };
    let found = axes
        .filter(|(index, _)| depends(*index))
        .map(|(index, axis)| {
            let letter = char::from(axis.name);
            let rate = axis.rate_bound.max(axis.reversal_rate);
            Reversal {
                axis: letter,
                unit: if "ABC".contains(letter) { "deg" } else { "mm" },
                step: step(runtime, index),
                reversal_threshold: f64::from(axis.reversal_threshold),
                rate: f64::from(rate),
                acceleration: f64::from(axis.reversal_acceleration),
            }
        });
    found.filter(|reversal| reversal.step > 0.0).collect()
}

/// The largest step of the correction of an axis when it reverses.
fn step(runtime: &Runtime<'_>, index: usize) -> f64 {
    let compensation = runtime.compensation();
    let along = |axis: &Axis, part: f32| {
        let [low, high] = match axis.period {
            period if period > 0.0 => [0.0, period],
            _ => axis.travel,
        };
        low + part * (high - low)
    };
    let axes = compensation.axes();
    let mut command = Command {
        axes: [0.0; MAX_AXES],
        travel: [Travel::Positive; MAX_AXES],
        auxiliaries: [0.0; AUXILIARIES],
    };
    for (place, axis) in command.axes.iter_mut().zip(axes) {
        *place = along(axis, 0.5);
    }
    for (value, auxiliary) in command
        .auxiliaries
        .iter_mut()
        .zip(compensation.auxiliaries())
    {
        if auxiliary.kind == AuxiliaryKind::ToolLength {
            *value = auxiliary.reference;
        }
    }
    let steps = (0..=POSITIONS).map(|n| {
        command.axes[index] = along(&axes[index], f32::from(n) / f32::from(POSITIONS));
        let [up, down] = [Travel::Positive, Travel::Negative].map(|travel| {
            command.travel[index] = travel;
            runtime.evaluate(&command)[index]
        });
        f64::from((up - down).abs())
    });
    steps.fold(0.0, f64::max)
}

impl Reversal {
    /// Time (s) in which it is made up, from when the axis counts as reversed.
    #[must_use]
    pub fn time(&self) -> f64 {
        let peak = self.peak();
        self.step / peak + peak / self.acceleration
    }

    /// The highest speed that is reached meanwhile (mm/s, deg/s).
    #[must_use]
    pub fn peak(&self) -> f64 {
        libm::sqrt(self.step * self.acceleration).min(self.rate)
    }

    /// Largest distance (mm) of a linear axis from a circle of this radius (mm) at this speed (mm/s), if its error is play:
    /// the carriage rests while the command turns round, until the drive has gone through the play.
    #[must_use]
    pub(crate) fn beside_circle(&self, radius: f64, speed: f64) -> f64 {
        let curve = speed * speed / radius;
        let command = |t: f64| 0.5 * curve * t * t;
        let begin = libm::sqrt(2.0 * self.reversal_threshold / curve);
        let [mut before, mut after] = [0.0, begin + self.time()];
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (before + after);
            match command(middle) + self.made_up(middle - begin) < self.step {
                true => before = middle,
                false => after = middle,
            }
        }
        command(after).min(self.step)
    }

    /// Like `beside_circle` (mm) for a radius of [`RADIUS`] and each of [`FEEDS`].
    #[must_use]
    pub fn beside_circles(&self) -> [f64; 3] {
        FEEDS.map(|feed| self.beside_circle(RADIUS, feed / 60.0))
    }

    /// How much is made up after this time (s).
    fn made_up(&self, time: f64) -> f64 {
        let (peak, end) = (self.peak(), self.time());
        let rise = peak / self.acceleration;
        let speeds_up = |t: f64| 0.5 * self.acceleration * t * t;
        match time {
            t if t <= 0.0 => 0.0,
            t if t < rise => speeds_up(t),
            t if t < end - rise => peak * (t - 0.5 * rise),
            t if t < end => self.step - speeds_up(end - t),
            _ => self.step,
        }
    }
}

impl Display for Reversal {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            axis, unit, step, ..
        } = self;
        let time = self.time() * 1e3;
        write!(f, "{axis} reverses by {step:.5} {unit} in {time:.0} ms")?;
        if *unit != "mm" {
            return Ok(());
        }
        let at = FEEDS.iter().zip(self.beside_circles());
        let at: Vec<String> = at
            .map(|(feed, mm)| format!("{:.1} µm at F{feed}", mm * 1e3))
            .collect();
        write!(f, ": beside a circle of R{RADIUS} mm {}", at.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 30 µm with 500 mm/s², from the first back motion on.
    const PLAIN: Reversal = Reversal {
        axis: 'X',
        unit: "mm",
        step: 0.03,
        reversal_threshold: 0.0,
        rate: 50.0,
        acceleration: 500.0,
    };

    #[test]
    fn half_of_the_way_is_spent_speeding_up() {
        // s = a (t/2)²
        assert!((PLAIN.time() - 2.0 * (0.03_f64 / 500.0).sqrt()).abs() < 1e-12);
        assert!((PLAIN.made_up(PLAIN.time() / 2.0) - 0.015).abs() < 1e-12);
        // At 1 mm/s: 2 ms to speed up and to slow down, 28 ms of steady motion.
        let slow = Reversal { rate: 1.0, ..PLAIN };
        assert!((slow.time() - 0.032).abs() < 1e-12);
        assert!((slow.made_up(0.012) - 0.011).abs() < 1e-12);
    }

    /// Without any correction the carriage is the whole play beside the circle.
    #[test]
    fn what_is_left_beside_a_circle_is_where_the_command_has_turned_to() {
        let speed = 30.0;
        let curve = speed * speed / RADIUS;
        // A correction as fast as a step leaves the reversal threshold.
        let step = Reversal {
            reversal_threshold: 0.001,
            rate: 1e6,
            acceleration: 1e9,
            ..PLAIN
        };
        assert!((step.beside_circle(RADIUS, speed) - 0.001).abs() < 2e-5);
        let never = Reversal {
            rate: 1e-6,
            ..PLAIN
        };
        assert!((never.beside_circle(RADIUS, speed) - 0.03).abs() < 1e-5);
        // Both motions together use up the play.
        let left = PLAIN.beside_circle(RADIUS, speed);
        let time = (2.0 * left / curve).sqrt();
        assert!((left + PLAIN.made_up(time) - 0.03).abs() < 1e-9);
        assert!((1e-3..0.004).contains(&left), "{left}");
    }
}
