//! Chebyshev points: where polynomials and trigonometric functions are kept well apart.

/// Chebyshev points of a range, with both ends.
pub fn points([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let (mid, half) = (0.5 * (low + high), 0.5 * (high - low));
    (0..count)
        .map(|k| {
            let angle = std::f64::consts::PI * k as f64 / (count - 1) as f64;
            mid - half * angle.cos()
        })
        .collect()
}
