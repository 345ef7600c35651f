//! Bounds of the corrections, from the actual output of the tables.

use super::Progress;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde::Serialize;
use trueaxis::Axis;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{CorrectionLimits, MAX_AXES, Machine};
use trueaxis_model::parallel;
use trueaxis_model::validate::{Command, DrawError, Region, Runtime, random_commands};

/// Number of random positions over the whole travel. The same number again has linear axes and auxiliaries at their
/// ends, where corrections that are affine in them are largest.
const POSITIONS: usize = 20_000;
/// Bound divided by the largest value found.
const MARGIN: f64 = 1.25;
/// Number of positions tried around each largest value and each largest rate.
const AROUND: usize = 300;
/// Corrections above this fraction of the largest count as equally large.
const AS_LARGE: f64 = 0.99;
/// Smallest value bound of linear (mm) and rotary axes (deg).
const LEAST_VALUE: f64 = 0.01;
const LEAST_VALUE_ROTARY: f64 = 0.001;
/// Smallest rate bound (mm/s, deg/s).
const LEAST_RATE: f64 = 0.1;
/// Time (s) of a transition over the whole bound, and smallest ramp rate (mm/s, deg/s).
const RAMP_TIME: f64 = 0.5;
const LEAST_RAMP: f64 = 0.01;
/// Time (s) of the move over which a rate is measured. At top speed it is 0.5 mm: far above the rounding of f32
/// positions, and below the spacing of points.
const RATE_TIME: f64 = 1e-3;

/// The bounds of one axis, and the largest correction that they are derived from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisBounds {
    /// Letter of the axis.
    pub axis: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Largest correction found (mm, deg).
    pub largest: f64,
    /// Where it occurs (mm, deg, one per axis): the first of all positions where it is equally large.
    pub at: Vec<f64>,
    /// Largest rate of change found, at top speed of all axes (mm/s, deg/s).
    pub largest_rate: f64,
    /// Value bound (mm, deg).
    pub value_bound: f32,
    /// Rate bound (mm/s, deg/s).
    pub rate_bound: f32,
    /// Ramp rate (mm/s, deg/s).
    pub ramp_rate: f32,
    /// Rate at which a reversal is made up (mm/s, deg/s).
    pub reversal_rate: f32,
    /// Acceleration with which a reversal is made up (mm/s², deg/s²).
    pub reversal_acceleration: f32,
}

impl AxisBounds {
    /// The largest value bound (mm, deg) that still protects the machine.
    #[must_use]
    pub fn most(&self) -> f32 {
        if self.unit == "mm" { 2.0 } else { 1.0 }
    }

    /// Sets the bounds of an axis of a compensation.
    pub fn set(&self, axis: &mut Axis) {
        axis.value_bound = self.value_bound;
        axis.rate_bound = self.rate_bound;
        axis.ramp_rate = self.ramp_rate;
        axis.reversal_rate = self.reversal_rate;
        axis.reversal_acceleration = self.reversal_acceleration;
    }
}

/// A largest correction, and where it occurs.
#[derive(Clone, Debug)]
pub struct Peak {
    /// Magnitude (mm, deg).
    pub value: f64,
    /// The correction itself (mm, deg).
    pub correction: f64,
    /// Rate of change at top speed of all axes (mm/s, deg/s).
    pub rate: f64,
    /// Position of the largest value.
    pub at: Command,
    /// Position of the largest rate.
    pub steepest: Command,
}

/// The largest corrections and rates of every axis.
pub struct Survey<'a> {
    /// The machine with its errors and the policy.
    pub kinematics: Kinematics<'a>,
    /// One per axis.
    pub largest: Vec<Peak>,
    /// For each axis, the first position at which its correction is equally large.
    as_large: Vec<Command>,
}

impl<'a> Survey<'a> {
    /// Evaluates many positions.
    pub fn new(
        machine: &'a Machine,
        errors: &'a ErrorModel,
        runtime: &Runtime<'_>,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Self, DrawError> {
        let kinematics = runtime.kinematics(machine, errors);
        let mut commands = random_commands(&kinematics, Region::Travel, POSITIONS, seed ^ 0x5eed)?;
        let mut corners = commands.clone();
        for (number, command) in corners.iter_mut().enumerate() {
            to_corner(machine, errors, command, number);
        }
        commands.append(&mut corners);
        progress.stage("bounding the corrections", commands.len());
        let mut found = evaluated(machine, runtime, &commands, progress);
        let mut largest = peaks(machine, &commands, &found);
        if let Policy::Direction { damping } = kinematics.policy {
            // Peaks may be narrower than the spacing of random positions.
            let mut random = Pcg64Mcg::seed_from_u64(seed);
            let tops: Vec<Command> = largest.iter().flat_map(|p| [p.at, p.steepest]).collect();
            let near = tops.iter().flat_map(|top| {
                let around = |_| around(machine, top, damping.to_degrees(), &mut random);
                (0..AROUND).map(around).collect::<Vec<_>>()
            });
            let near: Vec<Command> = near.collect();
            commands.extend(near);
            let near = &commands[found.len()..];
            found.extend(evaluated(machine, runtime, near, progress));
            largest = peaks(machine, &commands, &found);
        }
        let as_large = (0..machine.axes.len()).map(|i| {
            let most = AS_LARGE * largest[i].value;
            let is_as_large = |found: &Evaluated| f64::from(found.values[i].abs()) >= most;
            let place = found.iter().position(is_as_large);
            place.map_or(largest[i].at, |place| commands[place])
        });
        Ok(Self {
            as_large: as_large.collect(),
            kinematics,
            largest,
        })
    }

    /// Derives the bounds.
    pub fn bounds(&self) -> Vec<AxisBounds> {
        let machine = self.kinematics.machine;
        let axes = machine.axes.iter().zip(&self.largest).zip(&self.as_large);
        let limits = machine.correction_limits.iter().copied();
        let limits = limits.chain(std::iter::repeat(CorrectionLimits::default()));
        axes.zip(limits)
            .map(|(((axis, peak), place), limits)| {
                let least = if axis.letter.is_rotary() {
                    LEAST_VALUE_ROTARY
                } else {
                    LEAST_VALUE
                };
                let value_bound = (MARGIN * peak.value).max(least);
                let ramp_rate = (value_bound / RAMP_TIME).max(LEAST_RAMP);
                let rate_bound = (MARGIN * peak.rate + ramp_rate).max(LEAST_RATE);
                let [reversal_rate, reversal_acceleration] =
                    reversal(limits, axis.max_speed, rate_bound, ramp_rate);
                AxisBounds {
                    axis: axis.letter.char(),
                    unit: axis.unit(),
                    largest: peak.value,
                    at: place.axes[..machine.axes.len()]
                        .iter()
                        .map(|q| f64::from(*q))
                        .collect(),
                    largest_rate: peak.rate,
                    value_bound: value_bound as f32,
                    rate_bound: rate_bound as f32,
                    ramp_rate: ramp_rate as f32,
                    reversal_rate: reversal_rate as f32,
                    reversal_acceleration: reversal_acceleration as f32,
                }
            })
            .collect()
    }
}

/// Rate and acceleration with which a reversal is made up: what the machine file says, or half of the speed and two thirds
/// of the acceleration of the axis; otherwise those of a ramp. Never more than the drive may be asked for.
///
/// LinuxCNC takes half of both for its own backlash, but begins with the sign of the planned velocity; the third part
/// more makes up for the reversal threshold (`cargo xtask linuxcnc contour`).
fn reversal(limits: CorrectionLimits, max_speed: f64, rate_bound: f64, ramp_rate: f64) -> [f64; 2] {
    let speed = limits.speed.unwrap_or(f64::INFINITY);
    let drive = limits.acceleration.unwrap_or(f64::INFINITY);
    let ramp = ramp_rate / f64::from(trueaxis::RISE);
    let stated = limits
        .reversal
        .or(limits.of_axis.map(|axis| REVERSAL * axis));
    match stated {
        Some(acceleration) => [
            (0.5 * max_speed).max(rate_bound).min(speed),
            acceleration.max(ramp).min(drive),
        ],
        None => [rate_bound.min(speed), limits.acceleration.unwrap_or(ramp)],
    }
}

/// Part of the acceleration of an axis with which it makes up a reversal.
pub const REVERSAL: f64 = 2.0 / 3.0;

/// Output of the tables at a position.
struct Evaluated {
    /// Corrections (mm, deg).
    values: [f32; MAX_AXES],
    /// Their rates of change at top speed of all axes (mm/s, deg/s).
    rates: [f64; MAX_AXES],
}

/// Evaluates tables at some positions.
fn evaluated(
    machine: &Machine,
    runtime: &Runtime<'_>,
    commands: &[Command],
    progress: &dyn Progress,
) -> Vec<Evaluated> {
    parallel::map(commands, |command| {
        let values = runtime.evaluate(command);
        let rates = rates(machine, runtime, command, &values);
        progress.step();
        Evaluated { values, rates }
    })
}

/// The largest corrections and rates at some positions; the first of equal ones.
fn peaks(machine: &Machine, commands: &[Command], found: &[Evaluated]) -> Vec<Peak> {
    let at = Command::at(machine, &[]);
    let of_axis = |i: usize| {
        let mut peak = Peak {
            value: 0.0,
            correction: 0.0,
            rate: 0.0,
            at,
            steepest: at,
        };
        for (command, Evaluated { values, rates }) in commands.iter().zip(found) {
            let correction = f64::from(values[i]);
            if correction.abs() > peak.value {
                (peak.value, peak.correction, peak.at) = (correction.abs(), correction, *command);
            }
            if rates[i] > peak.rate {
                (peak.rate, peak.steepest) = (rates[i], *command);
            }
        }
        peak
    };
    (0..machine.axes.len()).map(of_axis).collect()
}

/// This position with each rotary axis moved by up to `degrees`.
fn around(machine: &Machine, command: &Command, degrees: f64, random: &mut Pcg64Mcg) -> Command {
    let mut near = *command;
    for (q, axis) in near.axes.iter_mut().zip(&machine.axes) {
        if axis.letter.is_rotary() {
            let [low, high] = axis.travel.map(|t| t as f32);
            let off = degrees * (2.0 * random.random::<f64>() - 1.0);
            *q = (*q + off as f32).clamp(low, high);
        }
    }
    near
}

/// Moves each linear axis and auxiliary to one of its ends, chosen by the bits of `number`.
fn to_corner(machine: &Machine, errors: &ErrorModel, command: &mut Command, number: usize) {
    let mut bits = number;
    let mut end = |[low, high]: [f64; 2]| {
        let end = if bits & 1 == 0 { low } else { high };
        bits >>= 1;
        end as f32
    };
    for (q, axis) in command.axes.iter_mut().zip(&machine.axes) {
        if !axis.letter.is_rotary() {
            *q = end(axis.travel);
        }
    }
    let lengths = machine.length_range.into_iter();
    let ranges = lengths.chain(errors.sensors.iter().map(|s| s.range_kelvin));
    for (auxiliary, range) in command.auxiliaries.iter_mut().zip(ranges) {
        *auxiliary = end(range);
    }
}

/// Σ |∂Δ/∂qⱼ| · top speed of axis j (mm/s, deg/s), by moving each axis towards its middle.
fn rates(
    machine: &Machine,
    runtime: &Runtime<'_>,
    command: &Command,
    values: &[f32; MAX_AXES],
) -> [f64; MAX_AXES] {
    let mut rates = [0.0; MAX_AXES];
    let used = runtime.compensation().inputs_used();
    // Skip inputs that no table reads.
    let moving = machine.axes.iter().enumerate();
    for (j, axis) in moving.filter(|(j, _)| used >> j & 1 == 1) {
        let [low, high] = axis.travel;
        let way = (axis.max_speed * RATE_TIME).min(0.5 * (high - low));
        let q = f64::from(command.axes[j]);
        let to = (if q > 0.5 * (low + high) {
            q - way
        } else {
            q + way
        }) as f32;
        let mut moved = *command;
        moved.axes[j] = to;
        let there = runtime.evaluate(&moved);
        // The distance actually moved, after rounding to f32.
        let time = (f64::from(to) - q).abs() / axis.max_speed;
        if time > 0.0 {
            for (i, rate) in rates.iter_mut().enumerate() {
                *rate += (f64::from(there[i]) - f64::from(values[i])).abs() / time;
            }
        }
    }
    rates
}
