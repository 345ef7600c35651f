//! The control Jacobian and its block solution.

use crate::{MAX_AXES, PerAxis, Policy, Twist};
use nalgebra::{ComplexField, Matrix3, Vector3};

/// Columns of the control Jacobian: the twist of the tool per mm or rad of each axis.
#[derive(Clone, Copy, Debug)]
pub struct Jacobian {
    count: usize,
    /// The tool axis: 0, 1, 2 for x, y, z of the tool frame.
    tool_axis: usize,
    rotary: [bool; MAX_AXES],
    t: [Vector3<f64>; MAX_AXES],
    r: [Vector3<f64>; MAX_AXES],
}

/// Solves J·Δq = −E at one position for any number of right-hand sides.
#[derive(Clone, Copy, Debug)]
pub struct BlockSolver {
    jacobian: Jacobian,
    /// P: which rotations about x, y and z count (1 or 0).
    counts: Vector3<f64>,
    /// λ².
    damping: f64,
    /// (Jrᵀ·P·Jr + λ²)⁻¹ over the rotary axes, in their order; zero if they are not corrected.
    gram_inverse: Matrix3<f64>,
    /// (Jl·Jlᵀ)⁻¹ over the linear axes.
    linear_inverse: Matrix3<f64>,
}

impl Jacobian {
    pub(crate) fn new(count: usize, tool_axis: usize) -> Self {
        Self {
            count,
            tool_axis,
            rotary: [false; MAX_AXES],
            t: [Vector3::zeros(); MAX_AXES],
            r: [Vector3::zeros(); MAX_AXES],
        }
    }

    pub(crate) fn set(&mut self, index: usize, rotary: bool, t: Vector3<f64>, r: Vector3<f64>) {
        self.rotary[index] = rotary;
        self.t[index] = t;
        self.r[index] = r;
    }

    /// The column of an axis, `[x y z a b c]` per mm or rad.
    #[must_use]
    pub fn column(&self, axis: usize) -> [f64; 6] {
        Twist {
            t: self.t[axis],
            r: self.r[axis],
        }
        .to_array()
    }

    /// The movement of the tip (mm) due to small motions of all axes (mm, rad), and the rotation of the tool
    /// perpendicular to its axis (rad).
    #[must_use]
    pub fn moved(&self, motion: &PerAxis) -> [f64; 2] {
        let (mut t, mut r) = (Vector3::zeros(), Vector3::zeros());
        for (i, way) in motion.iter().enumerate().take(self.count) {
            t += self.t[i] * *way;
            r += self.r[i] * *way;
        }
        r[self.tool_axis] = 0.0;
        [t.norm(), r.norm()]
    }

    fn rotary_axes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count).filter(|i| self.rotary[*i])
    }

    fn linear_axes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.count).filter(|i| !self.rotary[*i])
    }

    /// Independence of the linear directions: the volume of the best three of them, 1 if these are orthogonal, 0 if
    /// there is no motion in some direction.
    ///
    /// Parallel axes (a quill) increase √det(Jl·Jlᵀ), but make none of the directions better determined.
    #[must_use]
    pub(crate) fn linear_volume(&self) -> f64 {
        let mut largest = 0.0_f64;
        for i in self.linear_axes() {
            for j in self.linear_axes().filter(|j| *j > i) {
                let plane = self.t[i].cross(&self.t[j]);
                for k in self.linear_axes().filter(|k| *k > j) {
                    largest = largest.max(ComplexField::abs(plane.dot(&self.t[k])));
                }
            }
        }
        largest
    }

    /// Independence of the rotary directions: √det(Jrᵀ·Jr), 1 if they are orthogonal or fewer than two.
    #[must_use]
    pub(crate) fn rotary_volume(&self) -> f64 {
        ComplexField::sqrt(self.gram(&Vector3::repeat(1.0)).determinant().max(0.0))
    }

    /// A pair of rotary axes whose directions differ by less than about `limit` rad.
    #[must_use]
    pub(crate) fn parallel_rotary_axes(&self, limit: f64) -> Option<(usize, usize)> {
        for i in self.rotary_axes() {
            for j in self.rotary_axes().filter(|j| *j > i) {
                if self.r[i].cross(&self.r[j]).norm() < limit {
                    return Some((i, j));
                }
            }
        }
        None
    }

    /// Jrᵀ·P·Jr over the rotary axes, in their order; `counts` is P.
    fn gram(&self, counts: &Vector3<f64>) -> Matrix3<f64> {
        let mut gram = Matrix3::identity();
        for (a, i) in self.rotary_axes().enumerate() {
            for (b, j) in self.rotary_axes().enumerate() {
                gram[(a, b)] = self.r[i].dot(&self.r[j].component_mul(counts));
            }
        }
        gram
    }

    fn linear_square(&self) -> Matrix3<f64> {
        self.linear_axes()
            .map(|i| self.t[i] * self.t[i].transpose())
            .sum()
    }

    /// Prepares the block solution: the rotary axes solve the rotation rows according to the policy, then the linear
    /// axes make the translation rows exact (minimum norm if there are more than three). Under [`Policy::Orientation`]
    /// it equals the six-row pseudo-inverse whenever the linear axes span space.
    ///
    /// `None` if the axes are dependent here (refused by [`crate::Machine::check`]).
    #[must_use]
    pub fn solver(&self, policy: Policy) -> Option<BlockSolver> {
        let all = Vector3::repeat(1.0);
        let (counts, damping) = match policy {
            Policy::Direction { damping } => {
                let mut across = all;
                across[self.tool_axis] = 0.0;
                (across, damping * damping)
            }
            Policy::Orientation | Policy::Position => (all, 0.0),
        };
        let gram_inverse = match policy {
            Policy::Position => Matrix3::zeros(),
            _ => {
                let mut gram = self.gram(&counts);
                for (a, _) in self.rotary_axes().enumerate() {
                    gram[(a, a)] += damping;
                }
                gram.try_inverse()?
            }
        };
        Some(BlockSolver {
            jacobian: *self,
            counts,
            damping,
            gram_inverse,
            linear_inverse: self.linear_square().try_inverse()?,
        })
    }
}

impl BlockSolver {
    /// The motion Δq (mm, rad) that is equivalent to −`error`, as far as the policy requires.
    #[must_use]
    pub fn correct(&self, error: &Twist) -> PerAxis {
        self.step(error, &PerAxis::default())
    }

    /// The change to a correction `dq` (mm, rad) that leaves `error`.
    #[must_use]
    pub fn step(&self, error: &Twist, dq: &PerAxis) -> PerAxis {
        let jacobian = &self.jacobian;
        let counted = error.r.component_mul(&self.counts);
        let mut rows = Vector3::zeros();
        for (a, i) in jacobian.rotary_axes().enumerate() {
            rows[a] = jacobian.r[i].dot(&counted) + self.damping * dq[i];
        }
        let rotary = self.gram_inverse * rows;
        let mut correction = PerAxis::default();
        let mut rest = error.t;
        for (a, i) in jacobian.rotary_axes().enumerate() {
            correction[i] = -rotary[a];
            rest -= jacobian.t[i] * rotary[a];
        }
        let image = self.linear_inverse * rest;
        for i in jacobian.linear_axes() {
            correction[i] = -jacobian.t[i].dot(&image);
        }
        correction
    }
}
