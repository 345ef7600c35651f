//! The alternative to tables: the correction computed from the machine's matrices in every call, as one would write it
//! with `nalgebra`. One step, without iteration.

use nalgebra::{Matrix4, RealField, SMatrix, SVector, Vector3, convert};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Htm;
use trueaxis_model::machine::{Branch, Machine};

/// One axis, with constant factors multiplied in advance.
struct Joint<T> {
    index: usize,
    rotary: bool,
    component: usize,
    /// Relative to the previous frame.
    relative: Matrix4<T>,
    /// With the location error of the axis.
    located: Matrix4<T>,
    /// Scale error along its own direction, per mm.
    scale: T,
}

/// A machine of five axes with location and scale errors.
pub struct Direct<T> {
    workpiece: Vec<Joint<T>>,
    tool: Vec<Joint<T>>,
    /// From the last tool axis to the tip, without and with the spindle's location error.
    tip: [Matrix4<T>; 2],
}

fn matrix<T: RealField + Copy>(pose: &Htm) -> Matrix4<T> {
    let mut m = Matrix4::identity();
    for i in 0..3 {
        for k in 0..3 {
            m[(i, k)] = convert(pose.r[(i, k)]);
        }
        m[(i, 3)] = convert(pose.t[i]);
    }
    m
}

fn motion<T: RealField + Copy>(joint: &Joint<T>, q: T) -> Matrix4<T> {
    let mut m = Matrix4::identity();
    if joint.rotary {
        let (s, c) = q.sin_cos();
        let (j, k) = ((joint.component + 1) % 3, (joint.component + 2) % 3);
        (m[(j, j)], m[(j, k)], m[(k, j)], m[(k, k)]) = (c, -s, s, c);
    } else {
        m[(joint.component, 3)] = q;
    }
    m
}

fn inverse<T: RealField + Copy>(m: &Matrix4<T>) -> Matrix4<T> {
    let r = m.fixed_view::<3, 3>(0, 0).transpose();
    let t = -(r * m.fixed_view::<3, 1>(0, 3));
    let mut inverse = Matrix4::identity();
    inverse.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    inverse.fixed_view_mut::<3, 1>(0, 3).copy_from(&t);
    inverse
}

impl<T: RealField + Copy> Direct<T> {
    /// Takes the location errors and the scales of a model; it must have no others.
    pub fn new(machine: &Machine, errors: &ErrorModel) -> Self {
        let branch = |branch| {
            let mut before = Htm::identity();
            let mut joints = Vec::new();
            for (index, axis) in machine
                .axes
                .iter()
                .enumerate()
                .filter(|(_, a)| a.branch == branch)
            {
                let relative = before.inverse() * axis.frame;
                let component = axis.letter.component();
                let motions = &errors.motions[index];
                joints.push(Joint {
                    index,
                    rotary: axis.letter.is_rotary(),
                    component,
                    relative: matrix(&relative),
                    located: matrix(&(relative * Htm::from_xyz_abc(errors.inter[index]))),
                    scale: convert(
                        motions[component]
                            .coefficients
                            .get(1)
                            .copied()
                            .unwrap_or(0.0),
                    ),
                });
                before = axis.frame;
            }
            (joints, before)
        };
        let (workpiece, _) = branch(Branch::Workpiece);
        let (tool, last) = branch(Branch::Tool);
        let spindle = last.inverse() * machine.spindle;
        let located = spindle
            * Htm::from_xyz_abc(errors.inter_at(machine.axes.len(), &Situation::default().kelvin));
        let tip = Htm::translation(machine.tip.into());
        Self {
            workpiece,
            tool,
            tip: [matrix(&(spindle * tip)), matrix(&(located * tip))],
        }
    }

    /// Δq (mm, deg) at a position (mm, deg).
    pub fn correction(&self, position: &[T; 5]) -> [T; 5] {
        let degree: T = convert(std::f64::consts::PI / 180.0);
        let half: T = convert(0.5);
        let mut nominal = [Matrix4::identity(); 2];
        let mut actual = [Matrix4::identity(); 2];
        let mut frames = [Matrix4::identity(); 5];
        for (b, joints) in [&self.workpiece, &self.tool].into_iter().enumerate() {
            for joint in joints {
                let q = position[joint.index];
                let moved = motion(joint, if joint.rotary { q * degree } else { q });
                nominal[b] = nominal[b] * joint.relative * moved;
                frames[joint.index] = nominal[b];
                let mut error = Matrix4::identity();
                error[(joint.component, 3)] = joint.scale * q;
                actual[b] = actual[b] * joint.located * moved * error;
            }
        }
        let tool = nominal[1] * self.tip[0];
        let from_tool = inverse(&tool);
        let e: Matrix4<T> = from_tool * nominal[0] * inverse(&actual[0]) * actual[1] * self.tip[1];
        let twist = SVector::<T, 6>::from([
            e[(0, 3)],
            e[(1, 3)],
            e[(2, 3)],
            (e[(2, 1)] - e[(1, 2)]) * half,
            (e[(0, 2)] - e[(2, 0)]) * half,
            (e[(1, 0)] - e[(0, 1)]) * half,
        ]);
        // The control Jacobian, in the tool frame at the tip.
        let to_tool = from_tool.fixed_view::<3, 3>(0, 0);
        let tip: Vector3<T> = tool.fixed_view::<3, 1>(0, 3).into_owned();
        let mut jacobian = SMatrix::<T, 6, 5>::zeros();
        for (b, joints) in [&self.workpiece, &self.tool].into_iter().enumerate() {
            for joint in joints {
                let frame = &frames[joint.index];
                let mut along: Vector3<T> =
                    frame.fixed_view::<3, 1>(0, joint.component).into_owned();
                if b == 0 {
                    along = -along;
                }
                let mut column = jacobian.column_mut(joint.index);
                if joint.rotary {
                    let arm = tip - frame.fixed_view::<3, 1>(0, 3);
                    column
                        .fixed_rows_mut::<3>(0)
                        .copy_from(&(to_tool * along.cross(&arm)));
                    column.fixed_rows_mut::<3>(3).copy_from(&(to_tool * along));
                } else {
                    column.fixed_rows_mut::<3>(0).copy_from(&(to_tool * along));
                }
            }
        }
        // Least squares by QR: the normal equations square the condition number, with mm beside rad, and in f32 leave
        // no correct digits.
        let qr = jacobian.qr();
        let right = qr.q().tr_mul(&twist);
        let dq = qr
            .r()
            .solve_upper_triangular(&right)
            .unwrap_or_else(SVector::zeros);
        std::array::from_fn(|i| {
            let joint = self
                .workpiece
                .iter()
                .chain(&self.tool)
                .find(|j| j.index == i);
            if joint.is_some_and(|j| j.rotary) {
                -dq[i] / degree
            } else {
                -dq[i]
            }
        })
    }
}
