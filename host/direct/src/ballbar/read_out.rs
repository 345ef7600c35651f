//! Readings of a ball-bar along a path, on a machine with known errors, with and without a compensation.

use super::PathPoint;
use nalgebra::Vector3;
use trueaxis_model::explain::{Bench, BenchState};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::{Command, Runtime};

/// A ball-bar after setup: the workpiece ball is where the tool ball is with the axes at the centre.
pub struct BallBar<'a> {
    bench: &'a Bench<'a>,
    /// Indices of X, Y and Z.
    axes: [usize; 3],
    /// Axis positions at the centre (mm, deg).
    centre: Vec<f64>,
}

/// A reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadOut {
    /// Direction of the bar without errors (unit vector, workpiece frame).
    pub direction: Vector3<f64>,
    /// Excess of its length over that without errors (mm).
    pub deviation: f64,
}

/// An axis cannot follow the path.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the path needs {axis} from {low:.3} to {high:.3} mm, its travel is {} to {}", travel[0], travel[1])]
pub struct OutOfTravel {
    axis: char,
    low: f64,
    high: f64,
    travel: [f64; 2],
}

impl<'a> BallBar<'a> {
    /// Sets it up with the axes at `centre` (mm, deg, one per axis). `axes` are the indices of X, Y and Z.
    #[must_use]
    pub fn new(bench: &'a Bench<'a>, axes: [usize; 3], centre: Vec<f64>) -> Self {
        Self {
            bench,
            axes,
            centre,
        }
    }

    /// The indices of X, Y and Z, if the machine has them.
    #[must_use]
    pub fn axes(machine: &Machine) -> Option<[usize; 3]> {
        let [x, y, z] = ['X', 'Y', 'Z'].map(|letter| machine.index(letter));
        Some([x?, y?, z?])
    }

    /// # Errors
    /// [`OutOfTravel`]: the first axis that cannot follow the path.
    pub fn reaches(&self, path: &[PathPoint]) -> Result<(), OutOfTravel> {
        for (k, &index) in self.axes.iter().enumerate() {
            let axis = &self.bench.machine.axes[index];
            let (low, high) = path.iter().fold((0.0_f64, 0.0_f64), |(low, high), place| {
                (low.min(place.at[k]), high.max(place.at[k]))
            });
            let [low, high] = [low, high].map(|off| self.centre[index] + off);
            // Program words have four decimals.
            if low < axis.travel[0] - 1e-4 || high > axis.travel[1] + 1e-4 {
                return Err(OutOfTravel {
                    axis: axis.letter.char(),
                    low,
                    high,
                    travel: axis.travel,
                });
            }
        }
        Ok(())
    }

    /// Readings at the measured points of a path, with the axes where the compensation takes them. The order of the
    /// path is the motion: an axis has arrived from the side on which it last moved.
    #[must_use]
    pub fn read(&self, path: &[PathPoint], runtime: Option<&Runtime<'_>>) -> Vec<ReadOut> {
        let tip = |position: &[f64], coming: &PerAxis| tip(self.bench, position, coming, runtime);
        let [nominal_centre, actual_centre] = tip(&self.centre, &PerAxis::default());
        let mut last = [0.0; 3];
        let mut coming = PerAxis::default();
        let mut position = self.centre.clone();
        let mut readings = Vec::new();
        for place in path {
            for (k, &index) in self.axes.iter().enumerate() {
                let way = place.at[k] - last[k];
                if way.abs() > MOVES {
                    coming[index] = way.signum();
                }
                position[index] = self.centre[index] + place.at[k];
            }
            last = place.at;
            if !place.is_read {
                continue;
            }
            let [nominal, actual] = tip(&position, &coming);
            let bar = nominal - nominal_centre;
            readings.push(ReadOut {
                direction: bar.normalize(),
                deviation: (actual - actual_centre).norm() - bar.norm(),
            });
        }
        readings
    }
}

/// Tip positions without errors and in reality (mm, workpiece frame) at a command (mm, deg). The axes arrive from
/// the directions `coming`, with the corrections of a compensation, if any.
#[must_use]
pub fn tip(
    bench: &Bench<'_>,
    position: &[f64],
    coming: &PerAxis,
    runtime: Option<&Runtime<'_>>,
) -> [Vector3<f64>; 2] {
    let machine = bench.machine;
    let nominal = bench.nominal(&machine.to_kinematic(position)).t;
    let mut commanded = position.to_vec();
    if let Some(runtime) = runtime {
        let command = Command::coming(machine, position, coming);
        for (q, dq) in commanded.iter_mut().zip(runtime.evaluate(&command)) {
            *q += f64::from(dq);
        }
    }
    let state = BenchState {
        q: machine.to_kinematic(&commanded),
        sign: *coming,
    };
    [nominal, bench.actual(&state).t]
}

/// An axis that moves by less than this (mm) counts as standing: rounding of sines.
const MOVES: f64 = 1e-9;
