//! What an instrument reads: compares the actual machine with one without errors.

use crate::errors::{ErrorModel, MAX_SENSORS, Situation, Switches};
use crate::kinematics::{Htm, Kinematics};
use crate::machine::{Machine, PerAxis};
use nalgebra::{Matrix3, Vector3};

/// A command (mm, rad) and the direction from which it was reached: +1, −1, or 0 if unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchState {
    /// The command (mm, rad).
    pub q: PerAxis,
    /// Direction of travel of each axis.
    pub sign: PerAxis,
}

impl BenchState {
    /// A command reached from an unknown direction.
    #[must_use]
    pub fn at(q: PerAxis) -> Self {
        Self {
            q,
            ..Self::default()
        }
    }

    /// With another position of one axis.
    #[must_use]
    pub fn with(mut self, axis: usize, q: f64) -> Self {
        self.q[axis] = q;
        self
    }
}

/// Displacement of the tool relative to the workpiece, in excess of that without errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Of the tip (mm), in the workpiece frame.
    pub tip: Vector3<f64>,
    /// Rotation (rad), in the workpiece frame.
    pub turn: Vector3<f64>,
}

/// A machine with its errors, as seen by instruments.
pub struct Bench<'a> {
    /// The machine.
    pub machine: &'a Machine,
    kinematics: Kinematics<'a>,
    kelvin: [f64; MAX_SENSORS],
}

impl<'a> Bench<'a> {
    /// A machine with errors at given temperatures (K from the references).
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel, kelvin: [f64; MAX_SENSORS]) -> Self {
        Self {
            machine,
            kinematics: Kinematics::new(machine, errors),
            kelvin,
        }
    }

    /// Pose of the tool in the workpiece frame, without errors.
    #[must_use]
    pub fn nominal(&self, q: &PerAxis) -> Htm {
        self.kinematics.nominal(q, None)
    }

    /// Like `nominal`, with errors.
    #[must_use]
    pub fn actual(&self, state: &BenchState) -> Htm {
        let situation = Situation {
            sign: state.sign,
            kelvin: self.kelvin,
            ..Situation::default()
        };
        self.kinematics.actual(&state.q, &situation, &Switches::ALL)
    }

    /// Reading at `to` of an instrument that was set to zero at `from`.
    #[must_use]
    pub fn deviation(&self, from: &BenchState, to: &BenchState) -> Deviation {
        self.deviation_of(&Vector3::zeros(), from, to)
    }

    /// Like `deviation`, for a point that moves with the tool (mm from the tip, in the frame of the tool's pose).
    #[must_use]
    pub fn deviation_of(
        &self,
        point: &Vector3<f64>,
        from: &BenchState,
        to: &BenchState,
    ) -> Deviation {
        let off = |state: &BenchState| {
            let (nominal, actual) = (self.nominal(&state.q), self.actual(state));
            let turned = (actual.r - nominal.r) * point;
            (
                actual.t - nominal.t + turned,
                actual.r * nominal.r.transpose(),
            )
        };
        let ((t0, r0), (t1, r1)) = (off(from), off(to));
        Deviation {
            tip: t1 - t0,
            turn: rotation(r1 * r0.transpose()),
        }
    }

    /// The position (mm, rad) with all axes at zero, or as near to it as their travels permit.
    #[must_use]
    pub fn home(&self) -> PerAxis {
        let mut home = PerAxis::default();
        for (q, axis) in home.iter_mut().zip(&self.machine.axes) {
            let [low, high] = axis.travel;
            *q = axis.to_kinematic(0.0_f64.max(low).min(high));
        }
        home
    }

    /// Indices of the linear axes.
    pub fn linear(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.machine.axes.len()).filter(|i| !self.machine.axes[*i].letter.is_rotary())
    }

    /// Indices of the rotary axes.
    pub fn rotary(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.machine.axes.len()).filter(|i| self.machine.axes[*i].letter.is_rotary())
    }

    /// Unit vector (workpiece frame) along which a positive command of a linear axis moves the tip.
    #[must_use]
    pub fn way(&self, q: &PerAxis, linear: usize) -> Vector3<f64> {
        let ahead = BenchState::at(*q).with(linear, q[linear] + 1.0).q;
        (self.nominal(&ahead).t - self.nominal(q).t).normalize()
    }

    /// Unit vector (workpiece frame) about which a positive command of a rotary axis turns the tool.
    #[must_use]
    pub fn about(&self, q: &PerAxis, rotary: usize) -> Vector3<f64> {
        let ahead = BenchState::at(*q).with(rotary, q[rotary] + 1.0).q;
        rotation(self.nominal(&ahead).r * self.nominal(q).r.transpose()).normalize()
    }

    /// The point of a rotary axis nearest to the tip at a position (workpiece frame, mm): half-way to the tip after
    /// half a turn.
    #[must_use]
    pub(crate) fn foot(&self, q: &PerAxis, rotary: usize) -> Vector3<f64> {
        let half = BenchState::at(*q)
            .with(rotary, q[rotary] + std::f64::consts::PI)
            .q;
        0.5 * (self.nominal(q).t + self.nominal(&half).t)
    }

    /// This command with linear axes that place the tip, without errors, at a point (workpiece frame, mm).
    /// `None` if they do not span all directions.
    #[must_use]
    pub fn reach(&self, q: &PerAxis, point: Vector3<f64>) -> Option<PerAxis> {
        let mut q = *q;
        let gap = point - self.nominal(&q).t;
        // Minimum norm, in case there are more than three.
        let ways: Vec<(usize, Vector3<f64>)> =
            self.linear().map(|i| (i, self.way(&q, i))).collect();
        let gram: Matrix3<f64> = ways.iter().map(|(_, w)| w * w.transpose()).sum();
        let along = gram.try_inverse()? * gap;
        for (i, way) in ways {
            q[i] += way.dot(&along);
        }
        Some(q)
    }
}

/// The rotation vector (rad) of a small rotation; for larger ones only its direction is right.
fn rotation(r: Matrix3<f64>) -> Vector3<f64> {
    Htm {
        r,
        t: Vector3::zeros(),
    }
    .twist()
    .r
}
