//! The machine: two branches of axes, a spindle, a tool and a workpiece.

use crate::{Axis, Htm, MAX_AXES, MachineError, MachineProblem, PerAxis};
use heapless::Vec;

/// A serial machine tool of three to six axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// The axes: each branch from the foundation outwards.
    pub axes: Vec<Axis, MAX_AXES>,
    /// The spindle frame in the foundation frame, all axes at zero.
    pub spindle: Htm,
    /// The tool axis in the spindle frame: 0, 1, 2 for x, y, z.
    pub tool_axis: usize,
    /// The tool tip in the spindle frame (mm).
    pub tip: [f64; 3],
    /// The workpiece frame in the foundation frame, all axes at zero.
    pub workpiece: Htm,
}

impl Machine {
    /// A machine whose spindle and workpiece frames are the foundation frame, with the tool along z and its tip at the
    /// spindle origin. Set the fields for anything else, and call [`Self::check`] to see whether the machine can be
    /// corrected.
    ///
    /// # Errors
    /// [`MachineError`] if there are fewer than three or more than six axes, or two with the same letter.
    pub fn new(axes: &[Axis]) -> Result<Self, MachineError> {
        let count = MachineError {
            axis: None,
            problem: MachineProblem::NumberOfAxes { axes: axes.len() },
        };
        if axes.len() < 3 {
            return Err(count);
        }
        for (i, axis) in axes.iter().enumerate() {
            if axes[..i].iter().any(|a| a.letter == axis.letter) {
                return Err(MachineError {
                    axis: Some(i),
                    problem: MachineProblem::RepeatedAxis {
                        letter: axis.letter.char(),
                    },
                });
            }
        }
        Ok(Self {
            axes: Vec::from_slice(axes).map_err(|_| count)?,
            spindle: Htm::identity(),
            tool_axis: 2,
            tip: [0.0; 3],
            workpiece: Htm::identity(),
        })
    }

    /// The index of an axis by its letter.
    #[must_use]
    pub fn index(&self, letter: char) -> Option<usize> {
        self.axes.iter().position(|a| a.letter.char() == letter)
    }

    /// The nominal tool length (mm): the tip's distance along the tool axis.
    #[must_use]
    pub fn tool_length(&self) -> f64 {
        self.tip[self.tool_axis].abs()
    }

    /// The tip (mm, spindle frame) of a tool of another length, with the same side and offsets.
    #[must_use]
    pub fn tip_at(&self, length: f64) -> [f64; 3] {
        let mut tip = self.tip;
        // No tool has a negative length, but this keeps the position affine in the length.
        tip[self.tool_axis] = length * self.tip[self.tool_axis].signum();
        tip
    }

    /// Unit vector from the tip to the spindle, as controllers show it, in the frame used for tool poses (spindle
    /// orientation, origin at the tip).
    #[must_use]
    pub fn direction(&self, pose: &Htm) -> [f64; 3] {
        // The tip is on the negative side of the tool axis, or else the axis points to the tip.
        let to_spindle = match self.tip[self.tool_axis] > 0.0 {
            true => -1.0,
            false => 1.0,
        };
        (pose.r.column(self.tool_axis) * to_spindle).into()
    }

    /// Converts a position from command units (mm, deg) to kinematic units (mm, rad).
    #[must_use]
    pub fn to_kinematic(&self, position: &[f64]) -> PerAxis {
        let mut q = PerAxis::default();
        for ((q, axis), p) in q.iter_mut().zip(&self.axes).zip(position) {
            *q = axis.to_kinematic(*p);
        }
        q
    }

    /// Converts a position from kinematic units (mm, rad) to command units (mm, deg).
    #[must_use]
    pub fn to_command(&self, q: &PerAxis) -> PerAxis {
        let mut p = PerAxis::default();
        for ((p, axis), q) in p.iter_mut().zip(&self.axes).zip(q) {
            *p = axis.to_command(*q);
        }
        p
    }
}
