//! The exact chain: workpiece to tool through every axis and every error.

use super::{Htm, Jacobian, Twist};
use crate::errors::{ErrorModel, Situation, Switches};
use crate::machine::{Branch, MAX_AXES, Machine, PerAxis};
use nalgebra::Vector3;

/// One axis of a branch: its index in the machine and its frame seen from the frame before it.
#[derive(Clone, Copy, Debug)]
struct Link {
    index: usize,
    relative: Htm,
    /// `relative` with the inter-axis error behind it, at reference temperature.
    located: Htm,
}

/// The kinematics of one machine with one set of errors.
#[derive(Clone, Debug)]
pub struct Kinematics<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Its errors.
    pub errors: &'a ErrorModel,
    workpiece: Vec<Link>,
    tool: Vec<Link>,
    /// From the last workpiece axis to the workpiece frame.
    to_workpiece: Htm,
    /// From the last tool axis to the spindle frame.
    to_spindle: Htm,
    /// `to_spindle` with the spindle's inter-axis error behind it, at reference temperature.
    to_located_spindle: Htm,
}

impl<'a> Kinematics<'a> {
    /// Lays out the two branches.
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel) -> Self {
        let (workpiece, to_workpiece) =
            links(machine, errors, Branch::Workpiece, machine.workpiece);
        let (tool, to_spindle) = links(machine, errors, Branch::Tool, machine.spindle);
        Self {
            machine,
            errors,
            workpiece,
            tool,
            to_workpiece,
            to_spindle,
            to_located_spindle: to_spindle * Htm::from_xyz_abc(errors.inter[machine.axes.len()]),
        }
    }

    fn tip(&self, length: Option<f64>) -> Vector3<f64> {
        Vector3::from(length.map_or(self.machine.tip, |l| self.machine.tip_at(l)))
    }

    /// The commanded motion of an axis, in the direction of its frame (mm or rad).
    fn motion(&self, index: usize, q: f64) -> f64 {
        if self.machine.axes[index].reversed {
            -q
        } else {
            q
        }
    }

    fn moved(&self, frame: Htm, index: usize, q: f64) -> Htm {
        let letter = self.machine.axes[index].letter;
        let motion = self.motion(index, q);
        if letter.is_rotary() {
            frame.rotated_about(letter.component(), motion)
        } else {
            frame.translated_along(letter.component(), motion)
        }
    }

    /// Nominal pose of the tool (spindle orientation, origin at the tip) in the workpiece frame.
    #[must_use]
    pub fn nominal(&self, q: &PerAxis, length: Option<f64>) -> Htm {
        let branch = |links: &[Link]| {
            links.iter().fold(Htm::identity(), |frame, link| {
                self.moved(frame * link.relative, link.index, q[link.index])
            })
        };
        let workpiece = branch(&self.workpiece) * self.to_workpiece;
        let tool = branch(&self.tool) * self.to_spindle * Htm::translation(self.tip(length));
        workpiece.inverse() * tool
    }

    /// Actual pose of the tool in the workpiece frame, with all errors at the commanded `q`.
    #[must_use]
    pub fn actual(&self, q: &PerAxis, situation: &Situation, switches: &Switches) -> Htm {
        let cold = self.errors.inter_thermal.is_empty();
        let branch = |links: &[Link]| {
            links.iter().fold(Htm::identity(), |frame, link| {
                let located = if cold {
                    link.located
                } else {
                    link.relative
                        * Htm::from_xyz_abc(self.errors.inter_at(link.index, &situation.kelvin))
                };
                let moved = self.moved(frame * located, link.index, q[link.index]);
                match self.errors.intra_at(
                    self.machine,
                    link.index,
                    q[link.index],
                    situation,
                    switches,
                ) {
                    Some(error) => moved * Htm::from_xyz_abc(error),
                    None => moved,
                }
            })
        };
        let workpiece = branch(&self.workpiece) * self.to_workpiece;
        let to_spindle = if cold {
            self.to_located_spindle
        } else {
            let spindle = self
                .errors
                .inter_at(self.machine.axes.len(), &situation.kelvin);
            self.to_spindle * Htm::from_xyz_abc(spindle)
        };
        let mut tool = branch(&self.tool) * to_spindle;
        tool.t += tool.r * self.tip(situation.length);
        workpiece.inverse() * tool
    }

    /// The volumetric error at a command, without or with a correction added to it: the twist
    /// of nominal(q)⁻¹ · actual(q + Δq), in the tool frame at the tip (mm, rad).
    #[must_use]
    pub fn volumetric_error(
        &self,
        q: &PerAxis,
        correction: &PerAxis,
        situation: &Situation,
    ) -> Twist {
        let corrected = std::array::from_fn(|i| q[i] + correction[i]);
        (self.nominal(q, situation.length).inverse()
            * self.actual(&corrected, situation, &Switches::ALL))
        .twist()
    }

    /// The control Jacobian at `q`: the twist of the tool (tool frame, at the tip) per mm or rad
    /// of each axis.
    #[must_use]
    pub fn jacobian(&self, q: &PerAxis, length: Option<f64>) -> Jacobian {
        let n = self.machine.axes.len();
        // Frames of every axis after its motion, in the foundation frame.
        let mut frames = [Htm::identity(); MAX_AXES];
        for links in [&self.workpiece, &self.tool] {
            links.iter().fold(Htm::identity(), |frame, link| {
                frames[link.index] = self.moved(frame * link.relative, link.index, q[link.index]);
                frames[link.index]
            });
        }
        let last = self
            .tool
            .last()
            .map_or(Htm::identity(), |l| frames[l.index]);
        let spindle = last * self.to_spindle;
        let tip = spindle.r * self.tip(length) + spindle.t;
        let to_tool = spindle.r.transpose();
        let mut jacobian = Jacobian::new(n);
        for (index, axis) in self.machine.axes.iter().enumerate() {
            let direction = frames[index].r.column(axis.letter.component()).into_owned();
            // A workpiece-branch axis moves the tool the other way relative to the workpiece.
            let mut sign = if axis.branch == Branch::Workpiece {
                -1.0
            } else {
                1.0
            };
            if axis.reversed {
                sign = -sign;
            }
            let rotary = axis.letter.is_rotary();
            let (t, r) = if rotary {
                (direction.cross(&(tip - frames[index].t)), direction)
            } else {
                (direction, Vector3::zeros())
            };
            jacobian.set(index, rotary, to_tool * t * sign, to_tool * r * sign);
        }
        jacobian
    }
}

fn links(machine: &Machine, errors: &ErrorModel, branch: Branch, end: Htm) -> (Vec<Link>, Htm) {
    let mut before = Htm::identity();
    let mut links = Vec::new();
    for (index, axis) in machine.axes.iter().enumerate() {
        if axis.branch == branch {
            let relative = before.inverse() * axis.frame;
            links.push(Link {
                index,
                relative,
                located: relative * Htm::from_xyz_abc(errors.inter[index]),
            });
            before = axis.frame;
        }
    }
    (links, before.inverse() * end)
}

impl Kinematics<'_> {
    /// Poses, seen from the tool frame at the tip, of each axis' frame before its motion (and of
    /// the spindle frame, last), and of each axis' frame after its motion.
    pub(super) fn error_frames(&self, q: &PerAxis, length: Option<f64>) -> (Vec<Htm>, Vec<Htm>) {
        let n = self.machine.axes.len();
        let mut before = vec![Htm::identity(); n + 1];
        let mut after = vec![Htm::identity(); n];
        for links in [&self.workpiece, &self.tool] {
            links.iter().fold(Htm::identity(), |frame, link| {
                before[link.index] = frame * link.relative;
                after[link.index] = self.moved(before[link.index], link.index, q[link.index]);
                after[link.index]
            });
        }
        let last = self.tool.last().map_or(Htm::identity(), |l| after[l.index]);
        before[n] = last * self.to_spindle;
        let from_tool = (before[n] * Htm::translation(self.tip(length))).inverse();
        (
            before.into_iter().map(|f| from_tool * f).collect(),
            after.into_iter().map(|f| from_tool * f).collect(),
        )
    }
}
