//! The data with which the page of a report computes: machine, errors and tables as numbers, and positions with the
//! results expected there.
//!
//! Frames are twelve numbers, three rows of `[R | t]`. Lengths are in mm, angles in rad; travels and corrections
//! have the units of commands (mm, deg).

mod check;
mod tables;

use check::PageCheck;
use serde::Serialize;
use tables::PageTables;
use trueaxis_kinematics::ParameterKind;
use trueaxis_model::errors::{ErrorModel, Motion};
use trueaxis_model::kinematics::Htm;
use trueaxis_model::machine::{Axis, MAX_AXES, Machine, PerAxis};
use trueaxis_model::pose::carries;
use trueaxis_model::validate::Runtime;

/// A pose: three rows of rotation and translation (mm).
pub type PoseRows = [f64; 12];

/// Everything that the page needs to move the machine with and without its tables.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageModel {
    /// The axes, each branch from the foundation outwards.
    pub axes: Vec<PageAxis>,
    /// The spindle frame in the foundation frame, all axes at zero.
    pub spindle: PoseRows,
    /// The workpiece frame in the foundation frame, all axes at zero.
    pub workpiece: PoseRows,
    /// The tool axis in the spindle frame: 0, 1, 2 for x, y, z.
    pub tool_axis: usize,
    /// The tool tip in the spindle frame (mm).
    pub tip: [f64; 3],
    /// Range of the tool length (mm) if the length is an input.
    pub length_range: Option<[f64; 2]>,
    /// Temperature sensors on which errors depend.
    pub sensors: Vec<PageSensor>,
    /// Inter-axis errors `[x y z a b c]` (mm, rad) of each axis, then of the spindle.
    pub locations: Vec<[f64; 6]>,
    /// Changes of these with temperature.
    pub locations_per_kelvin: Vec<LocationChange>,
    /// The compensation, if any.
    pub tables: Option<PageTables>,
    /// Subtracted from every correction (mm, deg), before and after: that of the position whose correction the
    /// tables subtract, or zero.
    pub zero: Vec<f64>,
    /// Expected results at positions over the whole travel.
    pub checks: Vec<PageCheck>,
}

/// An axis with its error motions.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageAxis {
    /// Letter of the axis.
    pub letter: char,
    /// The branch that it carries: `workpiece` or `tool`.
    pub carries: &'static str,
    /// True if it is a rotary axis.
    pub rotary: bool,
    /// The axis of its frame along or about which it moves: 0, 1, 2 for x, y, z.
    pub component: usize,
    /// −1 if a positive command moves its carriage in negative direction, otherwise 1.
    pub sense: f64,
    /// Travel limits (mm or deg); for an axis without limits, its turn.
    pub travel: [f64; 2],
    /// True if it rotates without limits.
    pub endless: bool,
    /// Frame in the foundation frame, all axes at zero.
    pub frame: PoseRows,
    /// The range in which its error motions are known (mm or rad).
    pub calibrated: [f64; 2],
    /// Error motions x y z a b c; `None` if zero.
    pub motions: [Option<MotionCurves>; 6],
}

/// An error motion: the sum of all of these (mm or rad, over mm or rad).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MotionCurves {
    /// Coefficients of degree 0, 1, 2 …
    pub coefficients: Vec<f64>,
    /// Coefficients of cosine and sine of 1, 2, 3 … times the angle.
    pub harmonics: Vec<[f64; 2]>,
    /// Half of the reversal value.
    pub backlash: f64,
    /// Measured values.
    pub tabulated: Option<Tabulated>,
    /// Changes of coefficients with temperature.
    pub per_kelvin: Vec<CoefficientChange>,
    /// True if it holds its end value outside the calibrated range.
    pub holds: bool,
}

/// Measured values of an error motion, interpolated linearly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tabulated {
    /// Positions (mm or rad).
    pub at: Vec<f64>,
    /// Values (mm or rad) after positive travel, or for both directions.
    pub positive: Vec<f64>,
    /// Values after negative travel, if they differ.
    pub negative: Option<Vec<f64>>,
}

/// A temperature sensor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageSensor {
    /// Name of the temperature sensor.
    pub name: String,
    /// Range of differences from its reference (K).
    pub range_kelvin: [f64; 2],
}

/// A change of an inter-axis error with temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LocationChange {
    /// The axis, or the number of axes for the spindle.
    pub index: usize,
    /// Component 0…5 of `[x y z a b c]`.
    pub component: usize,
    /// Index of the sensor.
    pub sensor: usize,
    /// Change (mm or rad) per kelvin.
    pub per_kelvin: f64,
}

/// A change of a coefficient of an error motion with temperature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CoefficientChange {
    /// `degree`, `cosine` or `sine`.
    pub of: &'static str,
    /// The degree, or the multiple of the angle.
    pub k: u8,
    /// Index of the sensor.
    pub sensor: usize,
    /// Change per kelvin.
    pub per_kelvin: f64,
}

impl PageModel {
    /// A machine with its errors, and with a compensation that belongs to it
    /// ([`belongs`](trueaxis_tables::compile::belongs)).
    #[must_use]
    pub fn new(machine: &Machine, errors: &ErrorModel, runtime: Option<&Runtime<'_>>) -> Self {
        Self::relative_to(machine, errors, runtime, &[0.0; MAX_AXES])
    }

    /// Like `new`, for tables that subtract a correction (mm, rad): the machine's datum is corrected by that amount,
    /// before and after, as in [`Measured`](trueaxis_model::validate::Measured).
    #[must_use]
    pub fn relative_to(
        machine: &Machine,
        errors: &ErrorModel,
        runtime: Option<&Runtime<'_>>,
        zero: &PerAxis,
    ) -> Self {
        let axes = machine.axes.iter().enumerate();
        let axes = axes.map(|(index, axis)| PageAxis::new(axis, errors, index));
        let sensors = errors.sensors.iter().map(|sensor| PageSensor {
            name: sensor.name(),
            range_kelvin: sensor.range_kelvin,
        });
        let changes = errors.inter_thermal.iter().map(|change| LocationChange {
            index: change.index,
            component: change.component,
            sensor: change.sensor,
            per_kelvin: change.per_kelvin,
        });
        Self {
            axes: axes.collect(),
            spindle: frame(&machine.spindle),
            workpiece: frame(&machine.workpiece),
            tool_axis: machine.tool_axis,
            tip: machine.tip,
            length_range: machine.length_range,
            sensors: sensors.collect(),
            locations: errors.inter[..=machine.axes.len()].to_vec(),
            locations_per_kelvin: changes.collect(),
            tables: runtime.map(|runtime| PageTables::of(runtime.compensation())),
            zero: machine.to_command(zero)[..machine.axes.len()].to_vec(),
            checks: check::checks(machine, errors, runtime, zero),
        }
    }
}

impl PageAxis {
    fn new(axis: &Axis, errors: &ErrorModel, index: usize) -> Self {
        Self {
            letter: axis.letter.char(),
            carries: carries(axis.branch),
            rotary: axis.letter.is_rotary(),
            component: axis.letter.component(),
            sense: if axis.reversed { -1.0 } else { 1.0 },
            travel: axis.travel,
            endless: axis.modulo,
            frame: frame(&axis.frame),
            calibrated: errors.calibrated[index],
            motions: errors.motions[index].each_ref().map(motion),
        }
    }
}

/// A pose as three rows of rotation and translation (mm).
fn frame(pose: &Htm) -> PoseRows {
    std::array::from_fn(|k| match (k / 4, k % 4) {
        (row, 3) => pose.t[row],
        (row, column) => pose.r[(row, column)],
    })
}

fn motion(motion: &Motion) -> Option<MotionCurves> {
    let per_kelvin = motion.thermal.iter().map(|change| {
        let (of, k) = match change.kind {
            ParameterKind::Cosine(k) => ("cosine", k),
            ParameterKind::Sine(k) => ("sine", k),
            ParameterKind::Degree(k) => ("degree", k),
            // Motions have no other coefficients that change.
            ParameterKind::Inter | ParameterKind::Backlash => ("degree", 0),
        };
        CoefficientChange {
            of,
            k,
            sensor: change.sensor,
            per_kelvin: change.per_kelvin,
        }
    });
    (!motion.is_zero()).then(|| MotionCurves {
        coefficients: motion.coefficients.to_vec(),
        harmonics: motion.harmonics.to_vec(),
        backlash: motion.backlash,
        tabulated: motion.table.as_ref().map(|table| Tabulated {
            at: table.at.clone(),
            positive: table.positive.clone(),
            negative: table.negative.clone(),
        }),
        per_kelvin: per_kelvin.collect(),
        holds: motion.holds(),
    })
}

#[cfg(test)]
mod tests;
