//! Homogeneous transformation matrices, in mm and rad.

use crate::sine::{sin_cos, sin_cos_of_error};
use core::ops::Mul;
use nalgebra::{Matrix3, Vector3};

/// A rigid-body pose: rotation `r` and translation `t` (mm).
///
/// `Htm { r, t }` maps coordinates of the inner frame into the outer one:
/// `p_outer = r · p_inner + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Htm {
    /// Rotation; its columns are the inner axes expressed in the outer frame.
    pub r: Matrix3<f64>,
    /// Translation (mm): the inner origin in the outer frame.
    pub t: Vector3<f64>,
}

impl Htm {
    /// The identity pose.
    #[must_use]
    #[inline]
    pub fn identity() -> Self {
        Self {
            r: Matrix3::identity(),
            t: Vector3::zeros(),
        }
    }

    /// A pure translation (mm).
    #[must_use]
    #[inline]
    pub fn translation(t: Vector3<f64>) -> Self {
        Self {
            r: Matrix3::identity(),
            t,
        }
    }

    /// Trans(x, y, z) · Rx(a) · Ry(b) · Rz(c): the pose defined by an error `[x y z a b c]` (mm, rad), or by a frame's
    /// origin and orientation.
    #[must_use]
    #[inline]
    pub fn from_xyz_abc([x, y, z, a, b, c]: [f64; 6]) -> Self {
        let [(sa, ca), (sb, cb), (sc, cc)] = [a, b, c].map(sin_cos_of_error);
        Self {
            r: Matrix3::new(
                cb * cc,
                -cb * sc,
                sb,
                ca * sc + sa * sb * cc,
                ca * cc - sa * sb * sc,
                -sa * cb,
                sa * sc - ca * sb * cc,
                sa * cc + ca * sb * sc,
                ca * cb,
            ),
            t: Vector3::new(x, y, z),
        }
    }

    /// The inverse pose.
    #[must_use]
    #[inline]
    pub fn inverse(&self) -> Self {
        let r = self.r.transpose();
        Self {
            r,
            t: -(r * self.t),
        }
    }

    /// Moves the inner frame by `distance` mm along its own axis `component`.
    #[must_use]
    #[inline]
    pub(crate) fn translated_along(mut self, component: usize, distance: f64) -> Self {
        self.t += self.r.column(component) * distance;
        self
    }

    /// Turns the inner frame by `angle` rad about its own axis `component`.
    #[must_use]
    #[inline]
    pub(crate) fn rotated_about(mut self, component: usize, angle: f64) -> Self {
        let (s, c) = sin_cos(angle);
        let (j, k) = ((component + 1) % 3, (component + 2) % 3);
        let (u, v) = (self.r.column(j).into_owned(), self.r.column(k).into_owned());
        self.r.set_column(j, &(u * c + v * s));
        self.r.set_column(k, &(v * c - u * s));
        self
    }

    /// The twist `[x y z a b c]` of a small displacement: its translation (mm)
    /// and the antisymmetric part of its rotation (rad).
    #[must_use]
    #[inline]
    pub fn twist(&self) -> Twist {
        let r = &self.r;
        Twist {
            t: self.t,
            r: Vector3::new(
                0.5 * (r[(2, 1)] - r[(1, 2)]),
                0.5 * (r[(0, 2)] - r[(2, 0)]),
                0.5 * (r[(1, 0)] - r[(0, 1)]),
            ),
        }
    }
}

/// A column in the outer frame. Written out: the loops of nalgebra are not inlined.
#[inline]
fn turned(r: &Matrix3<f64>, [x, y, z]: [f64; 3]) -> Vector3<f64> {
    Vector3::new(
        r.m11 * x + r.m12 * y + r.m13 * z,
        r.m21 * x + r.m22 * y + r.m23 * z,
        r.m31 * x + r.m32 * y + r.m33 * z,
    )
}

/// A point of the inner frame in the outer one.
#[inline]
fn outside(frame: &Htm, point: [f64; 3]) -> Vector3<f64> {
    turned(&frame.r, point) + frame.t
}

impl Mul for Htm {
    type Output = Htm;
    #[inline]
    fn mul(self, inner: Htm) -> Htm {
        let [x, y, z]: [[f64; 3]; 3] = inner.r.into();
        let columns = [turned(&self.r, x), turned(&self.r, y), turned(&self.r, z)];
        Htm {
            r: Matrix3::from_columns(&columns),
            t: outside(&self, inner.t.into()),
        }
    }
}

/// A small displacement: translation (mm) and rotation (rad) in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Translation x, y, z (mm).
    pub t: Vector3<f64>,
    /// Rotation a, b, c about x, y, z (rad).
    pub r: Vector3<f64>,
}

impl Twist {
    /// The twist as `[x y z a b c]` (mm, rad).
    #[must_use]
    pub fn to_array(self) -> [f64; 6] {
        [self.t.x, self.t.y, self.t.z, self.r.x, self.r.y, self.r.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_trans_then_rx_ry_rz() {
        let e = [1.0, 2.0, 3.0, 0.3, -0.2, 0.5];
        let step_by_step = Htm::translation(Vector3::new(1.0, 2.0, 3.0))
            .rotated_about(0, 0.3)
            .rotated_about(1, -0.2)
            .rotated_about(2, 0.5);
        let at_once = Htm::from_xyz_abc(e);
        // The same dozen products in two different orders: a few units in the last place.
        assert!((step_by_step.r - at_once.r).abs().max() < 1e-15);
        assert_eq!(step_by_step.t, at_once.t);
    }

    #[test]
    fn the_inverse_undoes_the_pose() {
        let p = Htm::from_xyz_abc([100.0, -20.0, 3.0, 1.0, -0.7, 2.0]);
        let id = p.inverse() * p;
        assert!((id.r - Matrix3::identity()).abs().max() < 1e-15);
        assert!(id.t.abs().max() < 1e-13);
    }
}
