//! The machine with the additional content of its file.

mod file;
mod solid;

pub use solid::{Carrier, Solid, SolidShape};
use std::ops::{Deref, DerefMut};
pub use trueaxis_kinematics::{
    Axis, Branch, Letter, MAX_AXES, MachineError, MachineProblem, PerAxis,
};

/// A serial machine tool of three to six axes. Dereferences to [`trueaxis_kinematics::Machine`], which has axes,
/// spindle, tool and workpiece.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name, to which error files and blobs refer.
    pub name: String,
    /// Range of the tool length (mm, along the tool axis), if it is an input.
    pub length_range: Option<[f64; 2]>,
    /// True if the controller can orient the spindle (M19).
    pub can_orient: bool,
    /// How fast the correction of each axis may move.
    pub correction_limits: Vec<CorrectionLimits>,
    /// Servo period of the controller (s).
    pub servo_period: f64,
    /// Solids that must not meet while the machine probes.
    pub solids: Vec<Solid>,
    machine: trueaxis_kinematics::Machine,
}

/// How fast an axis and its correction may move; `None`: not stated, and for the correction not limited.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CorrectionLimits {
    /// Largest speed of the correction while all axes run at top speed (mm/s, deg/s).
    pub speed: Option<f64>,
    /// Largest change of speed of the correction in a servo period, over the period (mm/s², deg/s²).
    pub acceleration: Option<f64>,
    /// Largest acceleration of the axis itself (mm/s², deg/s²).
    pub of_axis: Option<f64>,
    /// Largest acceleration with which a reversal is made up (mm/s², deg/s²).
    pub reversal: Option<f64>,
}

impl Machine {
    /// Servo period (s) if the file does not say another.
    pub const SERVO_PERIOD: f64 = 1e-3;

    /// The topology in the notation of the source document: workpiece to foundation to tool, `wCAYFXZSt`.
    #[must_use]
    pub fn topology(&self) -> String {
        let branch = |b| {
            let axes = self.axes.iter().filter(move |a| a.branch == b);
            axes.map(|a| a.letter.char())
        };
        let workpiece: String = branch(Branch::Workpiece).collect();
        let tool: String = branch(Branch::Tool).collect();
        format!("w{}F{tool}St", workpiece.chars().rev().collect::<String>())
    }
}

impl Deref for Machine {
    type Target = trueaxis_kinematics::Machine;
    fn deref(&self) -> &Self::Target {
        &self.machine
    }
}

impl DerefMut for Machine {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.machine
    }
}
