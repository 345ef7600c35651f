//! The policy for rotary axes, as used by the kinematics and as stored in a blob.

use crate::kinematics::Policy;
use serde::Serialize;

/// A policy in JSON output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PolicyName {
    /// `direction`, `orientation` or `position`.
    pub policy: &'static str,
    /// The damping of `direction`.
    pub damping: Option<f32>,
}

impl From<trueaxis::Policy> for PolicyName {
    fn from(policy: trueaxis::Policy) -> Self {
        let (policy, damping) = match policy {
            trueaxis::Policy::Direction { damping } => ("direction", Some(damping)),
            trueaxis::Policy::Orientation => ("orientation", None),
            trueaxis::Policy::Position => ("position", None),
        };
        Self { policy, damping }
    }
}

/// The policy as stored in a blob.
#[must_use]
pub fn stored(policy: Policy) -> trueaxis::Policy {
    match policy {
        Policy::Direction { damping } => trueaxis::Policy::Direction {
            damping: damping as f32,
        },
        Policy::Orientation => trueaxis::Policy::Orientation,
        Policy::Position => trueaxis::Policy::Position,
    }
}

/// The policy stored in a blob. The damping is the shortest decimal number that rounds to the stored f32: 0.1, not
/// its exact value, which is 1.5e-9 larger.
#[must_use]
pub fn of_blob(policy: trueaxis::Policy) -> Policy {
    match policy {
        trueaxis::Policy::Direction { damping } => Policy::Direction {
            damping: damping
                .to_string()
                .parse()
                .unwrap_or_else(|_| f64::from(damping)),
        },
        trueaxis::Policy::Orientation => Policy::Orientation,
        trueaxis::Policy::Position => Policy::Position,
    }
}

/// Permitted rotational deviation of the tables from the kinematic correction (µrad), if `um` µm are permitted in
/// translation. It applies to the tool direction, for which at least 1 µrad is permitted, or to each rotary axis.
#[must_use]
pub fn tolerance_urad(policy: Policy, um: f64) -> f64 {
    match policy {
        Policy::Direction { .. } => um.max(1.0),
        Policy::Orientation | Policy::Position => um,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_comes_back_as_the_same_number() {
        for damping in [0.01, 0.1, 0.123, 0.4, 1.0] {
            let policy = Policy::Direction { damping };
            assert_eq!(of_blob(stored(policy)), policy);
        }
    }
}
