//! Counts how often loops of loading go round: for tests, and for the fuzz target that holds it
//! against the bytes of the blob. Nothing without the feature `count`.

#[cfg(any(all(test, feature = "encode"), feature = "count"))]
mod counted {
    use std::cell::Cell;

    std::thread_local! {
        static ROUNDS: Cell<u64> = const { Cell::new(0) };
    }

    /// Adds `rounds`.
    pub(crate) fn count(rounds: usize) {
        ROUNDS.set(ROUNDS.get() + rounds as u64);
    }

    /// Rounds of all loops of loading in this thread since the last call.
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

/// Most rounds for each byte of a blob, and for a blob of none. A term of 7 bytes is looked at twice
/// for each of 16 outputs, and six times for what it is made of.
#[cfg(any(all(test, feature = "encode"), feature = "count"))]
pub const MOST_ROUNDS: [u64; 2] = [8, 1024];
