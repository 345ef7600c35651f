//! Angles about one axis.

use super::{Commanded, InitialSample, Instrument, LEVER, Seen, Setting, SettingPart, SetupPriors};
use nalgebra::{Matrix3, Vector3};

/// Reads the rotation of the tool in excess of the commanded one about an axis, from the orientation at which it was
/// set to zero: m·twist(T·turnᵀ), over [`LEVER`]. T is the excess rotation.
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

    /// Exact at zero; readings are small.
    fn by_part(
        &self,
        commanded: &Commanded,
        _: &Setting,
        _: &Seen,
        part: SettingPart,
    ) -> Vector3<f64> {
        let value = match part {
            SettingPart::Turn(k) => -LEVER * commanded.along[k],
            SettingPart::Place(_) | SettingPart::Length | SettingPart::Radius => 0.0,
        };
        Vector3::new(value, 0.0, 0.0)
    }

    fn start(&self, given: &SetupPriors, _: &[InitialSample]) -> Setting {
        given.setting()
    }
}
