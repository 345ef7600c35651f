//! Angles about one axis.

use super::{Commanded, Instrument, LEVER, Seen, Setting, SettingPart};
use nalgebra::{Matrix3, Vector3};

/// Reads the rotation of the tool in excess of the commanded one about an axis, from the orientation at which it was
/// set to zero: m·twist(T·turnᵀ), over [`LEVER`]. T is the excess rotation. Derivatives are exact
/// at zero; readings are small.
pub struct Angle;

impl Instrument for Angle {
    fn parts(&self) -> &'static [SettingPart] {
        &[
            SettingPart::Turn(0),
            SettingPart::Turn(1),
            SettingPart::Turn(2),
        ]
    }

    fn reads(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        let r = seen.turn * setting.turn.transpose();
        let twist = Vector3::new(
            r[(2, 1)] - r[(1, 2)],
            r[(0, 2)] - r[(2, 0)],
            r[(1, 0)] - r[(0, 1)],
        );
        Vector3::new(0.5 * LEVER * commanded.along.dot(&twist), 0.0, 0.0)
    }

    fn by_point(&self, _: &Commanded, _: &Setting, _: &Seen) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    fn about(&self, commanded: &Commanded) -> Option<Vector3<f64>> {
        Some(commanded.along)
    }
}
