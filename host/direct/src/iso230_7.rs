//! ISO 230-7: error motions of an axis of rotation, from readings of displacement sensors over whole turns.
//!
//! A reading plotted over the angle around a base circle is the total error motion. Its mean over the turns is the
//! synchronous one, what differs from turn to turn the asynchronous one. With a fixed sensitive direction (a turned
//! bore, a table under a tool that stands still) one sensor counts: r(θ) = x. With a rotating one (a boring bar) two
//! do: r(θ) = x·cos θ + y·sin θ. Radial and tilt error motions are judged from the centre of the least-squares circle,
//! which takes out how far the artefact is off centre or the sensors are from zero; axial error motion from the centre of
//! the plot, because its part of once per turn is one of the spindle.

use crate::iso230_3::Unit;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;
use trueaxis_model::numbers::extremes;

/// Readings at the same angles in every turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Turns {
    /// How far the sensors 2 are from the sensors 1 in +Z (mm); negative if they are in −Z.
    pub apart: Option<f64>,
    /// The sensors in use, in the order of [`SENSORS`](crate::iso230_3::SENSORS).
    pub sensors: [bool; 5],
    /// The angles (rad) from +X towards +Y, ascending.
    pub angles: Vec<f64>,
    /// Turn after turn, at each angle the reading of each sensor (mm), positive towards +X, +Y or +Z.
    pub readings: Vec<Vec<[f64; 5]>>,
}

/// One error motion, with its values in `unit`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorMotion {
    /// `radial`, `tilt` or `axial`, and the sensors.
    pub name: String,
    /// `µm` or `µrad`.
    pub unit: Unit,
    /// Total error motion value: the difference in radius of the two circles that contain all readings.
    pub total: f64,
    /// Synchronous error motion value: the same of the mean of all turns.
    pub synchronous: f64,
    /// Asynchronous error motion value: the largest range of the readings at one angle.
    pub asynchronous: f64,
    /// How far the least-squares circle is off the centre of the plot; `None` for an axial one, which keeps it.
    pub off_centre: Option<f64>,
    /// Mean of all turns at each angle, from the circle.
    #[serde(skip)]
    pub mean: Vec<f64>,
    /// Like `mean`, of each turn.
    #[serde(skip)]
    pub turns: Vec<Vec<f64>>,
}

/// All error motions of turns, as they are written for programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TurnsRecord {
    /// Number of turns.
    pub turns: usize,
    /// Number of angles in each.
    pub angles: usize,
    /// Distance of the second pair of sensors from the first.
    pub sensors_apart_mm: Option<f64>,
    /// The error motions.
    pub error_motions: Vec<ErrorMotion>,
}

/// Value at an angle (rad) from the readings of the sensors.
type SensorValue = Box<dyn Fn(f64, &[f64; 5]) -> f64>;

impl Turns {
    /// Evaluates the turns.
    #[must_use]
    pub fn record(&self) -> TurnsRecord {
        TurnsRecord {
            turns: self.readings.len(),
            angles: self.angles.len(),
            sensors_apart_mm: self.apart,
            error_motions: self.error_motions(),
        }
    }

    /// All error motions that the sensors show.
    #[must_use]
    pub fn error_motions(&self) -> Vec<ErrorMotion> {
        let mut found = Vec::new();
        let mut add = |needs: &[usize], name: &str, unit, value: SensorValue| {
            if needs.iter().all(|k| self.sensors[*k]) {
                found.push(self.motion(name, unit, &value));
            }
        };
        for (number, [x, y]) in [("1", [0, 1]), ("2", [2, 3])] {
            for (letter, k) in [("X", x), ("Y", y)] {
                let name = format!("radial {letter}{number}, fixed");
                add(&[k], &name, Unit::Length, Box::new(move |_, read| read[k]));
            }
            let turned: SensorValue =
                Box::new(move |angle, read| rotating(angle, read[x], read[y]));
            let name = format!("radial {number}, rotating");
            add(&[x, y], &name, Unit::Length, turned);
        }
        if let Some(apart) = self.apart {
            let tilt = move |read: &[f64; 5], k: usize| (read[k + 2] - read[k]) / apart;
            for (letter, k) in [("X", 0), ("Y", 1)] {
                let fixed: SensorValue = Box::new(move |_, read| tilt(read, k));
                let name = format!("tilt {letter}, fixed");
                add(&[k, k + 2], &name, Unit::Angle, fixed);
            }
            let turned: SensorValue =
                Box::new(move |angle, read| rotating(angle, tilt(read, 0), tilt(read, 1)));
            add(&[0, 1, 2, 3], "tilt, rotating", Unit::Angle, turned);
        }
        add(&[4], "axial", Unit::Length, Box::new(|_, read| read[4]));
        found
    }

    fn motion(&self, name: &str, unit: Unit, value: &dyn Fn(f64, &[f64; 5]) -> f64) -> ErrorMotion {
        let is_centred = name != "axial";
        let of_turn = |turn: &Vec<[f64; 5]>| -> Vec<f64> {
            let both = self.angles.iter().zip(turn);
            both.map(|(angle, read)| value(*angle, read)).collect()
        };
        let mut turns: Vec<Vec<f64>> = self.readings.iter().map(of_turn).collect();
        let circle = self.circle(&mean(&turns), is_centred);
        for turn in &mut turns {
            for (value, angle) in turn.iter_mut().zip(&self.angles) {
                *value -= circle.dot(&basis(*angle));
            }
        }
        let mean = mean(&turns);
        let at_angle = |i: usize| turns.iter().map(move |turn| turn[i]);
        let ranges = (0..self.angles.len()).map(|i| range(at_angle(i)));
        let factor = unit.factor();
        let scaled = |values: &Vec<f64>| values.iter().map(|v| v * factor).collect();
        ErrorMotion {
            name: name.to_owned(),
            unit,
            total: range(turns.iter().flatten().copied()) * factor,
            synchronous: range(mean.iter().copied()) * factor,
            asynchronous: ranges.fold(0.0, f64::max) * factor,
            off_centre: is_centred.then(|| libm::hypot(circle.y, circle.z) * factor),
            mean: scaled(&mean),
            turns: turns.iter().map(scaled).collect(),
        }
    }

    /// The least-squares circle of values around a large base circle: radius, and centre along 0 and 90°. Only the radius
    /// if it is not centred.
    fn circle(&self, values: &[f64], is_centred: bool) -> Vector3<f64> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let only = Vector3::new(mean, 0.0, 0.0);
        if !is_centred {
            return only;
        }
        let (mut square, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (angle, value) in self.angles.iter().zip(values) {
            let row = basis(*angle);
            square += row * row.transpose();
            right += row * *value;
        }
        square
            .cholesky()
            .map_or(only, |factor| factor.solve(&right))
    }

    /// How far an artefact that is off centre moves X1 and Y1 in the sense of the angles, and in the other one (mm).
    #[must_use]
    pub fn senses(&self) -> [f64; 2] {
        let of = |k: usize| {
            let turns: Vec<Vec<f64>> = (self.readings.iter())
                .map(|turn| turn.iter().map(|read| read[k]).collect())
                .collect();
            self.circle(&mean(&turns), true)
        };
        let (x, y) = (of(0), of(1));
        [
            0.5 * libm::hypot(x.y + y.z, y.y - x.z),
            0.5 * libm::hypot(x.y - y.z, y.y + x.z),
        ]
    }
}

fn rotating(angle: f64, x: f64, y: f64) -> f64 {
    x * libm::cos(angle) + y * libm::sin(angle)
}

fn basis(angle: f64) -> Vector3<f64> {
    Vector3::new(1.0, libm::cos(angle), libm::sin(angle))
}

/// The mean of all turns at each angle.
fn mean(turns: &[Vec<f64>]) -> Vec<f64> {
    let count = turns.len() as f64;
    let angles = 0..turns.first().map_or(0, Vec::len);
    angles
        .map(|i| turns.iter().map(|turn| turn[i]).sum::<f64>() / count)
        .collect()
}

fn range(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = extremes(values);
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Readings of a spindle whose axis moves by `x` and `y`, and along Z by `z`, at an angle (rad) in a turn.
    fn turns(angles: usize, count: usize, moves: impl Fn(f64, usize) -> [f64; 5]) -> Turns {
        let angles: Vec<f64> = (0..angles)
            .map(|i| TAU * i as f64 / angles as f64)
            .collect();
        let turn = |k: usize| angles.iter().map(|angle| moves(*angle, k)).collect();
        Turns {
            apart: Some(100.0),
            sensors: [true; 5],
            readings: (0..count).map(turn).collect(),
            angles,
        }
    }

    fn found(turns: &Turns, name: &str) -> ErrorMotion {
        let mut all = turns.error_motions().into_iter();
        all.find(|one| one.name == name).unwrap()
    }

    #[test]
    fn harmonics_have_their_values_and_eccentricity_has_none() {
        // An artefact 20 µm off centre at 30°, sensors that are not at zero; two lobes of 1.5 µm along X; from turn to turn
        // ± 0.4 µm along X; 2 µm/100 mm of tilt with three lobes about Y; once per turn 0.7 µm along Z.
        let turns = turns(72, 4, |angle, turn| {
            let off = 20e-3;
            let (x0, y0) = (off * libm::cos(angle + 0.5), off * libm::sin(angle + 0.5));
            let other = if turn % 2 == 0 { 0.4e-3 } else { -0.4e-3 };
            let x = x0 + 5e-3 + 1.5e-3 * libm::cos(2.0 * angle) + other;
            let tilt = 2e-3 * libm::cos(3.0 * angle);
            [x, y0 - 3e-3, x + tilt, y0 - 3e-3, 0.7e-3 * libm::cos(angle)]
        });
        // Sums of 288 products of 20 µm.
        let is = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-11, "{value}");
        let x = found(&turns, "radial X1, fixed");
        is(x.synchronous, 3.0);
        is(x.asynchronous, 0.8);
        is(x.total, 3.8);
        is(x.off_centre.unwrap(), 20.0);
        let y = found(&turns, "radial Y1, fixed");
        is(y.total, 0.0);
        // cos 2θ·cos θ = ½ cos θ + ½ cos 3θ, of which the first is a circle off centre; the second and the change of ± 0.4 cos θ
        // around it stay. The eccentricity is a constant, the zero of the sensors off centre.
        let both = found(&turns, "radial 1, rotating");
        is(both.synchronous, 1.5);
        is(both.asynchronous, 0.8);
        is(both.total, 2.0 * (0.75 + 0.4));
        is(both.off_centre.unwrap(), libm::hypot(5.75_f64, 3.0));
        let tilt = found(&turns, "tilt X, fixed");
        is(tilt.synchronous, 40.0);
        is(tilt.asynchronous, 0.0);
        // cos 3θ·cos θ = ½ cos 2θ + ½ cos 4θ, at the angles that were read.
        let twofold = turns
            .angles
            .iter()
            .map(|t| 10.0 * (libm::cos(2.0 * t) + libm::cos(4.0 * t)));
        is(found(&turns, "tilt, rotating").total, range(twofold));
        let axial = found(&turns, "axial");
        is(axial.synchronous, 1.4);
        assert_eq!(axial.off_centre, None);
        let [right, wrong] = turns.senses();
        // A quarter of the two lobes is not once per turn.
        is(right, 20e-3);
        is(wrong, 0.0);
    }

    #[test]
    fn angles_need_not_be_even() {
        let mut turns = turns(60, 3, |angle, _| {
            [30e-3 * libm::sin(angle) + 1e-3, 0.0, 0.0, 0.0, 0.0]
        });
        turns.angles.truncate(47);
        turns.readings.iter_mut().for_each(|turn| turn.truncate(47));
        let x = found(&turns, "radial X1, fixed");
        // The normal equations of three quarters of a turn have a condition number of 10.
        assert!(x.total < 1e-12 && (x.off_centre.unwrap() - 30.0).abs() < 1e-11);
    }
}
