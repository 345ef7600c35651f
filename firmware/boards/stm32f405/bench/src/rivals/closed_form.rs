//! The corrections in closed form (Eq. 59 of the source document, with its misprints corrected as proved in
//! `tests/tests/desktop/eq42.rs`), with the trigonometry of a library.

use super::errors::*;
use super::{DEGREES, TIP};

const R: f32 = core::f32::consts::SQRT_2;

/// Δq at a position, with sine and cosine from `libm`.
#[inline(never)]
pub fn with_libm(q: &[f32; 5]) -> [f32; 5] {
    correction(q, libm::sincosf)
}

/// With the sine and cosine of `micromath`, which are approximations.
#[inline(never)]
pub fn with_micromath(q: &[f32; 5]) -> [f32; 5] {
    correction(q, micromath::F32Ext::sin_cos)
}

/// Δq at a position. The double angle and the squares come from one sine and one cosine.
#[inline(always)]
fn correction(q: &[f32; 5], sin_cos: impl Fn(f32) -> (f32, f32)) -> [f32; 5] {
    let [y, a, _, x, z] = *q;
    let (s, c) = sin_cos(a * (1.0 / DEGREES));
    let (s2, cc, ss) = (2.0 * s * c, c * c, s * s);
    let c2 = cc - ss;
    // From the tip along Z, and along X and Z combined.
    let l = TIP - z;
    let m = l - x;

    let dx = EC0X * (-y * (c2 + 3.0) - R * s2 * l) / 4.0
        + EA0Z * (y * (c2 - 1.0) + R * s2 * l) / 4.0
        + EB0Z * (R * y * s2 / 4.0 - cc * l)
        + EB0A * (cc * l - R * y * s2 / 4.0)
        + EC0A * (R * y * (c2 - 1.0) + 2.0 * s2 * l) / 4.0
        + EY0C * R / 2.0 * s
        + EB0C * (c * l - R / 2.0 * y * s)
        + EX0S
        + EXX1 * x;
    let dy = EC0X * ss * m / 2.0 - EA0Z * ss * m / 2.0 + EB0Z * R * s2 * m / 4.0
        - EB0A * R * s2 * m / 4.0
        - EC0A * R * ss * m / 2.0
        + EY0C * c
        - EB0C * R / 2.0 * s * m
        - EZ0S
        + EYY1 * y;
    let dz = EC0X * (y * (1.0 - c2) - R * x * s2) / 4.0
        + EA0Z * (y * (3.0 + c2) + R * x * s2) / 4.0
        + EB0Z * (x * ss + R * y * s2 / 4.0)
        + EB0A * c * (2.0 * x * c - R * y * s) / 2.0
        + EC0A * (x * s2 - R * y * ss) / 2.0
        - EY0C * R / 2.0 * s
        + EB0C * (x * c - R * y * s / 2.0)
        + EZZ1 * z;
    let da = EC0X * R / 2.0 * (c - 1.0) - EA0Z * R / 2.0 * (c + 1.0) - EB0Z * s + EB0A * s
        - EC0A * c
        + EA0C * R;
    let dc = -EC0X * c + EA0Z * c + EB0Z * R * s - EB0A * R * s + EC0A * R * c - EA0C;
    // The motions equivalent to the errors; the correction reverses them.
    [-dy, -da * DEGREES, -dc * DEGREES, -dx, -dz]
}
