//! The correction from the machine's matrices in every call, as one would write it with `nalgebra`: f32, one step,
//! without iteration, with arrays.

use super::errors::*;
use super::{DEGREES, TIP};
use nalgebra::{Matrix3, Matrix4, Rotation3, SMatrix, SVector, Vector3};

/// One axis, with constant factors multiplied in advance.
struct Joint {
    index: usize,
    rotary: bool,
    component: usize,
    /// Relative to the previous frame.
    relative: Matrix4<f32>,
    /// With the location error of the axis.
    located: Matrix4<f32>,
    /// Scale error along its own direction, per mm.
    scale: f32,
}

/// The Huron K2X8-Five with its thirteen errors.
pub struct Direct {
    workpiece: [Joint; 3],
    tool: [Joint; 2],
    /// From the last tool axis to the tip, without and with the spindle's location error.
    tip: [Matrix4<f32>; 2],
}

fn about(x: f32, y: f32, z: f32) -> Matrix4<f32> {
    let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
    let r = turn(Vector3::x_axis(), x) * turn(Vector3::y_axis(), y) * turn(Vector3::z_axis(), z);
    r.to_homogeneous()
}

/// Trans(x, y, z)·Rx(a)·Ry(b)·Rz(c)
fn error(t: [f32; 3], r: [f32; 3]) -> Matrix4<f32> {
    Matrix4::new_translation(&Vector3::from(t)) * about(r[0], r[1], r[2])
}

fn motion(joint: &Joint, q: f32) -> Matrix4<f32> {
    let mut m = Matrix4::identity();
    if joint.rotary {
        let (s, c) = libm::sincosf(q);
        let (j, k) = ((joint.component + 1) % 3, (joint.component + 2) % 3);
        (m[(j, j)], m[(j, k)], m[(k, j)], m[(k, k)]) = (c, -s, s, c);
    } else {
        m[(joint.component, 3)] = q;
    }
    m
}

fn inverse(m: &Matrix4<f32>) -> Matrix4<f32> {
    let r: Matrix3<f32> = m.fixed_view::<3, 3>(0, 0).transpose();
    let t = -(r * m.fixed_view::<3, 1>(0, 3));
    let mut inverse = Matrix4::identity();
    inverse.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    inverse.fixed_view_mut::<3, 1>(0, 3).copy_from(&t);
    inverse
}

impl Direct {
    pub fn new() -> Self {
        let joint = |index, rotary, component, relative: Matrix4<f32>, located, scale| Joint {
            index,
            rotary,
            component,
            relative,
            located: relative * located,
            scale,
        };
        let (none, quarter) = ([0.0; 3], core::f32::consts::FRAC_PI_4);
        let straight = Matrix4::identity();
        let tilt = about(0.0, -quarter, 0.0);
        let back = about(0.0, quarter, 0.0);
        let spindle = about(-2.0 * quarter, 0.0, 0.0);
        let located = spindle * error([EX0S, 0.0, EZ0S], none);
        let tip = Matrix4::new_translation(&Vector3::new(0.0, TIP, 0.0));
        Self {
            workpiece: [
                joint(0, false, 1, straight, straight, EYY1),
                joint(1, true, 0, tilt, error(none, [0.0, EB0A, EC0A]), 0.0),
                joint(
                    2,
                    true,
                    2,
                    back,
                    error([0.0, EY0C, 0.0], [EA0C, EB0C, 0.0]),
                    0.0,
                ),
            ],
            tool: [
                joint(3, false, 0, straight, error(none, [0.0, 0.0, EC0X]), EXX1),
                joint(4, false, 2, straight, error(none, [EA0Z, EB0Z, 0.0]), EZZ1),
            ],
            tip: [spindle * tip, located * tip],
        }
    }

    /// Δq at a position.
    #[inline(never)]
    pub fn correction(&self, position: &[f32; 5]) -> [f32; 5] {
        let mut nominal = [Matrix4::identity(); 2];
        let mut actual = [Matrix4::identity(); 2];
        let mut frames = [Matrix4::identity(); 5];
        for (b, joints) in [&self.workpiece[..], &self.tool].into_iter().enumerate() {
            for joint in joints {
                let q = position[joint.index];
                let moved = motion(joint, if joint.rotary { q / DEGREES } else { q });
                nominal[b] = nominal[b] * joint.relative * moved;
                frames[joint.index] = nominal[b];
                let mut error = Matrix4::identity();
                error[(joint.component, 3)] = joint.scale * q;
                actual[b] = actual[b] * joint.located * moved * error;
            }
        }
        let tool = nominal[1] * self.tip[0];
        let from_tool = inverse(&tool);
        let e = from_tool * nominal[0] * inverse(&actual[0]) * actual[1] * self.tip[1];
        let twist = SVector::<f32, 6>::from([
            e[(0, 3)],
            e[(1, 3)],
            e[(2, 3)],
            (e[(2, 1)] - e[(1, 2)]) * 0.5,
            (e[(0, 2)] - e[(2, 0)]) * 0.5,
            (e[(1, 0)] - e[(0, 1)]) * 0.5,
        ]);
        // The control Jacobian, in the tool frame at the tip.
        let to_tool = from_tool.fixed_view::<3, 3>(0, 0);
        let tip: Vector3<f32> = tool.fixed_view::<3, 1>(0, 3).into_owned();
        let mut jacobian = SMatrix::<f32, 6, 5>::zeros();
        for (b, joints) in [&self.workpiece[..], &self.tool].into_iter().enumerate() {
            for joint in joints {
                let frame = &frames[joint.index];
                let mut along: Vector3<f32> =
                    frame.fixed_view::<3, 1>(0, joint.component).into_owned();
                if b == 0 {
                    along = -along;
                }
                let mut column = jacobian.column_mut(joint.index);
                if joint.rotary {
                    let arm = tip - frame.fixed_view::<3, 1>(0, 3);
                    let lever = to_tool * along.cross(&arm);
                    column.fixed_rows_mut::<3>(0).copy_from(&lever);
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
        [-dq[0], -dq[1] * DEGREES, -dq[2] * DEGREES, -dq[3], -dq[4]]
    }
}
