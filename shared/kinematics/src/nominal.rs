//! The machine without errors: poses and the control Jacobian.

use crate::{Branch, Htm, Jacobian, MAX_AXES, Machine, PerAxis};
use heapless::Vec;
use nalgebra::Vector3;

/// One axis of a branch: its index in the machine and its frame relative to the previous frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub index: usize,
    pub relative: Htm,
    rotary: bool,
    /// Axis of its frame along which it moves or about which it turns.
    component: usize,
    /// −1 if a positive command moves the carriage in the negative direction.
    sense: f64,
}

impl Link {
    /// The frame displaced by a command (mm or rad).
    #[inline]
    pub fn moved(&self, frame: Htm, q: f64) -> Htm {
        let motion = self.sense * q;
        if self.rotary {
            frame.rotated_about(self.component, motion)
        } else {
            frame.translated_along(self.component, motion)
        }
    }
}

/// The axes of a branch, foundation outwards.
pub(crate) type Links = Vec<Link, MAX_AXES>;

/// Poses of the frame of every axis, then of the spindle.
pub(crate) type Frames = [Htm; MAX_AXES + 1];

/// Frames in the foundation frame (mm, rad): a point fixed to one of them is found by multiplying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carriers {
    /// Of each axis, moved; identity beyond the last axis.
    pub axes: [Htm; MAX_AXES],
    /// Of the spindle.
    pub spindle: Htm,
    /// Of the workpiece.
    pub workpiece: Htm,
}

/// The kinematics of a machine without errors.
#[derive(Clone, Debug)]
pub struct Nominal<'a> {
    /// The machine.
    pub machine: &'a Machine,
    pub(crate) workpiece: Links,
    pub(crate) tool: Links,
    /// From the last workpiece axis to the workpiece frame.
    pub(crate) to_workpiece: Htm,
    /// From the last tool axis to the spindle frame.
    pub(crate) to_spindle: Htm,
}

impl<'a> Nominal<'a> {
    /// Lays out the two branches.
    #[must_use]
    pub fn new(machine: &'a Machine) -> Self {
        let (workpiece, to_workpiece) = links(machine, Branch::Workpiece, machine.workpiece);
        let (tool, to_spindle) = links(machine, Branch::Tool, machine.spindle);
        Self {
            machine,
            workpiece,
            tool,
            to_workpiece,
            to_spindle,
        }
    }

    /// The tool tip in the spindle frame (mm), with the machine's own tool unless a length (mm) is given.
    pub(crate) fn tip(&self, length: Option<f64>) -> Vector3<f64> {
        Vector3::from(length.map_or(self.machine.tip, |l| self.machine.tip_at(l)))
    }

    /// Pose of the tool (spindle orientation, origin at the tip) in the workpiece frame at a
    /// position (mm, rad), with the machine's own tool unless a length (mm) is given.
    #[must_use]
    pub fn pose(&self, q: &PerAxis, length: Option<f64>) -> Htm {
        let branch = |links: &[Link]| {
            links.iter().fold(Htm::identity(), |frame, link| {
                link.moved(frame * link.relative, q[link.index])
            })
        };
        let workpiece = branch(&self.workpiece) * self.to_workpiece;
        let tool = branch(&self.tool) * self.to_spindle * Htm::translation(self.tip(length));
        workpiece.inverse() * tool
    }

    /// Frames in the foundation frame: of every axis before its motion (and of the spindle, last),
    /// and of every axis after its motion.
    pub(crate) fn frames(&self, q: &PerAxis) -> (Frames, Frames) {
        let mut before = [Htm::identity(); MAX_AXES + 1];
        let mut after = [Htm::identity(); MAX_AXES + 1];
        let mut last = Htm::identity();
        for links in [&self.workpiece, &self.tool] {
            last = links.iter().fold(Htm::identity(), |frame, link| {
                before[link.index] = frame * link.relative;
                after[link.index] = link.moved(before[link.index], q[link.index]);
                after[link.index]
            });
        }
        before[self.machine.axes.len()] = last * self.to_spindle;
        (before, after)
    }

    /// Every frame that something can be fixed to, in the foundation frame, at a position (mm, rad).
    #[must_use]
    pub fn carriers(&self, q: &PerAxis) -> Carriers {
        let (before, after) = self.frames(q);
        let last = self.workpiece.last();
        let last = last.map_or(Htm::identity(), |link| after[link.index]);
        Carriers {
            axes: core::array::from_fn(|i| after[i]),
            spindle: before[self.machine.axes.len()],
            workpiece: last * self.to_workpiece,
        }
    }

    /// Location of an axis in the foundation frame at a position (mm, rad): the origin of its frame (mm), and the
    /// direction along which a positive command moves its carriage, or about which it turns it (right-handed). `None`
    /// if there is no such axis.
    #[must_use]
    pub fn line(&self, q: &PerAxis, axis: usize) -> Option<[Vector3<f64>; 2]> {
        let mut links = self.workpiece.iter().chain(&self.tool);
        let link = links.find(|link| link.index == axis)?;
        let frame = &self.frames(q).1[axis];
        Some([frame.t, frame.r.column(link.component) * link.sense])
    }

    /// The control Jacobian at a position (mm, rad): the twist of the tool (tool frame, at the tip)
    /// per mm or rad of each axis.
    #[must_use]
    pub fn jacobian(&self, q: &PerAxis, length: Option<f64>) -> Jacobian {
        self.pose_and_jacobian(q, length).1
    }

    /// [`Self::pose`] and [`Self::jacobian`], at little more cost than one of them.
    pub(crate) fn pose_and_jacobian(&self, q: &PerAxis, length: Option<f64>) -> (Htm, Jacobian) {
        let n = self.machine.axes.len();
        let (before, frames) = self.frames(q);
        let last = self.workpiece.last();
        let workpiece = last.map_or(Htm::identity(), |link| frames[link.index]) * self.to_workpiece;
        let tool = before[n] * Htm::translation(self.tip(length));
        let to_tool = tool.r.transpose();
        let mut jacobian = Jacobian::new(n, self.machine.tool_axis);
        // A workpiece-branch axis moves the tool the other way relative to the workpiece.
        for (links, way) in [(&self.workpiece, -1.0), (&self.tool, 1.0)] {
            for link in links {
                let frame = &frames[link.index];
                let direction = frame.r.column(link.component).into_owned();
                let (t, r) = if link.rotary {
                    (direction.cross(&(tool.t - frame.t)), direction)
                } else {
                    (direction, Vector3::zeros())
                };
                let sign = way * link.sense;
                jacobian.set(
                    link.index,
                    link.rotary,
                    to_tool * t * sign,
                    to_tool * r * sign,
                );
            }
        }
        (workpiece.inverse() * tool, jacobian)
    }
}

/// The axes of a branch, and the transformation from the last of them to the frame at its end.
fn links(machine: &Machine, branch: Branch, end: Htm) -> (Links, Htm) {
    let mut before = Htm::identity();
    let axes = machine.axes.iter().enumerate();
    let links = axes
        .filter(|(_, axis)| axis.branch == branch)
        .map(|(index, axis)| {
            let relative = before.inverse() * axis.frame;
            before = axis.frame;
            Link {
                index,
                relative,
                rotary: axis.letter.is_rotary(),
                component: axis.letter.component(),
                sense: if axis.reversed { -1.0 } else { 1.0 },
            }
        })
        .collect();
    (links, before.inverse() * end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Letter};
    use core::f64::consts::FRAC_PI_2;

    #[test]
    fn axes_lie_where_the_axes_before_them_have_carried_them() {
        let mut y = Axis::new(Letter::Y, Branch::Workpiece, [-200.0, 200.0]);
        y.reversed = true;
        let a = Axis::new(Letter::A, Branch::Workpiece, [-90.0, 90.0]);
        let c = Axis::new(Letter::C, Branch::Workpiece, [-90.0, 90.0]);
        let machine = Machine::new(&[
            y,
            a.at([10.0, 20.0, 30.0, 0.0, 0.0, 0.0]),
            c,
            Axis::new(Letter::X, Branch::Tool, [-200.0, 200.0]),
            Axis::new(Letter::Z, Branch::Tool, [-200.0, 200.0]),
        ])
        .unwrap();
        let nominal = Nominal::new(&machine);
        let q = [100.0, FRAC_PI_2, 0.0, 5.0, 7.0, 0.0];
        let line = |axis| nominal.line(&q, axis).unwrap();
        let near = |[point, way]: [Vector3<f64>; 2], expected: [[f64; 3]; 2]| {
            let off = (point - Vector3::from(expected[0])).norm()
                + (way - Vector3::from(expected[1])).norm();
            // A sine and a few products of numbers of size 100.
            assert!(off < 1e-13, "{point} {way}");
        };
        near(line(0), [[0.0, -100.0, 0.0], [0.0, -1.0, 0.0]]);
        near(line(1), [[10.0, -80.0, 30.0], [1.0, 0.0, 0.0]]);
        // The origin of C is (-10, -20, -30) from A's, which turns y to z and z to -y.
        near(line(2), [[0.0, -50.0, 10.0], [0.0, -1.0, 0.0]]);
        near(line(3), [[5.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
        assert!(nominal.line(&q, 5).is_none());
        // The pose of the tool is the spindle seen from the workpiece.
        let carriers = nominal.carriers(&q);
        let pose = carriers.workpiece.inverse() * carriers.spindle;
        let expected = nominal.pose(&q, None);
        assert!((pose.t - expected.t).norm() + (pose.r - expected.r).norm() < 1e-13);
        assert_eq!(carriers.axes[2].t, nominal.line(&q, 2).unwrap()[0]);
    }
}
