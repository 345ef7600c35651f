//! The condition number of a triangle.

use nalgebra::{DMatrix, DVector};

/// Eigenvalues are found to this part of themselves, or better.
const EXACT: f64 = 1e-11;
/// After so many steps it is looked how far they are, then after twice as many, and so on.
const FIRST: usize = 8;

/// The largest singular value by the smallest: infinite if that is zero.
///
/// The largest of R and of R⁻¹, each by products with vectors alone, which takes a fraction of the time of all singular
/// values.
pub(super) fn condition(triangle: &DMatrix<f64>) -> f64 {
    let n = triangle.ncols();
    let largest = largest(n, |x| Some(triangle.tr_mul(&(triangle * x))));
    let inverse = self::largest(n, |x| {
        let y = triangle.tr_solve_upper_triangular(x)?;
        triangle.solve_upper_triangular(&y)
    });
    match (largest, inverse) {
        (Some(largest), Some(inverse)) => (largest * inverse).sqrt(),
        _ => f64::INFINITY,
    }
}

/// The largest eigenvalue of a symmetric matrix that is not negative (Lanczos, every vector made orthogonal to all
/// before it); `None` if a product is not finite.
fn largest(n: usize, product: impl Fn(&DVector<f64>) -> Option<DVector<f64>>) -> Option<f64> {
    // In no direction that a matrix may have.
    let start = DVector::from_fn(n, |i, _| 1.0 + (1.0 + i as f64).sin());
    let mut basis = vec![start.normalize()];
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut look = FIRST;
    loop {
        let last = &basis[basis.len() - 1];
        let mut next = product(last)?;
        diagonal.push(last.dot(&next));
        // Twice is enough.
        for _ in 0..2 {
            for other in &basis {
                next.axpy(-other.dot(&next), other, 1.0);
            }
        }
        let left = next.norm();
        if !left.is_finite() {
            return None;
        }
        let count = basis.len();
        let is_whole = count == n || left == 0.0;
        if count == look || is_whole {
            look *= 2;
            let small = DMatrix::from_fn(count, count, |i, j| match i.abs_diff(j) {
                0 => diagonal[i],
                1 => beside[i.min(j)],
                _ => 0.0,
            });
            let eigen = small.symmetric_eigen();
            let (i, value) = eigen.eigenvalues.argmax();
            // So far the product with its vector is from a multiple of it.
            let off = left * eigen.eigenvectors[(count - 1, i)].abs();
            if is_whole || off <= EXACT * value {
                return Some(value);
            }
        }
        beside.push(left);
        basis.push(next / left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_condition_is_that_of_all_singular_values() {
        for (n, spread) in [(1, 0.0), (2, 3.0), (7, 0.5), (40, 0.3), (130, 0.1)] {
            // Columns that grow, and are not far from each other.
            let all = DMatrix::from_fn(2 * n, n, |i, j| {
                let wave = ((3 * i * j + 7 * i + j) as f64).sin();
                (1.0 + 0.1 * wave) * (spread * j as f64).exp() + wave
            });
            let triangle = all.qr().unpack_r();
            let values = triangle.singular_values();
            let expected = values.max() / values.min();
            let found = condition(&triangle);
            // The smallest of all values is known to rounding of the largest.
            let exact = 1e-9_f64.max(1e-15 * expected * n as f64);
            assert!(
                (found / expected - 1.0).abs() < exact,
                "{n}: {found} {expected}"
            );
        }
        // All alike; a column of zeros.
        assert!((condition(&DMatrix::identity(30, 30)) - 1.0).abs() < 1e-14);
        let mut singular = DMatrix::identity(3, 3);
        singular[(1, 1)] = 0.0;
        assert_eq!(condition(&singular), f64::INFINITY);
    }
}
