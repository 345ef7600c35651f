//! Interpolates between evenly spaced samples of a smooth function.

/// Number of samples that a polynomial passes through. At half the spacing, its error is 2¹² times smaller.
pub const POINTS: usize = 12;

/// The samples, of `count`, from which the value at `x` is computed, with their weights: Lagrange's polynomial
/// through the surrounding samples. `x` is in units of their spacing, from the first sample.
pub fn around(x: f64, count: usize, wraps: bool) -> Vec<(usize, f64)> {
    assert!(count >= POINTS);
    let mut first = x.floor() as i64 + 1 - POINTS as i64 / 2;
    if !wraps {
        first = first.clamp(0, (count - POINTS) as i64);
    }
    let x = x - first as f64;
    (0..POINTS)
        .map(|i| {
            let others = (0..POINTS).filter(|k| *k != i).map(|k| k as f64);
            let weight = others.map(|k| (x - k) / (i as f64 - k)).product();
            let row = (first + i as i64).rem_euclid(count as i64);
            (row as usize, weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_polynomial_is_followed_to_the_ends_and_at_samples_these_count_alone() {
        let f = |x: f64| (0..11).map(|k| (x / 10.0 - 1.0).powi(k)).sum::<f64>();
        for place in 0..=190 {
            let x = f64::from(place) / 10.0;
            let parts = around(x, 20, false).into_iter();
            let found: f64 = parts.map(|(i, w)| w * f(i as f64)).sum();
            // At the ends, the weights of values up to 11 add up to 200.
            assert!((found - f(x)).abs() < 1e-11, "{x}");
            let alone = around(x.floor(), 20, false);
            let other = |(i, w): &(usize, f64)| *w != f64::from(u8::from(*i as f64 == x.floor()));
            assert!(!alone.iter().any(other));
        }
    }

    #[test]
    fn what_wraps_has_no_ends() {
        // Sine at 24 samples of a turn: each step is 0.26, whose 12th power is 1e-7, over 4 000.
        for place in -30..300 {
            let x = f64::from(place) / 10.0;
            let parts = around(x, 24, true).into_iter();
            let sine = |i: usize| libm::sin(TAU * i as f64 / 24.0);
            let found: f64 = parts.map(|(i, w)| w * sine(i)).sum();
            assert!((found - libm::sin(TAU * x / 24.0)).abs() < 1e-10, "{x}");
        }
    }
}
