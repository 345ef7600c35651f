//! Permitted periods of calls.

/// Shortest period of a call, s. A shorter one is a fault: no controller is that fast.
pub const SHORTEST_PERIOD: f32 = 1e-6;

/// Longest period of a call, s. A longer one is a fault: time was lost.
pub const LONGEST_PERIOD: f32 = 0.01;

/// Whether a call may have this period; false for NaN.
#[inline(always)]
pub(super) fn is_period(dt: f32) -> bool {
    (SHORTEST_PERIOD..=LONGEST_PERIOD).contains(&dt)
}

/// How long unusable inputs only hold the correction, s; after that it is ramped to zero.
pub const PATIENCE: f32 = 0.01;
