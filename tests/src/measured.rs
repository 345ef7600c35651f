//! Error motions as an instrument would report them: the error files of `examples/mill-21` and `examples/five-axis-30`,
//! composed of smooth curves and noise.
//!
//! Magnitudes are those of a good machine, the noise that of a laser or a tracker. Only `+ − × /` on f64 and rounding
//! are used, without a library's sine, so that the digits are the same on every machine.

use crate::Fixed;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Standard deviation of the noise of displacements (µm) and of angles (µrad).
const NOISE: [f64; 2] = [0.2, 0.5];
/// Displacements and angles are read with a resolution of a tenth of a µm or µrad.
const READINGS_PER_UNIT: f64 = 10.0;
/// Numbers per line of a file.
const PER_LINE: usize = 12;

/// An axis and its measured positions.
struct Measured {
    letter: char,
    /// First position and step, mm or degrees.
    start: f64,
    step: f64,
    /// For an endless axis the last point is the first, one turn later.
    points: usize,
    endless: bool,
}

const fn measured(letter: char, start: f64, step: f64, points: usize) -> Measured {
    Measured {
        letter,
        start,
        step,
        points,
        endless: false,
    }
}

impl Measured {
    fn is_rotary(&self) -> bool {
        matches!(self.letter, 'A' | 'B' | 'C')
    }

    /// Range of the largest magnitude of an error motion: µm for displacements, µrad for angles.
    fn size(&self, angular: bool) -> [f64; 2] {
        match (self.is_rotary(), angular) {
            (false, false) => [5.0, 15.0],
            (false, true) => [10.0, 40.0],
            (true, false) => [3.0, 8.0],
            (true, true) => [10.0, 40.0],
        }
    }

    /// One error motion: tenths of a µm or of a µrad at every point.
    fn motion(&self, angular: bool, random: &mut Fixed) -> Vec<i64> {
        let smooth = if self.is_rotary() {
            self.waves(random)
        } else {
            self.polynomial(random)
        };
        let (low, high) = smooth.iter().fold((f64::MAX, f64::MIN), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
        let [least, most] = self.size(angular);
        let largest = random.within(least, most);
        let noise = NOISE[usize::from(angular)];
        let mut readings: Vec<i64> = smooth
            .iter()
            .map(|v| {
                let true_value = largest * (2.0 * v - low - high) / (high - low);
                let read = true_value + noise * normal(random);
                (READINGS_PER_UNIT * read).round() as i64
            })
            .collect();
        if self.endless {
            readings[self.points - 1] = readings[0];
        }
        readings
    }

    /// Chebyshev polynomials of degree 1 to 6 over the travel, smaller for higher degrees, because their slopes at the
    /// ends grow with the square of the degree.
    fn polynomial(&self, random: &mut Fixed) -> Vec<f64> {
        let coefficients: [f64; 6] =
            std::array::from_fn(|k| random.within(-1.0, 1.0) / ((k + 1) * (k + 1)) as f64);
        let last = (self.points - 1) as f64;
        let at = (0..self.points).map(|k| 2.0 * k as f64 / last - 1.0);
        at.map(|x| {
            let (mut before, mut now, mut sum) = (1.0, x, 0.0);
            for c in coefficients {
                sum += c * now;
                (before, now) = (now, 2.0 * x * now - before);
            }
            sum
        })
        .collect()
    }

    /// One to four waves per turn, smaller for larger numbers.
    fn waves(&self, random: &mut Fixed) -> Vec<f64> {
        let coefficients: [[f64; 2]; 4] = std::array::from_fn(|k| {
            std::array::from_fn(|_| random.within(-1.0, 1.0) / (k + 1) as f64)
        });
        let at = (0..self.points).map(|k| self.start + self.step * k as f64);
        at.map(|degrees| {
            let (cosine, sine) = cosine_and_sine(degrees * (PI / 180.0));
            let (mut c, mut s, mut sum) = (cosine, sine, 0.0);
            for [a, b] in coefficients {
                sum += a * c + b * s;
                (c, s) = (c * cosine - s * sine, s * cosine + c * sine);
            }
            sum
        })
        .collect()
    }
}

/// Computed by their series. Up to one turn the largest term is 87 and the 40th is below 1e-14.
fn cosine_and_sine(angle: f64) -> (f64, f64) {
    let (mut cosine, mut sine, mut term) = (0.0, 0.0, 1.0);
    for k in 0..40 {
        let part: &mut f64 = if k % 2 == 0 { &mut cosine } else { &mut sine };
        *part += if k % 4 < 2 { term } else { -term };
        term *= angle / f64::from(k + 1);
    }
    (cosine, sine)
}

/// Twelve uniform numbers have the variance of one normal number, and nearly its distribution.
fn normal(random: &mut Fixed) -> f64 {
    (0..12).map(|_| random.within(-0.5, 0.5)).sum()
}

/// A TOML array of numbers over several lines.
fn array(name: &str, numbers: &[String]) -> String {
    let lines: Vec<String> = numbers.chunks(PER_LINE).map(|c| c.join(", ")).collect();
    format!("{name} = [\n    {},\n]\n", lines.join(",\n    "))
}

/// `[tabulated.…]` of all six error motions of every axis.
fn motions(axes: &[Measured], random: &mut Fixed) -> String {
    let mut text = String::new();
    for axis in axes {
        let at: Vec<String> = (0..axis.points)
            .map(|k| format!("{:.1}", axis.start + axis.step * k as f64))
            .collect();
        for direction in "XYZABC".chars() {
            let angular = matches!(direction, 'A' | 'B' | 'C');
            let readings = axis.motion(angular, random);
            let value: Vec<String> = readings
                .iter()
                .map(|r| {
                    let (sign, size) = (if *r < 0 { "-" } else { "" }, r.unsigned_abs());
                    if angular {
                        format!("{sign}{}.{}e-6", size / 10, size % 10)
                    } else {
                        format!("{sign}{}.{:04}", size / 10_000, size % 10_000)
                    }
                })
                .collect();
            let _ = write!(text, "\n[tabulated.E{direction}{}]\n", axis.letter);
            text += &array("at", &at);
            text += &array("value", &value);
        }
    }
    text
}

fn head(what: &str, seed: u64, machine: &str) -> String {
    format!(
        "# {what}\n\
         # Made up, of usual size: smooth curves with noise of {} µm and {} µrad, read to 0.1 µm and 0.1 µrad.\n\
         # Made by `cargo run -p trueaxis-tests --example measured-examples`, seed {seed}.\n\
         machine = \"{machine}\"\n",
        NOISE[0], NOISE[1]
    )
}

/// `examples/mill-21/errors-21.toml`.
#[must_use]
pub fn mill_21() -> String {
    const SEED: u64 = 21;
    let mut random = Fixed::new(SEED);
    let mut text = head(
        "21 errors of a three-axis mill: 18 measured error motions and three squarenesses.",
        SEED,
        "Mill with 21 errors",
    );
    text += "slopes_beside_squareness = true\n\n[parameters]  # rad\n";
    for name in ["EC0X", "EA0Z", "EB0Z"] {
        let _ = writeln!(text, "{name} = {:.1}e-6", random.within(-60.0, 60.0));
    }
    let axes = [
        measured('X', 0.0, 10.0, 51),
        measured('Y', 0.0, 5.0, 61),
        measured('Z', -400.0, 5.0, 81),
    ];
    text + &motions(&axes, &mut random)
}

/// `examples/five-axis-30/errors-30.toml`.
#[must_use]
pub fn five_axis_30() -> String {
    const SEED: u64 = 30;
    let axes = [
        measured('X', -245.0, 10.0, 50),
        measured('Y', -196.0, 8.0, 50),
        measured('Z', 0.0, 7.0, 50),
        measured('A', -117.0, 3.0, 50),
        Measured {
            endless: true,
            ..measured('C', 0.0, 7.2, 51)
        },
    ];
    head(
        "30 measured error motions of a five-axis machine, 50 points each; those of the endless C close.",
        SEED,
        "Trunnion with 30 error motions",
    ) + &motions(&axes, &mut Fixed::new(SEED))
}
