//! Bounds of the corrections, from what the tables really do.

use super::Progress;
use crate::errors::ErrorModel;
use crate::machine::{MAX_AXES, Machine};
use crate::validate::{Command, DrawError, Region, Runtime, random_commands};
use rayon::prelude::*;
use serde::Serialize;

/// Random positions over the whole travel; as many again with linear axes and auxiliaries at
/// their ends, where what is affine in them is largest.
const POSITIONS: usize = 20_000;
/// Room above the largest value found.
const MARGIN: f64 = 1.25;
/// Least value bound of linear (mm) and of rotary axes (deg).
const LEAST_VALUE: f64 = 0.01;
const LEAST_VALUE_ROTARY: f64 = 0.001;
/// Least rate bound (mm/s, deg/s).
const LEAST_RATE: f64 = 0.1;
/// Time (s) of a transition over the whole bound, and least ramp rate (mm/s, deg/s).
const RAMP_TIME: f64 = 0.5;
const LEAST_RAMP: f64 = 0.01;
/// Time (s) of the move over which a rate is measured: at top speed 0.5 mm, far above the
/// rounding of f32 positions, below the distance of points.
const RATE_TIME: f64 = 1e-3;

/// The bounds of one axis, and the largest correction they come from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisBounds {
    /// Letter of the axis.
    pub axis: char,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Largest correction found (mm, deg).
    pub largest: f64,
    /// Value bound (mm, deg).
    pub value_bound: f32,
    /// Rate bound (mm/s, deg/s).
    pub rate_bound: f32,
    /// Ramp rate (mm/s, deg/s).
    pub ramp_rate: f32,
}

/// A largest correction, and where it is.
#[derive(Clone, Debug)]
pub struct Peak {
    /// Magnitude (mm, deg).
    pub value: f64,
    /// The correction itself (mm, deg).
    pub correction: f64,
    /// Rate of change at top speed of all axes (mm/s, deg/s).
    pub rate: f64,
    /// Where the value is.
    pub at: Command,
}

/// The largest corrections and rates of every axis.
pub struct Survey<'a> {
    machine: &'a Machine,
    /// One per axis.
    pub largest: Vec<Peak>,
}

impl<'a> Survey<'a> {
    /// Looks at many positions.
    pub fn new(
        machine: &'a Machine,
        errors: &ErrorModel,
        runtime: &Runtime<'_>,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Self, DrawError> {
        let mut commands =
            random_commands(machine, errors, Region::Travel, POSITIONS, seed ^ 0x5eed)?;
        let mut corners = commands.clone();
        for (number, command) in corners.iter_mut().enumerate() {
            to_corner(machine, errors, command, number);
        }
        commands.append(&mut corners);
        progress.stage("bounding the corrections", commands.len());
        let n = machine.axes.len();
        let start = || {
            let at = Command::at(machine, &[]);
            vec![
                Peak {
                    value: 0.0,
                    correction: 0.0,
                    rate: 0.0,
                    at
                };
                n
            ]
        };
        let largest = commands
            .par_iter()
            .fold(start, |mut peaks, command| {
                let values = runtime.evaluate(command);
                let rates = rates(machine, runtime, command, &values);
                for (i, peak) in peaks.iter_mut().enumerate() {
                    let correction = f64::from(values[i]);
                    if correction.abs() > peak.value {
                        (peak.value, peak.correction, peak.at) =
                            (correction.abs(), correction, *command);
                    }
                    peak.rate = peak.rate.max(rates[i]);
                }
                progress.step();
                peaks
            })
            .reduce(start, |mut a, b| {
                for (a, b) in a.iter_mut().zip(b) {
                    let rate = a.rate.max(b.rate);
                    if b.value > a.value {
                        *a = b;
                    }
                    a.rate = rate;
                }
                a
            });
        Ok(Self { machine, largest })
    }

    /// The bounds that follow.
    pub fn bounds(&self) -> Vec<AxisBounds> {
        let axes = self.machine.axes.iter().zip(&self.largest);
        axes.map(|(axis, peak)| {
            let least = if axis.letter.is_rotary() {
                LEAST_VALUE_ROTARY
            } else {
                LEAST_VALUE
            };
            let value_bound = (MARGIN * peak.value).max(least);
            let ramp_rate = (value_bound / RAMP_TIME).max(LEAST_RAMP);
            AxisBounds {
                axis: axis.letter.char(),
                unit: axis.unit(),
                largest: peak.value,
                value_bound: value_bound as f32,
                rate_bound: (MARGIN * peak.rate + ramp_rate).max(LEAST_RATE) as f32,
                ramp_rate: ramp_rate as f32,
            }
        })
        .collect()
    }
}

/// Moves linear axes and auxiliaries to one of their ends each, as the bits of `number` say.
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
    for (j, axis) in machine.axes.iter().enumerate() {
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
        // The way that f32 really made.
        let time = (f64::from(to) - q).abs() / axis.max_speed;
        if time > 0.0 {
            for (i, rate) in rates.iter_mut().enumerate() {
                *rate += (f64::from(there[i]) - f64::from(values[i])).abs() / time;
            }
        }
    }
    rates
}
