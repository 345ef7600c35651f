//! Work on all processors.
//!
//! Closures are passed to [`rayon`] as trait objects, so that its code is compiled once here and not for every
//! closure: a fifth of the code of the crates that sample.

use rayon::prelude::*;
pub use rayon::slice::ParallelSliceMut as Sort;
use std::convert::Infallible;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Largest number of parts that items are divided into: enough to keep all processors busy until the end.
const PARTS: usize = 1024;

/// Results of a function for each item, in their order.
pub fn map<'i, I: Sync, R: Send>(items: &'i [I], of: impl Fn(&'i I) -> R + Sync) -> Vec<R> {
    let done = try_map(items, |item| Ok::<R, Infallible>(of(item)));
    done.unwrap_or_else(|never| match never {})
}

/// Like `map`, for a function that can fail; after a failure, no further items are started.
///
/// # Errors
/// The first error, in the order of the items, of those that occurred.
pub fn try_map<'i, I: Sync, R: Send, E: Send>(
    items: &'i [I],
    of: impl Fn(&'i I) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let has_failed = AtomicBool::new(false);
    // The results of each part, in their places: sorting them would be compiled for every type of result.
    let mut parts = Vec::<Option<Result<Vec<R>, E>>>::new();
    parts.resize_with(items.len().min(PARTS), || None);
    let parts = Mutex::new(parts);
    in_parts(items.len(), &|part, range| {
        if !has_failed.load(Ordering::Relaxed) {
            let found: Result<Vec<R>, E> = items[range].iter().map(&of).collect();
            has_failed.fetch_or(found.is_err(), Ordering::Relaxed);
            let mut parts = parts.lock().unwrap_or_else(PoisonError::into_inner);
            parts[part] = Some(found);
        }
    });
    let parts = parts.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut all = Vec::with_capacity(items.len());
    for part in parts.into_iter().flatten() {
        all.extend(part?);
    }
    Ok(all)
}

/// Calls a function for ranges that together cover all numbers below `count`, with the number of each.
fn in_parts(count: usize, of: &(dyn Fn(usize, Range<usize>) + Sync)) {
    let size = count.div_ceil(PARTS).max(1);
    let parts = (0..count.div_ceil(size)).into_par_iter();
    parts.for_each(|part| of(part, part * size..count.min((part + 1) * size)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn results_are_in_the_order_of_the_items() {
        for count in [0, 1, 2, 1023, 1024, 1025, 5000] {
            let items: Vec<usize> = (0..count).collect();
            let doubled: Vec<usize> = items.iter().map(|i| 2 * i).collect();
            assert_eq!(map(&items, |i| 2 * i), doubled);
        }
    }

    #[test]
    fn a_failure_is_returned_and_ends_the_work() {
        let items: Vec<usize> = (0..1_000_000).collect();
        let last = AtomicUsize::new(0);
        let fails = |i: &usize| {
            last.fetch_max(*i, Ordering::Relaxed);
            if *i == 10 { Err(*i) } else { Ok(*i) }
        };
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        assert_eq!(one.unwrap().install(|| try_map(&items, fails)), Err(10));
        assert_eq!(last.into_inner(), 10);
    }
}
