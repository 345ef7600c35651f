//! The policy for rotary axes, as the kinematics know it and as a blob stores it.

use serde::Serialize;
use trueaxis_model::kinematics::Policy;

/// A policy in answers for programs.
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

/// What a blob stores of a policy.
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

/// The policy that a blob stores. The damping is the shortest decimal number that its f32 stands for: 0.1,
/// not the 1.5e-9 more that it is.
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

/// How far tables may be from the kinematic correction in rotation (µrad), where they may be `um` µm from
/// it in translation: in the tool's direction, of which less than 1 µrad does not matter, or in a rotary
/// axis.
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
