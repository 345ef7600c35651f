//! What the rotary axes correct.

/// What the rotary axes correct; the linear axes make the tool tip exact in each case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Policy {
    /// The tool's direction: rotary corrections Δ (rad) minimise |P·r|² + λ²·|Δ|², where r is the rotation of the
    /// remaining twist (rad, tool frame) and P the projection perpendicular to the tool axis. Rotation about the tool
    /// axis is ignored. Since Δ = 0 is a candidate, |P·r| does not grow.
    /// Rotation about the tool axis does not count. With Δ = 0 at hand, |P·r| does not grow.
    Direction {
        /// The damping λ, [`Policy::LEAST_DAMPING`] to 1: cost of a radian of correction relative to a radian of
        /// direction error. Not checked here; with 0 there is no correction where the tool is parallel to a rotary
        /// axis. Where the tool is parallel to a rotary axis, corrections of that axis grow to at most |P·r| / 2λ.
        damping: f64,
    },
    /// The tool's orientation: least squares over all three rows of rotation, including that about the tool axis. This
    /// can make the direction worse.
    Orientation,
    /// Nothing: rotary axes stay as commanded.
    Position,
}

impl Policy {
    /// The smallest permitted damping.
    pub const LEAST_DAMPING: f64 = 0.01;
}

impl Default for Policy {
    fn default() -> Self {
        Self::Direction { damping: 0.1 }
    }
}
