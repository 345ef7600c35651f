//! Coefficients of cubic tables, fitted to values.
//!
//! A cubic table is a uniform B-spline; it holds coefficients, which are not values at points. They are the least
//! squares fit over the starts and midpoints of all intervals. For a fourth power the fit leaves ±h⁴·f⁗/768 there,
//! alternating, and nowhere more. That is half of what interpolation at the starts leaves (h⁴·f⁗/384 in every
//! midpoint, 0 between), and no spline leaves less. There are more of these positions than coefficients, so no
//! further conditions are needed at the ends.

use nalgebra::DMatrix;

/// For tables that wrap, number of intervals beyond each end that are included in the fit. The influence of a value
/// halves about once per interval, to 1e-16 at this distance.
const AROUND: usize = 60;

/// Number of neighbours on each side with which a coefficient is coupled.
const BAND: usize = 3;

/// The weights of the four coefficients of an interval at fraction `t`.
pub fn weights(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    let (w0, w3) = (s * s * s / 6.0, t * t * t / 6.0);
    let w2 = (1.0 + 3.0 * t * (1.0 + t * s)) / 6.0;
    [w0, 1.0 - w0 - w2 - w3, w2, w3]
}

/// Number of positions for `intervals` intervals: starts and midpoints, and the end if the table does not wrap.
pub fn positions(intervals: usize, wraps: bool) -> usize {
    2 * intervals + usize::from(!wraps)
}

/// Number of coefficients of `intervals` intervals.
pub fn count(intervals: usize, wraps: bool) -> usize {
    if wraps { intervals } else { intervals + BAND }
}

/// The coefficients of tables, from their values at the starts and midpoints of the intervals (positions × tables).
pub fn coefficients(values: &DMatrix<f64>, wraps: bool) -> DMatrix<f64> {
    if !wraps {
        return fitted(values);
    }
    let (rows, intervals) = (values.nrows(), values.nrows() / 2);
    // Start a whole number of turns earlier.
    let before = (2 * AROUND).next_multiple_of(rows) - 2 * AROUND;
    let unrolled = DMatrix::from_fn(rows + 4 * AROUND + 1, values.ncols(), |i, k| {
        values[((before + i) % rows, k)]
    });
    fitted(&unrolled).rows(AROUND, intervals).into_owned()
}

/// Like `coefficients`, for tables that do not wrap.
fn fitted(values: &DMatrix<f64>) -> DMatrix<f64> {
    let n = count(values.nrows() / 2, false);
    // The normal equations: `square[i][k]` couples coefficients i and i − k.
    let mut square = vec![[0.0; BAND + 1]; n];
    let mut solution = DMatrix::zeros(n, values.ncols());
    let halves = [weights(0.0), weights(0.5)];
    for row in 0..values.nrows() {
        let (first, weights) = match row {
            // The end of the last interval.
            _ if row + 1 == values.nrows() => (n - 4, weights(1.0)),
            _ => (row / 2, halves[row % 2]),
        };
        for (i, w) in weights.iter().enumerate() {
            for (k, v) in weights[..=i].iter().rev().enumerate() {
                square[first + i][k] += w * v;
            }
            for column in 0..values.ncols() {
                solution[(first + i, column)] += w * values[(row, column)];
            }
        }
    }
    // L·D·Lᵀ in place, forwards, then backwards.
    for i in 0..n {
        for k in (0..=BAND.min(i)).rev() {
            let j = i - k;
            let common = (1..=BAND - k).filter(|m| *m <= j);
            let sum: f64 = common
                .map(|m| square[i][k + m] * square[j - m][0] * square[j][m])
                .sum();
            square[i][k] -= sum;
            if k > 0 {
                square[i][k] /= square[j][0];
            }
        }
    }
    for mut column in solution.column_iter_mut() {
        for i in 0..n {
            for k in 1..=BAND.min(i) {
                column[i] -= square[i][k] * column[i - k];
            }
        }
        for i in (0..n).rev() {
            column[i] /= square[i][0];
            for k in 1..=BAND.min(n - 1 - i) {
                column[i] -= square[i + k][k] * column[i + k];
            }
        }
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a function at the starts and midpoints of the intervals of a range.
    fn sampled(f: impl Fn(f64) -> f64, intervals: usize, [low, high]: [f64; 2]) -> DMatrix<f64> {
        let step = (high - low) / intervals as f64;
        let rows = positions(intervals, false);
        DMatrix::from_fn(rows, 1, |i, _| f(low + 0.5 * step * i as f64))
    }

    fn value(coefficients: &DMatrix<f64>, k: usize, t: f64) -> f64 {
        let parts = weights(t).into_iter().enumerate();
        parts
            .map(|(i, w)| w * coefficients[((k + i) % coefficients.nrows(), 0)])
            .sum()
    }

    /// The largest error at many positions in every interval.
    fn worst(f: impl Fn(f64) -> f64, intervals: usize, [low, high]: [f64; 2]) -> f64 {
        let found = coefficients(&sampled(&f, intervals, [low, high]), false);
        let step = (high - low) / intervals as f64;
        let errors = (0..=20 * intervals).map(|place| {
            let k = (place / 20).min(intervals - 1);
            let t = place as f64 / 20.0 - k as f64;
            (value(&found, k, t) - f(low + step * (k as f64 + t))).abs()
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn cubic_polynomials_are_followed_up_to_the_ends() {
        let f = |x: f64| 3.0 - 2.0 * x + 0.5 * x * x - 0.125 * x * x * x;
        for intervals in 2..40 {
            // Coefficients are up to 30; solving the equations loses two digits.
            let error = worst(f, intervals, [-3.0, 5.0]);
            assert!(error < 1e-12, "{intervals}: {error}");
        }
    }

    #[test]
    fn what_is_left_falls_with_the_fourth_power_of_the_step() {
        // A peak of width 1, with the ends on its slopes.
        let peak = |x: f64| x / (1.0 + x * x);
        let range = [-2.3, 4.1];
        let errors = [64, 128, 256, 512].map(|n| worst(peak, n, range));
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            // 16, plus the contribution of the sixth derivative on the coarsest grid.
            assert!((15.5..17.0).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn of_a_fourth_power_no_more_is_left_than_has_to_be() {
        // f⁗ = 24, step 1: 24 / 768 in the middle, out of reach of the ends.
        let f = |x: f64| x.powi(4);
        let intervals = 60;
        let found = coefficients(&sampled(f, intervals, [-30.0, 30.0]), false);
        for k in 25..35_u8 {
            for t in [0.0, 0.1, 0.25, 0.5, 0.8] {
                let x = f64::from(k) + t - 30.0;
                let error = (value(&found, k.into(), t) - f(x)).abs();
                // Numbers up to 30⁴ are rounded.
                assert!(error < 1.0 / 32.0 + 1e-8, "{x} {error}");
            }
        }
        // At the ends, where fewer values contribute, it is a quarter larger.
        assert!(worst(f, intervals, [-30.0, 30.0]) < 1.3 / 32.0);
    }

    #[test]
    fn a_table_that_wraps_has_no_seam() {
        for intervals in [4, 5, 8, 61] {
            let turn = std::f64::consts::TAU / intervals as f64;
            let rows = positions(intervals, true);
            let values = |first: usize| {
                DMatrix::from_fn(rows, 1, |i, _| {
                    let x = 0.5 * turn * (first + i) as f64;
                    libm::sin(x) + 0.3 * libm::cos(2.0 * x)
                })
            };
            let found = coefficients(&values(0), true);
            assert_eq!(found.nrows(), intervals);
            // It is the same table if it starts elsewhere.
            let moved = coefficients(&values(6), true);
            for k in 0..intervals {
                let other = moved[(k, 0)];
                assert!((found[((k + 3) % intervals, 0)] - other).abs() < 1e-13);
            }
        }
    }
}
