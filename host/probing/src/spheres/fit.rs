//! Least-squares spheres through touches; each ball has one radius in all of its probings.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_model::numbers::ascending;

/// A probing: the positions of the stylus centre when it touched a ball (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct Centre {
    /// Index of the ball.
    pub ball: usize,
    /// The points.
    pub touches: Vec<Vector3<f64>>,
}

/// Fitted spheres.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedBalls {
    /// The centre of each probing (mm).
    pub centres: Vec<Vector3<f64>>,
    /// Distance from the centre of each ball to that of the stylus tip (mm): the sum of both radii.
    pub radii: Vec<f64>,
    /// Residual of each touch of each probing: its distance from the centre minus that (mm).
    pub left: Vec<Vec<f64>>,
    /// Standard deviation of a touch (mm), from the median of the residuals.
    pub noise: f64,
    /// Touches that do not fit, by probing: one of those listed is wrong, but the residuals cannot separate them.
    pub doubtful: Vec<(usize, Vec<usize>)>,
}

/// Why no sphere can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the touches of probing {probing} are no part of a sphere")]
pub struct FitError {
    /// The probing, counted from 0.
    pub probing: usize,
}

/// Singular values of directions below this count as zero: touches in a plane.
const FLAT: f64 = 1e-3;
/// Largest number of Gauss–Newton steps; each reduces the error by a factor of the last step divided by the radius.
const STEPS: usize = 50;
const STILL: f64 = 1e-10;
/// The median of the absolute value of a standard normal number.
const MEDIAN: f64 = 0.6745;
/// Distance, in standard deviations, from which a touch is reported, as for rows in `identify`.
const DISTRUSTED: f64 = 5.0;
/// Smaller deviations (mm) do not matter: probes repeat to 1 µm.
const LEAST: f64 = 1e-3;
/// A fit has converged if its last step was smaller than this (mm).
const ENDED: f64 = 1e-6;
/// Touches whose distances, in standard deviations, differ by less than this fraction cannot be separated.
const ALIKE: f64 = 0.01;

/// Fits a sphere to each probing, with a known `radius` (mm) or one for each of the `balls`.
///
/// # Errors
/// [`FitError`]: fewer than four points, or points that do not determine a sphere.
pub fn fit(
    probings: &[Centre],
    balls: usize,
    radius: Option<f64>,
) -> Result<FittedBalls, FitError> {
    let mut centres = Vec::new();
    let mut radii = vec![(0.0, 0.0); balls];
    for (number, probing) in probings.iter().enumerate() {
        let (centre, found) = start(&probing.touches).ok_or(FitError { probing: number })?;
        centres.push(centre);
        radii[probing.ball].0 += found;
        radii[probing.ball].1 += 1.0;
    }
    let mut radii: Vec<f64> = (radii.into_iter())
        .map(|(sum, count)| radius.unwrap_or(sum / count))
        .collect();
    let mut largest = f64::INFINITY;
    for _ in 0..STEPS {
        if largest < STILL {
            break;
        }
        largest = 0.0;
        // First the radius of each ball, from its equations with the centres eliminated.
        let mut sums = vec![(0.0, 0.0); balls];
        let mut parts = Vec::new();
        for (number, (probing, centre)) in probings.iter().zip(&centres).enumerate() {
            let part = SphereEquations::new(&probing.touches, centre, radii[probing.ball]);
            let part = part.ok_or(FitError { probing: number })?;
            let (square, product) = part.of_radius();
            sums[probing.ball].0 += square;
            sums[probing.ball].1 += product;
            parts.push(part);
        }
        let mut steps = vec![0.0; balls];
        if radius.is_none() {
            for ((step, radius), (square, product)) in steps.iter_mut().zip(&mut radii).zip(sums) {
                *step = if square > FLAT { product / square } else { 0.0 };
                *radius += *step;
                largest = largest.max(step.abs());
            }
        }
        for ((probing, centre), part) in probings.iter().zip(&mut centres).zip(&parts) {
            let step = part.of_centre(steps[probing.ball]);
            *centre += step;
            largest = largest.max(step.norm());
        }
    }
    if let Some(probing) = (0..probings.len()).find(|_| largest > ENDED) {
        return Err(FitError { probing });
    }
    Ok(told(probings, centres, radii))
}

/// A sphere by its linear equation |p|² = 2·c·p + k.
pub(crate) fn start(touches: &[Vector3<f64>]) -> Option<(Vector3<f64>, f64)> {
    if touches.len() < 4 {
        return None;
    }
    let mean = touches.iter().sum::<Vector3<f64>>() / touches.len() as f64;
    let size = (touches.iter())
        .map(|p| (p - mean).norm())
        .fold(0.0, f64::max);
    let points: Vec<Vector3<f64>> = touches.iter().map(|p| (p - mean) / size).collect();
    let equations = DMatrix::from_fn(points.len(), 4, |i, j| match j {
        3 => 1.0,
        j => 2.0 * points[i][j],
    });
    let squares = DVector::from_iterator(points.len(), points.iter().map(Vector3::norm_squared));
    let svd = equations.svd(true, true);
    if svd.singular_values.min() <= FLAT || squares.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let found = svd.solve(&squares, 0.0).ok()?;
    let centre = Vector3::new(found[0], found[1], found[2]);
    let radius = (found[3] + centre.norm_squared()).sqrt();
    radius
        .is_finite()
        .then_some((mean + centre * size, radius * size))
}

/// The equations of one probing, |p − c| − R = 0, at a given centre and radius.
struct SphereEquations {
    /// Unit vectors from the centre to each touch.
    out: Vec<Vector3<f64>>,
    left: Vec<f64>,
    inverse: Matrix3<f64>,
}

impl SphereEquations {
    fn new(touches: &[Vector3<f64>], centre: &Vector3<f64>, radius: f64) -> Option<Self> {
        let ways = touches.iter().map(|p| p - centre);
        let out: Option<Vec<Vector3<f64>>> = ways.clone().map(|w| w.try_normalize(1e-9)).collect();
        let out = out?;
        let square: Matrix3<f64> = out.iter().map(|u| u * u.transpose()).sum();
        (square.symmetric_eigenvalues().min() > FLAT).then_some(())?;
        Some(Self {
            left: ways.map(|w| w.norm() - radius).collect(),
            inverse: square.try_inverse()?,
            out,
        })
    }

    /// Products of the radius column, with the centre eliminated, with itself and with the residuals.
    fn of_radius(&self) -> (f64, f64) {
        let sum: Vector3<f64> = self.out.iter().sum();
        let moved: Vector3<f64> = self.out.iter().zip(&self.left).map(|(u, r)| u * *r).sum();
        let with = self.inverse * sum;
        let all: f64 = self.left.iter().sum();
        (
            self.out.len() as f64 - sum.dot(&with),
            all - moved.dot(&with),
        )
    }

    /// The step of the centre for a given step of the radius.
    fn of_centre(&self, radius: f64) -> Vector3<f64> {
        let rows = self.out.iter().zip(&self.left);
        let moved: Vector3<f64> = rows.map(|(u, r)| u * (r - radius)).sum();
        self.inverse * moved
    }

    /// The leverage of each touch on the centre.
    fn followed(&self) -> Vec<f64> {
        (self.out.iter())
            .map(|u| u.dot(&(self.inverse * u)))
            .collect()
    }
}

/// The residuals, and which touches do not fit.
fn told(probings: &[Centre], centres: Vec<Vector3<f64>>, radii: Vec<f64>) -> FittedBalls {
    let mut left = Vec::new();
    let mut scaled: Vec<Vec<f64>> = Vec::new();
    for (probing, centre) in probings.iter().zip(&centres) {
        let (of, by) = match SphereEquations::new(&probing.touches, centre, radii[probing.ball]) {
            Some(part) => {
                let followed = part.followed();
                let scaled = part.left.iter().zip(&followed);
                // A touch that the centre follows completely contains no information.
                let scaled = scaled.map(|(r, h)| {
                    if 1.0 - h > FLAT {
                        r.abs() / (1.0 - h).sqrt()
                    } else {
                        0.0
                    }
                });
                (part.left.clone(), scaled.collect())
            }
            None => (Vec::new(), Vec::new()),
        };
        left.push(of);
        scaled.push(by);
    }
    let mut all: Vec<f64> = scaled.iter().flatten().copied().collect();
    ascending(&mut all);
    let noise = all.get(all.len() / 2).map_or(0.0, |median| median / MEDIAN);
    let limit = (DISTRUSTED * noise).max(LEAST);
    let doubtful = scaled.iter().enumerate().filter_map(|(number, distances)| {
        let most = distances.iter().copied().fold(0.0, f64::max);
        let alike = (0..distances.len()).filter(|i| distances[*i] >= most * (1.0 - ALIKE));
        (most > limit).then(|| (number, alike.collect()))
    });
    FittedBalls {
        doubtful: doubtful.collect(),
        centres,
        radii,
        left,
        noise,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The five touches of a ball: at the pole and at 30° above the equator.
    fn touches(centre: Vector3<f64>, radius: f64, off: [f64; 5]) -> Vec<Vector3<f64>> {
        let out = |k: usize| match k {
            0 => Vector3::z(),
            k => {
                let turn = (k as f64 - 0.5) * std::f64::consts::FRAC_PI_2;
                Vector3::new(
                    libm::cos(turn) * 0.75_f64.sqrt(),
                    libm::sin(turn) * 0.75_f64.sqrt(),
                    0.5,
                )
            }
        };
        (0..5)
            .map(|k| centre + out(k) * (radius + off[k]))
            .collect()
    }

    fn probings(off: impl Fn(usize) -> [f64; 5]) -> Vec<Centre> {
        let probing = |i: usize| Centre {
            ball: i % 2,
            touches: touches(place(i), [10.5, 6.25][i % 2], off(i)),
        };
        (0..20).map(probing).collect()
    }

    fn place(i: usize) -> Vector3<f64> {
        Vector3::new(10.0 * i as f64, 200.0 - i as f64, 0.3 * i as f64)
    }

    #[test]
    fn exact_touches_give_centres_and_radii() {
        for radius in [None, Some(10.5)] {
            let mut probings = probings(|_| [0.0; 5]);
            if radius.is_some() {
                probings.retain(|p| p.ball == 0);
            }
            let fitted = fit(&probings, 2, radius).unwrap();
            assert!((fitted.radii[0] - 10.5).abs() < 1e-9);
            for (centre, probing) in fitted.centres.iter().zip(&probings) {
                let exact = probing.touches[0] - Vector3::z() * [10.5, 6.25][probing.ball];
                // Rounding of positions of 200 mm, times a thousand.
                assert!((centre - exact).norm() < 1e-9);
            }
            assert!(fitted.doubtful.is_empty());
        }
    }

    #[test]
    fn a_wrong_touch_is_named_with_the_one_opposite() {
        // 0.3 µm of noise-like deviations, and 20 µm of dirt.
        let small = |i: usize, k: usize| 3e-4 * libm::sin((7 * i + 13 * k * k) as f64);
        let fitted = fit(
            &probings(|i| {
                let mut off = std::array::from_fn(|k| small(i, k));
                off[2] += if i == 4 { 0.02 } else { 0.0 };
                off[0] += if i == 9 { 0.02 } else { 0.0 };
                off
            }),
            2,
            None,
        )
        .unwrap();
        let named: Vec<usize> = fitted
            .doubtful
            .iter()
            .map(|(probing, _)| *probing)
            .collect();
        assert_eq!(named, [4, 9]);
        assert!(fitted.doubtful[0].1.contains(&2), "{:?}", fitted.doubtful);
        assert!(fitted.doubtful[1].1.contains(&0), "{:?}", fitted.doubtful);
        assert!(fitted.noise < 1e-3, "{}", fitted.noise);
    }

    #[test]
    fn points_in_a_plane_are_no_sphere() {
        let mut probings = probings(|_| [0.0; 5]);
        for touch in &mut probings[3].touches {
            touch.z = 1.0;
        }
        assert_eq!(fit(&probings, 2, None).unwrap_err().probing, 3);
        probings[3].touches.truncate(3);
        assert_eq!(fit(&probings, 2, None).unwrap_err().probing, 3);
    }
}
