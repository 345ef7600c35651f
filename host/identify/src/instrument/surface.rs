//! Deviations of the surfaces of a part along their normals.

use super::{Commanded, InitialSample, Instrument, Seen, Setting, SettingPart, SetupPriors, along};
use nalgebra::{Matrix3, Vector3};

/// Reads n·(turnᵀ·(p − place) − t) − length: how far outwards of its nominal place the surface lies that was cut with the
/// tool point at p. n is the outward normal and t the nominal tool point, less that of the first row, both in the
/// coordinates of the part; place and turn are how the part lies on the machine, and length is how much larger the radius of
/// the tool is than the program assumes.
pub struct Surface;

impl Instrument for Surface {
    fn parts(&self) -> &'static [SettingPart] {
        &[
            SettingPart::Place(0),
            SettingPart::Place(1),
            SettingPart::Place(2),
            SettingPart::Turn(0),
            SettingPart::Turn(1),
            SettingPart::Turn(2),
            SettingPart::Radius,
        ]
    }

    fn reads(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        let point = setting.turn.tr_mul(&(seen.point - setting.place));
        let outwards = commanded.along.dot(&(point - commanded.travel));
        Vector3::new(outwards - setting.length, 0.0, 0.0)
    }

    fn by_point(&self, commanded: &Commanded, setting: &Setting, _: &Seen) -> Matrix3<f64> {
        along(&(setting.turn * commanded.along))
    }

    fn start(&self, given: &SetupPriors, samples: &[InitialSample]) -> Setting {
        let mut setting = given.setting();
        if let (None, Some(first)) = (given.place, samples.first()) {
            let Commanded { point, travel, .. } = first.commanded;
            setting.place = point - setting.turn * travel;
        }
        setting
    }
}
