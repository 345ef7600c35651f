//! The machine: two branches of axes, a spindle, a tool and a workpiece.

mod check;
mod file;

use crate::kinematics::Htm;
pub use check::{MachineError, MachineProblem};

/// The most axes a machine may have.
pub const MAX_AXES: usize = 6;

/// One value per axis, in the order of [`Machine::axes`]; unused places are 0.
pub type PerAxis = [f64; MAX_AXES];

/// Which of the two branches of the chain an axis belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Branch {
    /// From the foundation to the workpiece.
    Workpiece,
    /// From the foundation to the tool.
    Tool,
}

/// An axis letter: X Y Z U V W are linear, A B C rotary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Letter(char);

impl Letter {
    /// The letter, if it names an axis.
    #[must_use]
    pub fn new(letter: char) -> Option<Self> {
        "XYZUVWABC".contains(letter).then_some(Self(letter))
    }
    /// The letter itself.
    #[must_use]
    pub fn char(self) -> char {
        self.0
    }
    /// True for A, B and C.
    #[must_use]
    pub fn is_rotary(self) -> bool {
        matches!(self.0, 'A' | 'B' | 'C')
    }
    /// Which axis of its frame it moves along or turns about: 0, 1, 2 for x, y, z.
    #[must_use]
    pub fn component(self) -> usize {
        match self.0 {
            'X' | 'U' | 'A' => 0,
            'Y' | 'V' | 'B' => 1,
            _ => 2,
        }
    }
}

impl std::fmt::Display for Letter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// One axis of the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its letter, which gives its kind and direction in its own frame.
    pub letter: Letter,
    /// The branch it belongs to.
    pub branch: Branch,
    /// Its frame in the foundation frame, all axes at zero (mm, rad).
    pub frame: Htm,
    /// Travel limits of the command (mm or deg).
    pub travel: [f64; 2],
    /// True if a rotary axis turns without end and its position wraps.
    pub modulo: bool,
    /// True if a positive command moves the carriage the negative way.
    pub reversed: bool,
    /// The highest speed (mm/s or deg/s), from which the rate bound follows.
    pub max_speed: f64,
    /// How far the command must retreat before its direction counts as reversed (mm or deg).
    pub hysteresis: f64,
}

impl Axis {
    /// Command units (mm or deg) to kinematic units (mm or rad).
    #[must_use]
    pub fn to_kinematic(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_radians()
        } else {
            value
        }
    }
    /// Kinematic units (mm or rad) to command units (mm or deg).
    #[must_use]
    pub fn to_command(&self, value: f64) -> f64 {
        if self.letter.is_rotary() {
            value.to_degrees()
        } else {
            value
        }
    }
    /// `mm` or `deg`.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        if self.letter.is_rotary() { "deg" } else { "mm" }
    }
}

/// A serial machine tool of three to six axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Its name, which error files and blobs refer to.
    pub name: String,
    /// The axes: each branch from the foundation outwards, in the order of the file.
    pub axes: Vec<Axis>,
    /// The spindle frame in the foundation frame, all axes at zero.
    pub spindle: Htm,
    /// The tool axis in the spindle frame: 0, 1, 2 for x, y, z.
    pub tool_axis: usize,
    /// The tool tip in the spindle frame (mm).
    pub tip: [f64; 3],
    /// Range of the tool length (mm, along the tool axis), if the length is an input.
    pub length_range: Option<[f64; 2]>,
    /// The workpiece frame in the foundation frame, all axes at zero.
    pub workpiece: Htm,
}

impl Machine {
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

    /// The tip (mm, spindle frame) of a tool of another length: same side, same offsets.
    #[must_use]
    pub fn tip_at(&self, length: f64) -> [f64; 3] {
        let mut tip = self.tip;
        // A negative length is no tool, but keeps the position affine in the length.
        tip[self.tool_axis] = length * self.tip[self.tool_axis].signum();
        tip
    }

    /// A position in command units (mm, deg) in kinematic units (mm, rad).
    #[must_use]
    pub fn to_kinematic(&self, position: &[f64]) -> PerAxis {
        let mut q = PerAxis::default();
        for ((q, axis), p) in q.iter_mut().zip(&self.axes).zip(position) {
            *q = axis.to_kinematic(*p);
        }
        q
    }

    /// Kinematic units (mm, rad) in command units (mm, deg).
    #[must_use]
    pub fn to_command(&self, q: &PerAxis) -> PerAxis {
        let mut p = PerAxis::default();
        for ((p, axis), q) in p.iter_mut().zip(&self.axes).zip(q) {
            *p = axis.to_command(*q);
        }
        p
    }

    /// The topology as in the source document: workpiece to foundation to tool, `wCAYFXZSt`.
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
