//! Points in the frame of an instrument.

use super::{Commanded, FRAME, InitialSample, Instrument, Seen, Setting, SettingPart, SetupPriors};
use nalgebra::{Matrix3, Vector3};

/// Reads turnᵀ·(p − place): the tool point p in a frame at `place` with the orientation `turn`.
pub struct Point;

/// If nominal points are closer than this (mm), the readings are errors alone and do not show the orientation.
const SPREAD: f64 = 1.0;

impl Instrument for Point {
    fn parts(&self) -> &'static [SettingPart] {
        &FRAME
    }

    fn reads(&self, _: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        setting.turn.tr_mul(&(seen.point - setting.place))
    }

    fn by_point(&self, _: &Commanded, setting: &Setting, _: &Seen) -> Matrix3<f64> {
        setting.turn.transpose()
    }

    /// The rotation and translation that fit points best (Kabsch).
    fn start(&self, given: &SetupPriors, samples: &[InitialSample]) -> Setting {
        let mut setting = given.setting();
        let count = samples.len().max(1) as f64;
        let mean = |of: fn(&InitialSample) -> Vector3<f64>| {
            samples.iter().map(of).sum::<Vector3<f64>>() / count
        };
        let (points, readings) = (mean(|s| s.commanded.point), mean(|s| s.read));
        let mut product = Matrix3::zeros();
        let mut spread: f64 = 0.0;
        for sample in samples {
            let point = sample.commanded.point - points;
            spread = spread.max(point.norm());
            product += point * (sample.read - readings).transpose();
        }
        let svd = product.svd(true, true);
        if let (None, None, Some(u), Some(v_t)) = (given.turn, given.turn_sigma, svd.u, svd.v_t)
            && spread > SPREAD
        {
            let mut hand = Matrix3::identity();
            // Of the smallest singular value, which is the last.
            hand[(2, 2)] = (u * v_t).determinant().signum();
            setting.turn = u * hand * v_t;
        }
        setting.place = points - setting.turn * readings;
        setting
    }
}
