//! Whether a proven compensation may be written.

use super::Proof;
use serde::Serialize;

/// Why a proven compensation is not written, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Refusal {
    /// The tables are farther from the kinematic correction than wanted.
    #[error(
        "the tolerance of {tolerance_um} µm and µrad is not met: {reached_um:.4} µm and {reached_urad:.4} µrad were reached"
    )]
    Tolerance {
        /// What was wanted, of linear axes (µm) and of rotary ones (µrad).
        tolerance_um: f64,
        /// What was reached by linear axes (µm).
        reached_um: f64,
        /// What was reached by rotary axes (µrad).
        reached_urad: f64,
    },
}

impl Refusal {
    /// Whether `--best-effort` writes all the same. A compensation that does harm is not written
    /// whatever is said: that refusal, too, belongs here, with `false`.
    #[must_use]
    pub const fn yields_to_best_effort(&self) -> bool {
        match self {
            Self::Tolerance { .. } => true,
        }
    }
}

impl Proof {
    /// What speaks against writing the compensation, worst first; nothing if all checks hold.
    /// `tolerance` in µm and µrad.
    #[must_use]
    pub fn refusals(&self, tolerance: f64) -> Vec<Refusal> {
        let inside = self.inside();
        let missed = (!self.meets(tolerance)).then_some(Refusal::Tolerance {
            tolerance_um: tolerance,
            reached_um: inside.difference_um,
            reached_urad: inside.difference_urad,
        });
        missed.into_iter().collect()
    }
}
