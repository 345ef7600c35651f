//! What rotary axes are corrected for.

/// What rotary axes are corrected for; linear axes make the tool tip exact under each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Policy {
    /// The tool's direction: rotary corrections Δ (rad) minimise |P·r|² + λ²·|Δ|², where r is the
    /// rotation of the remaining twist (rad, tool frame) and P the projection across the tool axis.
    /// Rotation about the tool axis does not count. With Δ = 0 at hand, |P·r| does not grow.
    Direction {
        /// The damping λ, [`Policy::LEAST_DAMPING`] to 1 (not checked here; with 0 there is no correction
        /// where the tool is parallel to a rotary axis): what a radian of correction is worth, seen from
        /// a radian of direction. Where the tool is parallel to a rotary axis, corrections of that
        /// axis grow to |P·r| / 2λ at most.
        damping: f64,
    },
    /// The tool's orientation: least squares over all three rows of rotation, that about the tool
    /// axis among them. The direction can become worse by it.
    Orientation,
    /// Nothing: rotary axes stay as commanded.
    Position,
}

impl Policy {
    /// The least damping.
    pub const LEAST_DAMPING: f64 = 0.01;
}

impl Default for Policy {
    fn default() -> Self {
        Self::Direction { damping: 0.1 }
    }
}
