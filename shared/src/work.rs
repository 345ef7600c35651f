//! Counts loop iterations during loading, for tests and for the fuzz target that compares them with the length of the
//! blob. Does nothing without the feature `count`.

#[cfg(any(all(test, feature = "encode"), feature = "count"))]
mod counted {
    use std::cell::Cell;

    std::thread_local! {
        static ROUNDS: Cell<u64> = const { Cell::new(0) };
    }

    /// Adds `rounds` to the count.
    pub(crate) fn count(rounds: usize) {
        ROUNDS.set(ROUNDS.get() + rounds as u64);
    }

    /// Iterations of all loading loops in this thread since the last call.
    #[must_use]
    pub fn rounds() -> u64 {
        ROUNDS.take()
    }
}

#[cfg(any(all(test, feature = "encode"), feature = "count"))]
pub use counted::rounds;

#[cfg(any(all(test, feature = "encode"), feature = "count"))]
pub(crate) use counted::count;

#[cfg(not(any(all(test, feature = "encode"), feature = "count")))]
#[inline(always)]
pub(crate) fn count(_: usize) {}

/// Maximum number of iterations per byte of a blob, and for an empty blob. A term of 7 bytes is visited twice for each
/// of 16 outputs, and six times for its parts.
#[cfg(any(all(test, feature = "encode"), feature = "count"))]
pub const MOST_ROUNDS: [u64; 2] = [8, 1024];
