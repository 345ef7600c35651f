//! Displacements along one direction.

use super::{
    Commanded, FRAME, InitialSample, Instrument, Seen, Setting, SettingPart, SetupPriors, along,
};
use nalgebra::{Matrix3, Vector3};

/// Reads n·(p − place) − n₀·(p₀ − place₀): how much farther the tool point p has gone along n than commanded. n₀ is
/// the direction of the axis, n the same turned by the alignment of the instrument, in a frame along the linear axes;
/// p₀ is the nominal tool point, place₀ that of the first observation.
pub struct Displacement;

/// The direction in which it reads.
fn direction(commanded: &Commanded, setting: &Setting) -> Vector3<f64> {
    commanded.ways * setting.turn * commanded.ways.tr_mul(&commanded.along)
}

impl Instrument for Displacement {
    fn parts(&self) -> &'static [SettingPart] {
        &FRAME
    }

    fn reads(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        let actual = direction(commanded, setting).dot(&(seen.point - setting.place));
        Vector3::new(actual - commanded.along.dot(&commanded.travel), 0.0, 0.0)
    }

    fn by_point(&self, commanded: &Commanded, setting: &Setting, _: &Seen) -> Matrix3<f64> {
        along(&direction(commanded, setting))
    }

    fn turn_axis(&self, commanded: &Commanded, k: usize) -> Vector3<f64> {
        commanded.ways.column(k).into()
    }

    fn start(&self, given: &SetupPriors, samples: &[InitialSample]) -> Setting {
        let mut setting = given.setting();
        if let (None, Some(first)) = (given.place, samples.first()) {
            let Commanded { point, travel, .. } = first.commanded;
            setting.place = point - travel;
        }
        setting
    }
}
