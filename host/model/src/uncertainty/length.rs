//! Quantiles of the length of a random vector.

use super::PROBABILITY;
use nalgebra::Matrix3;
use std::array::from_fn;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Number of points for the mean over directions: the angle to the largest axis (Gauss–Legendre), and the angle
/// about it.
const ABOUT: usize = 12;
const ALONG: usize = 24;
/// Relative accuracy of the quantile.
const EXACT: f64 = 1e-9;
/// Largest number of steps of Newton's method; it never needs them all.
const STEPS: usize = 30;
/// Starting value in units of the largest standard deviation, below the smallest result: 1.96 if it is the only one.
const LEAST: f64 = 1.9;

/// Chebyshev points of each ratio of variances. Between them, lengths are accurate to 1e-6 (tested).
const POINTS: usize = 16;

/// The length that a normally distributed vector with mean 0 and this covariance does not exceed with
/// [`PROBABILITY`].
///
/// It is a smooth function of the ratios of the smaller variances to the largest, so it is interpolated: a polynomial through
/// [`POINTS`] × [`POINTS`] lengths.
pub fn quantile(covariance: &Matrix3<f64>) -> f64 {
    let mut variances: [f64; 3] = covariance.symmetric_eigenvalues().into();
    variances.sort_by(|a, b| b.total_cmp(a));
    let [largest, second, third] = variances;
    if largest.is_nan() || largest <= 0.0 {
        return 0.0;
    }
    let [second, third] = [second, third].map(|v| weights((v / largest).clamp(0.0, 1.0)));
    let rows = LENGTHS.iter().zip(second);
    let row = |(lengths, weight): (&[f64; POINTS], f64)| {
        let along = lengths.iter().zip(third).map(|(length, w)| length * w);
        weight * along.sum::<f64>()
    };
    rows.map(row).sum::<f64>() * largest.sqrt()
}

/// A Chebyshev point from 0 to 1, including both ends.
fn point(k: usize) -> f64 {
    0.5 - 0.5 * libm::cos(PI * k as f64 / (POINTS - 1) as f64)
}

/// The weight of each point in the polynomial's value at a ratio (barycentric formula for Chebyshev points).
fn weights(ratio: f64) -> [f64; POINTS] {
    let distances: [f64; POINTS] = from_fn(|k| ratio - point(k));
    if let Some(at) = distances.iter().position(|d| *d == 0.0) {
        return from_fn(|k| if k == at { 1.0 } else { 0.0 });
    }
    let weights: [f64; POINTS] = from_fn(|k| {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let end = if k == 0 || k == POINTS - 1 { 0.5 } else { 1.0 };
        sign * end / distances[k]
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

/// Lengths at the points of both ratios.
static LENGTHS: LazyLock<[[f64; POINTS]; POINTS]> = LazyLock::new(|| {
    let mut lengths = [[0.0; POINTS]; POINTS];
    for (i, k) in (0..POINTS).flat_map(|i| (0..=i).map(move |k| (i, k))) {
        lengths[i][k] = solved(point(i), point(k));
        lengths[k][i] = lengths[i][k];
    }
    lengths
});

/// The length if the largest variance is 1.
///
/// A normally distributed vector in the direction u has the length ℓ·χ₃ with ℓ² = uᵀ·Λ·u, where Λ has the eigenvalues of the
/// covariance and χ₃ is the length of a standard normal vector, independent of u. So the probability is the mean of that of
/// χ₃ over all directions.
fn solved(second: f64, third: f64) -> f64 {
    let squares = directions([1.0, second, third]);
    // Probability and its derivative. Beyond `LEAST` the growth of the probability slows down, so steps from below
    // stay below.
    let within = |length: f64| {
        let each = squares.iter().map(|(weight, square)| {
            let size = square.sqrt();
            let [probability, density] = chi_3(length / size);
            [weight * probability, weight * density / size]
        });
        each.fold([0.0; 2], |[a, b], [p, d]| [a + p, b + d])
    };
    let mut length = LEAST;
    for _ in 0..STEPS {
        let [probability, density] = within(length);
        let step = (PROBABILITY - probability) / density;
        length += step;
        if step.abs() < EXACT {
            break;
        }
    }
    length
}

/// Weights and uᵀ·Λ·u of directions that represent all directions.
fn directions([first, second, third]: [f64; 3]) -> Vec<(f64, f64)> {
    let mut all = Vec::with_capacity(ALONG * ABOUT);
    for (along, weight) in gauss_legendre() {
        for k in 0..ABOUT {
            let about = (k as f64 + 0.5) / ABOUT as f64 * (0.5 * PI);
            let across = second * libm::cos(about).powi(2) + third * libm::sin(about).powi(2);
            let square = first * along * along + (1.0 - along * along) * across;
            all.push((weight / ABOUT as f64, square));
        }
    }
    all
}

/// Points and weights for the mean over 0 to 1.
fn gauss_legendre() -> Vec<(f64, f64)> {
    let n = ALONG as f64;
    let point = |i: usize| {
        let mut x = libm::cos(PI * (i as f64 + 0.75) / (n + 0.5));
        let mut slope = 1.0;
        // Newton's method on the Legendre polynomial; five steps from this start are exact.
        for _ in 0..5 {
            let (mut value, mut last) = (x, 1.0);
            for k in 2..=ALONG {
                let k = k as f64;
                (value, last) = (((2.0 * k - 1.0) * x * value - (k - 1.0) * last) / k, value);
            }
            slope = n * (x * value - last) / (x * x - 1.0);
            x -= value / slope;
        }
        (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..ALONG).map(point).collect()
}

/// Probability that a standard normal vector of three coordinates is not longer than `length`, and its density.
fn chi_3(length: f64) -> [f64; 2] {
    let half = length * std::f64::consts::FRAC_1_SQRT_2;
    let edge = (2.0 / PI).sqrt() * length * libm::exp(-half * half);
    [libm::erf(half) - edge, edge * length]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn of(variances: [f64; 3]) -> f64 {
        quantile(&Matrix3::from_diagonal(&Vector3::from(variances)))
    }

    #[test]
    fn lengths_along_one_line_in_a_plane_and_in_space_are_those_of_tables() {
        for (variances, expected) in [
            // Normal distribution, two-sided.
            ([4.0, 0.0, 0.0], 2.0 * 1.959_963_985),
            // Rayleigh: √(−2·ln 0.05).
            ([1.0, 1.0, 0.0], (-2.0 * libm::log(0.05_f64)).sqrt()),
            // χ² with three degrees of freedom: 7.814728.
            ([1.0, 1.0, 1.0], 7.814_727_903_f64.sqrt()),
        ] {
            let found = of(variances);
            // The tables have ten digits; the sum over directions is less accurate if two eigenvalues are 0.
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{variances:?}: {found} {expected}"
            );
        }
        assert_eq!(of([0.0; 3]), 0.0);
    }

    #[test]
    fn what_is_interpolated_is_what_is_solved() {
        let mut random = Pcg64Mcg::seed_from_u64(4);
        for i in 0..300 {
            // Evenly, and near vectors along a line, which change fastest.
            let second = random.random::<f64>() * [1.0, 0.1, 0.01][i % 3];
            let third = random.random::<f64>() * second;
            let (found, expected) = (
                of([4.0 * third, 4.0, 4.0 * second]),
                2.0 * solved(second, third),
            );
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{second} {third}: {found} {expected}"
            );
        }
    }

    #[test]
    fn other_vectors_are_as_long_as_drawn_ones() {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let mut normal = || {
            let radius = (-2.0 * libm::log(1.0 - random.random::<f64>())).sqrt();
            radius * libm::cos(std::f64::consts::TAU * random.random::<f64>())
        };
        for variances in [
            [1.0, 0.3, 0.01],
            [1.0, 0.9, 0.0],
            [1.0, 1e-4, 1e-6],
            [1.0, 1.0, 0.2],
        ] {
            let most = of(variances);
            let draws = 100_000;
            let inside = (0..draws).filter(|_| {
                let square: f64 = variances.iter().map(|v| v * normal().powi(2)).sum();
                square <= most * most
            });
            let part = inside.count() as f64 / f64::from(draws);
            // A fraction of 0.95 of 100 000 has a standard deviation of 0.0007; four times that.
            assert!((part - 0.95).abs() < 0.0028, "{variances:?}: {part}");
        }
    }
}
