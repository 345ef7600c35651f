//! The tool pose relative to the workpiece, and the axis locations. Users compare them with the display of a
//! controller to check a machine description.

use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Htm, Kinematics};
use crate::machine::{Machine, PerAxis};
use serde::Serialize;
use trueaxis_kinematics::{Branch, Nominal};

/// A tool in the workpiece frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ToolPose {
    /// The tip (mm).
    pub tip: [f64; 3],
    /// Unit vector from the tip to the spindle, as displayed by controllers.
    pub direction: [f64; 3],
}

impl ToolPose {
    /// The tool of a pose (spindle orientation, origin at the tip).
    #[must_use]
    pub fn of(machine: &Machine, pose: &Htm) -> Self {
        Self {
            tip: pose.t.into(),
            direction: machine.direction(pose),
        }
    }
}

/// An axis in the foundation frame, without errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AxisLine {
    /// Letter of the axis.
    pub axis: char,
    /// The branch that it carries: `workpiece` or `tool`.
    pub carries: &'static str,
    /// True if it is a rotary axis.
    pub rotary: bool,
    /// Unit vector of the motion of what it carries at a positive command: its direction, or its axis of rotation
    /// (right-handed).
    pub direction: [f64; 3],
    /// A point on it (mm): the origin of its frame.
    pub point: [f64; 3],
}

/// Tool and axes at one position.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Posed {
    /// The tool of a machine without errors.
    pub nominal: ToolPose,
    /// The tool with all errors, if errors were given.
    pub actual: Option<ToolPose>,
    /// The axes, in the order of the machine.
    pub axes: Vec<AxisLine>,
}

/// Tool and axes at one position (mm, rad) of the uncompensated machine.
#[must_use]
pub fn pose(
    machine: &Machine,
    errors: Option<&ErrorModel>,
    q: &PerAxis,
    situation: &Situation,
) -> Posed {
    let nominal = Nominal::new(machine);
    let axes = machine.axes.iter().enumerate().map(|(index, axis)| {
        let [point, direction] = nominal.line(q, index).unwrap_or_default();
        AxisLine {
            axis: axis.letter.char(),
            carries: carries(axis.branch),
            rotary: axis.letter.is_rotary(),
            direction: direction.into(),
            point: point.into(),
        }
    });
    Posed {
        nominal: ToolPose::of(machine, &nominal.pose(q, situation.length)),
        actual: errors.map(|errors| {
            let kinematics = Kinematics::new(machine, errors);
            ToolPose::of(machine, &kinematics.actual(q, situation, &Switches::ALL))
        }),
        axes: axes.collect(),
    }
}

/// `workpiece` or `tool`.
#[must_use]
pub fn carries(branch: Branch) -> &'static str {
    match branch {
        Branch::Workpiece => "workpiece",
        Branch::Tool => "tool",
    }
}
