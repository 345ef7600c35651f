//! Chebyshev points, which separate polynomials and trigonometric functions well.

/// Chebyshev points of a range, including both ends.
pub fn points([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let (mid, half) = (0.5 * (low + high), 0.5 * (high - low));
    (0..count)
        .map(|k| {
            let angle = std::f64::consts::PI * k as f64 / (count - 1) as f64;
            mid - half * libm::cos(angle)
        })
        .collect()
}
