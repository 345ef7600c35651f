//! Deviations of the surfaces of a part along their normals.

use super::{Commanded, Given, Instrument, Part, Sample, Seen, Setting};
use nalgebra::{Matrix3, Vector3};

/// Reads n·(turnᵀ·(p − place) − t) − length: how far outwards of its nominal place the surface lies that was cut with the
/// tool point at p. n is the outward normal and t the nominal tool point, less that of the first row, both in the
/// coordinates of the part; place and turn are how the part lies on the machine, and length is how much larger the radius of
/// the tool is than the program assumes.
pub struct Surface;

impl Instrument for Surface {
    fn parts(&self) -> &'static [Part] {
        &[
            Part::Place(0),
            Part::Place(1),
            Part::Place(2),
            Part::Turn(0),
            Part::Turn(1),
            Part::Turn(2),
            Part::Radius,
        ]
    }

    fn reads(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        let point = setting.turn.tr_mul(&(seen.point - setting.place));
        let outwards = commanded.along.dot(&(point - commanded.travel));
        Vector3::new(outwards - setting.length, 0.0, 0.0)
    }

    fn by_point(&self, commanded: &Commanded, setting: &Setting, _: &Seen) -> Matrix3<f64> {
        let mut rows = Matrix3::zeros();
        rows.set_row(0, &(setting.turn * commanded.along).transpose());
        rows
    }

    fn by_part(
        &self,
        commanded: &Commanded,
        setting: &Setting,
        seen: &Seen,
        part: Part,
    ) -> Vector3<f64> {
        let normal = setting.turn * commanded.along;
        let value = match part {
            Part::Place(k) => -normal[k],
            Part::Turn(k) => {
                -normal.dot(&Vector3::ith(k, 1.0).cross(&(seen.point - setting.place)))
            }
            Part::Radius => -1.0,
            Part::Length => 0.0,
        };
        Vector3::new(value, 0.0, 0.0)
    }

    fn start(&self, given: &Given, samples: &[Sample]) -> Setting {
        let mut setting = given.setting();
        if let (None, Some(first)) = (given.place, samples.first()) {
            let Commanded { point, travel, .. } = first.commanded;
            setting.place = point - setting.turn * travel;
        }
        setting
    }
}
