//! Distances from a point of the workpiece.

use super::{Commanded, InitialSample, Instrument, Seen, Setting, SettingPart, SetupPriors, along};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_model::numbers::extremes;

/// Reads |p − place| − length: from its centre on the workpiece to the tool point p, less a dead length.
pub struct LengthReading;

/// If lengths vary by less than this part of the longest, they do not show the dead length to start with.
const VARIES: f64 = 0.05;
/// Singular values below this part of the largest are rounding.
const ROUNDING: f64 = 1e-9;

/// The direction from the centre to the tool point.
fn outwards(setting: &Setting, seen: &Seen) -> Vector3<f64> {
    let way = (seen.point - setting.place).try_normalize(0.0);
    way.unwrap_or_default()
}

impl Instrument for LengthReading {
    fn parts(&self) -> &'static [SettingPart] {
        &[
            SettingPart::Place(0),
            SettingPart::Place(1),
            SettingPart::Place(2),
            SettingPart::Length,
        ]
    }

    fn reads(&self, _: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64> {
        let distance = (seen.point - setting.place).norm();
        Vector3::new(distance - setting.length, 0.0, 0.0)
    }

    fn by_point(&self, _: &Commanded, setting: &Setting, seen: &Seen) -> Matrix3<f64> {
        along(&outwards(setting, seen))
    }

    /// The centre c and dead length d for which (p − c)² = (l + d)², a linear problem: 2 c·p + 2 d·l + e = p² − l².
    /// What the positions do not show is at their mean: for a circle, its plane.
    fn start(&self, given: &SetupPriors, samples: &[InitialSample]) -> Setting {
        let mut setting = given.setting();
        if given.place.is_some() || samples.is_empty() {
            return setting;
        }
        let count = samples.len() as f64;
        let mean = (samples.iter())
            .map(|s| s.commanded.point)
            .sum::<Vector3<f64>>()
            / count;
        let lengths: Vec<f64> = samples.iter().map(|s| s.read.x + setting.length).collect();
        let [low, high] = extremes(lengths.iter().copied());
        let is_shown = given.length_sigma.is_none() && high - low > VARIES * high.abs();
        let mut matrix = DMatrix::zeros(samples.len(), 5);
        let mut right = DVector::zeros(samples.len());
        for (i, (sample, length)) in samples.iter().zip(&lengths).enumerate() {
            let p = sample.commanded.point - mean;
            for k in 0..3 {
                matrix[(i, k)] = 2.0 * p[k];
            }
            matrix[(i, 3)] = if is_shown { 2.0 * length } else { 0.0 };
            matrix[(i, 4)] = 1.0;
            right[i] = p.norm_squared() - length * length;
        }
        let sizes: Vec<f64> = matrix.column_iter().map(|c| c.norm().max(1e-9)).collect();
        for (mut column, size) in matrix.column_iter_mut().zip(&sizes) {
            column /= *size;
        }
        if let Ok(found) = matrix.svd(true, true).solve(&right, ROUNDING) {
            let at = |k: usize| found[k] / sizes[k];
            setting.place = mean + Vector3::new(at(0), at(1), at(2));
            setting.length += at(3);
        }
        setting
    }
}
