//! Draws an error file.

use crate::Fixed;
use std::f64::consts::TAU;
use std::fmt::Write;
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::machine::{Axis, Machine};

/// Magnitude of an error in mm, and in rad.
const SIZE: [f64; 2] = [0.03, 8e-5];
/// Highest degree of error motions, and highest harmonic.
const DEGREE: u8 = 3;
/// Temperature range (K) of sensors on either side of their reference.
const KELVIN: f64 = 15.0;
const SENSORS: [&str; 2] = ["frame", "spindle"];
/// Minimum distance of measured points (mm, deg): in practice they are never closer.
const APART: [f64; 2] = [5.0, 1.0];
/// Minimum number of measured points per wave of the curve: with fewer it would not be visible.
const IN_A_WAVE: f64 = 6.0;
/// Noise of measured values, as a fraction of the error's magnitude.
const NOISE: f64 = 0.05;

/// Character of the errors of one machine.
struct Character {
    /// Every motion of every axis has every degree.
    everything: bool,
    /// Fraction of all possible errors, from a few locations to every motion of every axis.
    density: f64,
    inter: bool,
    backlash: bool,
    degrees: [bool; DEGREE as usize + 1],
    harmonics: bool,
    /// Some motions are measured points, some of these separate for each direction of travel.
    tabulated: bool,
    reversal: bool,
    thermal: bool,
    /// Motions are known in part of the travel only.
    partly: bool,
}

impl Character {
    fn draw(random: &mut Fixed) -> Self {
        let everything = random.chance(0.28);
        Self {
            everything,
            density: [0.1, 0.3, 0.6, 1.0][random.below(4)],
            inter: random.chance(0.8),
            backlash: random.chance(0.3),
            degrees: [0.4, 0.7, 0.6, 0.6].map(|p| random.chance(p) || everything),
            harmonics: random.chance(0.15),
            tabulated: random.chance(0.2) && !everything,
            reversal: random.chance(0.2) && !everything,
            thermal: random.chance(0.15),
            partly: random.chance(0.15),
        }
    }
}

/// The parts of the file, which are generated together and written separately.
#[derive(Default)]
struct File {
    parameters: String,
    thermal: String,
    tabulated: String,
    calibrated: String,
}

pub fn draw(machine: &Machine, random: &mut Fixed) -> String {
    let character = Character::draw(random);
    let mut file = File::default();
    for axis in &machine.axes {
        let range = known(axis, &character, &mut file, random);
        let shared = points(axis, range, random);
        for component in 0..6 {
            let (tabulated, reversal) = (random.chance(0.4), random.chance(0.4));
            let reversal = character.reversal && reversal;
            let measured = reversal || (character.tabulated && tabulated);
            if measured {
                // Usually all motions of an axis are measured at the same points.
                let own = match random.chance(0.3) {
                    true => &points(axis, range, random),
                    false => &shared,
                };
                table(axis, component, own, reversal, &mut file, random);
            } else {
                coefficients(axis, component, &character, &mut file, random);
            }
            location(axis.letter.char(), component, &character, &mut file, random);
            if character.backlash && random.chance(character.density) {
                let value = SIZE[component / 3] / 5.0 * random.within(-1.0, 1.0);
                file.parameter(
                    component,
                    axis.letter.char(),
                    ParameterKind::Backlash,
                    value,
                );
            }
        }
    }
    for component in 0..6 {
        location('S', component, &character, &mut file, random);
    }
    file.text(&machine.name)
}

/// Range in which the motions of an axis are known (mm, deg).
fn known(axis: &Axis, character: &Character, file: &mut File, random: &mut Fixed) -> [f64; 2] {
    let [low, high] = axis.travel;
    if !character.partly || axis.modulo || random.chance(0.4) {
        return [low, high];
    }
    let width = high - low;
    let from = low + width * random.within(0.0, 0.25);
    let to = high - width * random.within(0.0, 0.25);
    let _ = writeln!(file.calibrated, "{} = {:?}", axis.letter, [from, to]);
    [from, to]
}

/// Inter-axis errors.
fn location(
    axis: char,
    component: usize,
    character: &Character,
    file: &mut File,
    random: &mut Fixed,
) {
    let value = random.within(-1.0, 1.0);
    if character.inter && random.chance(character.density) {
        let size = SIZE[component / 3];
        file.parameter(component, axis, ParameterKind::Inter, size * value);
        file.warmed(
            component,
            axis,
            ParameterKind::Inter,
            size,
            character,
            random,
        );
    }
}

/// Polynomials and harmonics. A motion of an endless axis must be periodic, so it has only harmonics.
fn coefficients(
    axis: &Axis,
    component: usize,
    character: &Character,
    file: &mut File,
    random: &mut Fixed,
) {
    let size = SIZE[component / 3];
    // The largest position, in mm or rad, at which the magnitude of a coefficient of degree k applies.
    let ends = axis.travel.map(|t| axis.to_kinematic(t).abs());
    let reach = ends[0].max(ends[1]);
    let letter = axis.letter.char();
    let wanted = |random: &mut Fixed| character.everything || random.chance(character.density);
    for degree in 0..=DEGREE {
        let value = random.within(-1.0, 1.0);
        let closes = degree == 0 || !axis.modulo;
        if character.degrees[usize::from(degree)] && closes && wanted(random) {
            let kind = ParameterKind::Degree(degree);
            let size = size / reach.powi(i32::from(degree));
            file.parameter(component, letter, kind, size * value);
            file.warmed(component, letter, kind, size, character, random);
        }
    }
    if !axis.letter.is_rotary() || !(axis.modulo || character.harmonics) {
        return;
    }
    for harmonic in 1..=DEGREE {
        let size = size / f64::from(harmonic);
        for kind in [
            ParameterKind::Cosine(harmonic),
            ParameterKind::Sine(harmonic),
        ] {
            let value = random.within(-1.0, 1.0);
            if wanted(random) {
                file.parameter(component, letter, kind, size * value);
                file.warmed(component, letter, kind, size, character, random);
            }
        }
    }
}

/// Five to a hundred positions (mm, deg) with equal or nearly equal steps.
fn points(axis: &Axis, [low, high]: [f64; 2], random: &mut Fixed) -> Vec<f64> {
    let apart = APART[usize::from(axis.letter.is_rotary())];
    let most = ((high - low) / apart) as usize + 1;
    let count = (5 + random.below(96)).min(most).max(5);
    let step = (high - low) / (count - 1) as f64;
    let jitter = if random.chance(0.3) { 0.3 } else { 0.0 };
    let inner = (1..count - 1).map(|k| low + step * (k as f64 + random.within(-jitter, jitter)));
    let mut at = vec![low];
    at.extend(inner);
    at.push(high);
    at
}

/// Measured values: a smooth curve and noise; with `reversal` those after negative travel differ, more at one end than
/// at the other.
fn table(
    axis: &Axis,
    component: usize,
    at: &[f64],
    reversal: bool,
    file: &mut File,
    random: &mut Fixed,
) {
    let size = SIZE[component / 3];
    let most = (at.len() - 1) as f64 / IN_A_WAVE;
    let waves = random.within(0.3, 3.0).min(most);
    // A whole number on an endless axis.
    let waves = if axis.modulo { waves.ceil() } else { waves };
    let slope = if axis.modulo {
        0.0
    } else {
        random.within(-0.5, 0.5)
    };
    let phase = random.within(0.0, TAU);
    let [near, far] = [0; 2].map(|_| random.within(-0.3, 0.3));
    let (first, last) = (at[0], at[at.len() - 1]);
    let mut values = |reversed: f64| {
        let mut values: Vec<f64> = at
            .iter()
            .map(|a| {
                let u = (a - first) / (last - first);
                let far = if axis.modulo { near } else { far };
                let play = near + (far - near) * u;
                let smooth = 0.5 * (TAU * waves * u + phase).sin() + slope * u;
                size * (smooth + reversed * play + random.within(-NOISE, NOISE))
            })
            .collect();
        if axis.modulo {
            values[at.len() - 1] = values[0];
        }
        values
    };
    let name = motion(component, axis.letter.char());
    let _ = writeln!(file.tabulated, "[tabulated.{name}]\nat = {at:?}");
    let _ = match reversal {
        true => writeln!(
            file.tabulated,
            "positive = {:?}\nnegative = {:?}",
            values(1.0),
            values(-1.0)
        ),
        false => writeln!(file.tabulated, "value = {:?}", values(0.0)),
    };
}

/// `EXX`.
fn motion(component: usize, axis: char) -> String {
    let kind = ParameterKind::Degree(0);
    let parameter = Parameter {
        component,
        axis,
        kind,
    };
    parameter.to_string()[..3].to_owned()
}

impl File {
    fn parameter(&mut self, component: usize, axis: char, kind: ParameterKind, value: f64) {
        let parameter = Parameter {
            component,
            axis,
            kind,
        };
        let _ = writeln!(self.parameters, "{parameter} = {value:?}");
    }

    /// Makes a parameter change with temperature, for some parameters on some machines.
    fn warmed(
        &mut self,
        component: usize,
        axis: char,
        kind: ParameterKind,
        size: f64,
        character: &Character,
        random: &mut Fixed,
    ) {
        let (value, sensor) = (random.within(-1.0, 1.0), SENSORS[random.below(2)]);
        if character.thermal && random.chance(0.15) {
            let parameter = Parameter {
                component,
                axis,
                kind,
            };
            let per_kelvin = size * value / KELVIN;
            let _ = writeln!(
                self.thermal,
                "{parameter} = {{ per_kelvin = {per_kelvin:?}, sensor = \"{sensor}\", \
                 reference_celsius = 20.0, range_kelvin = [-{KELVIN:?}, {KELVIN:?}] }}"
            );
        }
    }

    fn text(&self, machine: &str) -> String {
        format!(
            "machine = \"{machine}\"\n[parameters]\n{}[thermal]\n{}[calibrated]\n{}{}",
            self.parameters, self.thermal, self.calibrated, self.tabulated
        )
    }
}
