//! A machine as controllers with a rigid-body model see it: errors of each axis about fixed points of the machine, as
//! functions of its position.
//!
//! In the coordinates of the foundation, with all axes at zero, a branch is a product of motions, each of its axis times the
//! error of this axis: S₁(q₁)·E₁(q₁)·S₂(q₂)·E₂(q₂)…, applied to the tool tip. An axis location is an error, too, one that
//! depends on the position: S⁻¹·L·S. The location of the spindle is one of the last axis before it.

use crate::sampled::Nodes;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use serde::Serialize;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::{Htm, Kinematics};
use trueaxis_model::machine::{Branch, MAX_AXES, Machine, PerAxis};
use trueaxis_model::numbers::ascending;
use trueaxis_model::parallel;
use trueaxis_model::validate::commands_in_travel;

/// An error `[x y z a b c]` (mm, rad).
pub type Error = [f64; 6];

/// The errors of an axis at increasing positions (mm, deg), linear in between and constant outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisErrors {
    /// The positions.
    pub at: Vec<f64>,
    /// The error at each.
    pub errors: Vec<Error>,
}

impl AxisErrors {
    /// Adds other errors of the axis, at the positions of both.
    pub(crate) fn add(&mut self, other: &Self) {
        let mut at = [&self.at[..], &other.at].concat();
        ascending(&mut at);
        at.dedup();
        let sum = |q: &f64| {
            let [own, other] = [self.value(*q), other.value(*q)];
            std::array::from_fn(|k| own[k] + other[k])
        };
        self.errors = at.iter().map(sum).collect();
        self.at = at;
    }

    /// The error at a position (mm, deg).
    #[must_use]
    pub fn value(&self, position: f64) -> Error {
        let after = self.at.partition_point(|at| *at <= position);
        match (after.checked_sub(1), self.at.get(after)) {
            (None, None) => [0.0; 6],
            (None, Some(_)) => self.errors[0],
            (Some(last), None) => self.errors[last],
            (Some(before), Some(next)) => {
                let t = (position - self.at[before]) / (next - self.at[before]);
                std::array::from_fn(|k| {
                    (1.0 - t) * self.errors[before][k] + t * self.errors[after][k]
                })
            }
        }
    }
}

/// An axis with all others at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedAxis {
    /// Unit vector along which it moves or about which it turns what it carries, for a positive command.
    pub direction: Vector3<f64>,
    /// The point about which its errors turn (mm): on a rotary axis, the origin of its frame; on a linear one, that of the
    /// foundation.
    pub point: Vector3<f64>,
    rotary: bool,
    tool: bool,
    frame: Htm,
}

/// The axes of a machine, and the place of its tool.
#[derive(Clone, Debug)]
pub struct Chain<'m> {
    /// The machine.
    pub machine: &'m Machine,
    /// Axes of the axes.
    pub axes: Vec<PlacedAxis>,
    /// The tool tip (mm).
    pub tip: Vector3<f64>,
    /// The direction from the tip to the spindle.
    pub tool: Vector3<f64>,
}

impl PlacedAxis {
    /// Motion at a command (mm, rad).
    fn motion(&self, q: f64) -> Htm {
        if !self.rotary {
            return Htm::translation(self.direction * q);
        }
        let r = *Rotation3::from_axis_angle(&Unit::new_normalize(self.direction), q).matrix();
        Htm {
            r,
            t: self.point - r * self.point,
        }
    }

    /// An error about its point, in the foundation.
    fn error(&self, error: Error) -> Htm {
        Htm::translation(self.point) * Htm::from_xyz_abc(error) * Htm::translation(-self.point)
    }

    /// The other way.
    fn components(&self, error: Htm) -> Error {
        components(Htm::translation(-self.point) * error * Htm::translation(self.point))
    }

    /// An error about its point, in the coordinates of the machine, as one in the frame of the axis.
    pub(crate) fn in_frame(&self, error: Error) -> Error {
        let frame = self.frame.inverse() * Htm::translation(self.point);
        components(frame * Htm::from_xyz_abc(error) * frame.inverse())
    }
}

/// `[x y z a b c]` of a displacement, the inverse of [`Htm::from_xyz_abc`].
fn components(Htm { r, t }: Htm) -> Error {
    [
        t.x,
        t.y,
        t.z,
        libm::atan2(-r[(1, 2)], r[(2, 2)]),
        libm::asin(r[(0, 2)].clamp(-1.0, 1.0)),
        libm::atan2(-r[(0, 1)], r[(0, 0)]),
    ]
}

impl<'m> Chain<'m> {
    /// The chain of a machine.
    #[must_use]
    pub fn new(machine: &'m Machine) -> Self {
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        let pose = kinematics.nominal(&PerAxis::default(), None);
        let in_foundation = machine.workpiece * pose;
        let axes = machine.axes.iter().map(|axis| {
            let sense = if axis.reversed { -1.0 } else { 1.0 };
            let rotary = axis.letter.is_rotary();
            PlacedAxis {
                direction: axis.frame.r.column(axis.letter.component()) * sense,
                point: if rotary {
                    axis.frame.t
                } else {
                    Vector3::zeros()
                },
                rotary,
                tool: axis.branch == Branch::Tool,
                frame: axis.frame,
            }
        });
        Self {
            machine,
            axes: axes.collect(),
            tip: in_foundation.t,
            tool: machine.workpiece.r * Vector3::from(machine.direction(&pose)),
        }
    }

    /// The errors of each axis, with their locations and that of the spindle, at `count` positions over the travel and at
    /// the points of its measured motions; after travel in either direction, the mean, and at reference temperatures.
    #[must_use]
    pub fn motions(&self, errors: &ErrorModel, count: usize) -> Vec<AxisErrors> {
        let situation = Situation::default();
        let located = |index: usize, frame: &Htm| {
            let inter = Htm::from_xyz_abc(errors.inter_at(index, &situation.kelvin));
            *frame * inter * frame.inverse()
        };
        let spindle = located(self.axes.len(), &self.machine.spindle);
        let last_tool = self.axes.iter().rposition(|axis| axis.tool);
        let of = |index: usize| {
            let (axis, placed) = (&self.machine.axes[index], &self.axes[index]);
            let nodes = Nodes::over(axis.travel, count);
            let mut at: Vec<f64> = (0..count).map(|k| nodes.at(k)).collect();
            let motions = errors.motions[index].iter();
            let points = motions
                .filter_map(|m| m.table.as_ref())
                .flat_map(|table| &table.at)
                .map(|q| axis.to_command(*q));
            at.extend(points.filter(|q| (axis.travel[0]..=axis.travel[1]).contains(q)));
            ascending(&mut at);
            at.dedup_by(|b, a| *b - *a < 1e-6);
            let location = located(index, &placed.frame);
            let error = |q: &f64| {
                let q = axis.to_kinematic(*q);
                let motion = placed.motion(q);
                let own = errors.intra_at(self.machine, index, q, &situation, &Switches::ALL);
                let own = Htm::from_xyz_abc(own.unwrap_or_default());
                let own = placed.frame * own * placed.frame.inverse();
                let all = motion.inverse() * location * motion * own;
                placed.components(match last_tool == Some(index) {
                    true => all * spindle,
                    false => all,
                })
            };
            AxisErrors {
                errors: at.iter().map(error).collect(),
                at,
            }
        };
        (0..self.axes.len()).map(of).collect()
    }

    /// Corrections (mm) of the linear axes at a command (mm, deg), as a controller computes them that compensates the
    /// position of the tip only: what moves the tip back by its error at this command.
    #[must_use]
    pub fn correction(&self, motions: &[AxisErrors], command: &PerAxis) -> PerAxis {
        let (mut nominal, mut actual) = ([Htm::identity(); 2], [Htm::identity(); 2]);
        let mut columns = [Vector3::zeros(); MAX_AXES];
        for (index, placed) in self.axes.iter().enumerate() {
            let branch = usize::from(placed.tool);
            if !placed.rotary {
                columns[index] = nominal[branch].r * placed.direction;
            }
            let motion = placed.motion(self.machine.axes[index].to_kinematic(command[index]));
            nominal[branch] = nominal[branch] * motion;
            let error = placed.error(motions[index].value(command[index]));
            actual[branch] = actual[branch] * motion * error;
        }
        let at = |[workpiece, tool]: [Htm; 2]| {
            let tip = tool.r * self.tip + tool.t;
            workpiece.r.transpose() * (tip - workpiece.t)
        };
        let error = at(actual) - at(nominal);
        let linear: Vec<usize> = (0..self.axes.len())
            .filter(|i| !self.axes[*i].rotary)
            .collect();
        let to_workpiece = nominal[0].r.transpose();
        let of = |index: usize| {
            let sense = if self.axes[index].tool { 1.0 } else { -1.0 };
            to_workpiece * columns[index] * sense
        };
        let square: Matrix3<f64> = linear.iter().map(|i| of(*i) * of(*i).transpose()).sum();
        let mut correction = PerAxis::default();
        // Linear axes that do not span space are refused with the machine file.
        if let Some(inverse) = square.try_inverse() {
            for index in linear {
                correction[index] = -of(index).dot(&(inverse * error));
            }
        }
        correction
    }
    /// Drives the exact machine with what a control corrects by these errors, at random commands in both directions of
    /// travel, with the machine's own tool and at reference temperatures.
    #[must_use]
    pub fn left(
        &self,
        errors: &ErrorModel,
        motions: &[AxisErrors],
        positions: usize,
        seed: u64,
    ) -> RemainingErrors {
        let machine = self.machine;
        let kinematics = Kinematics::new(machine, errors);
        let commands = commands_in_travel(machine, errors, positions, seed);
        let each = parallel::map(&commands, |command| {
            let (q, Situation { sign, .. }) = command.kinematic(machine);
            let situation = Situation {
                sign,
                ..Situation::default()
            };
            let position: PerAxis = command.axes.map(f64::from);
            let dq = self.correction(motions, &position);
            let corrected: PerAxis = std::array::from_fn(|i| position[i] + dq[i]);
            let corrected = machine.to_kinematic(&corrected[..machine.axes.len()]);
            let nominal = kinematics.nominal(&q, None);
            let wanted = Vector3::from(machine.direction(&nominal));
            [q, corrected].map(|q| {
                let actual = kinematics.actual(&q, &situation, &Switches::ALL);
                let direction = Vector3::from(machine.direction(&actual));
                [
                    (actual.t - nominal.t).norm() * 1e3,
                    direction.cross(&wanted).norm() * 1e6,
                ]
            })
        });
        let most = |with: usize, k: usize| each.iter().map(|e| e[with][k]).fold(0.0, f64::max);
        RemainingErrors {
            tip_before_um: most(0, 0),
            tip_um: most(1, 0),
            direction_before_urad: most(0, 1),
            direction_urad: most(1, 1),
        }
    }
}

/// Errors of the tool on a machine with and without a correction: the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RemainingErrors {
    /// Of the tip without correction (µm).
    pub tip_before_um: f64,
    /// Of the tip with it (µm).
    pub tip_um: f64,
    /// Of the direction without correction (µrad).
    pub direction_before_urad: f64,
    /// Of the direction with it (µrad).
    pub direction_urad: f64,
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::MACHINES;
