//! Periods of calls.

/// Shortest period of a call, s. Shorter ones are a fault: no controller is so fast.
pub const SHORTEST_PERIOD: f32 = 1e-6;

/// Longest period of a call, s. Longer ones are a fault: time has been lost.
pub const LONGEST_PERIOD: f32 = 0.01;

/// Whether a call may have this period; not-a-number may not.
#[inline(always)]
pub(super) fn is_period(dt: f32) -> bool {
    (SHORTEST_PERIOD..=LONGEST_PERIOD).contains(&dt)
}

/// For so long unusable inputs only hold the correction, s; then it is ramped to zero.
pub const PATIENCE: f32 = 0.01;
