//! Median time of a call.

use std::time::Instant;

/// Number of different inputs per batch.
pub const POINTS: usize = 2048;
/// Number of batches; the median ignores those disturbed by other activity.
const BATCHES: usize = 301;

/// Nanoseconds per call, where `batch` makes [`POINTS`] calls.
pub fn per_call(mut batch: impl FnMut()) -> f64 {
    for _ in 0..BATCHES / 10 {
        batch();
    }
    let mut times: Vec<f64> = (0..BATCHES)
        .map(|_| {
            let start = Instant::now();
            batch();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[BATCHES / 2] * 1e9 / POINTS as f64
}
