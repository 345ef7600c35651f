//! Median time of a call.

use std::time::Instant;

/// Different inputs of one batch.
pub const POINTS: usize = 2048;
/// Batches; the median ignores those that something else disturbed.
const BATCHES: usize = 301;

/// Nanoseconds per call of what `batch` calls [`POINTS`] times.
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
