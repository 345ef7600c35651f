//! `--policy` and `--damping`: what the rotary axes correct.

use super::bad_input::BadInput;
use super::number::damping;
use clap::{Args, ValueEnum};
use trueaxis_model::policy::of_blob;

/// The policy for rotary axes.
#[derive(Args)]
pub struct PolicyArguments {
    /// What the rotary axes correct
    #[arg(long, value_enum, default_value = "direction")]
    policy: PolicyChoice,
    /// Damping of --policy direction, 0.01 to 1. A smaller value points the tool better near positions where it is
    /// parallel to a rotary axis, with larger rotary corrections (default: 0.1)
    #[arg(long, value_name = "λ", value_parser = damping)]
    damping: Option<f32>,
}

#[derive(Clone, Copy, ValueEnum)]
enum PolicyChoice {
    /// The tool direction; rotation about the tool axis is ignored
    Direction,
    /// The full tool orientation, with rotation about the tool axis, as in the source document; the direction can
    /// become worse
    Orientation,
    /// Nothing: linear axes only
    Position,
}

impl PolicyArguments {
    /// The policy as stored in a blob.
    pub fn stored(&self) -> Result<trueaxis::Policy, BadInput> {
        match (self.policy, self.damping) {
            (PolicyChoice::Direction, damping) => Ok(trueaxis::Policy::Direction {
                damping: damping.unwrap_or(0.1),
            }),
            (_, Some(_)) => Err(BadInput::new(
                "--damping is given, but only --policy direction damps rotary corrections",
                "leave out --damping, or use --policy direction",
            )),
            (PolicyChoice::Orientation, None) => Ok(trueaxis::Policy::Orientation),
            (PolicyChoice::Position, None) => Ok(trueaxis::Policy::Position),
        }
    }

    /// The policy for the kinematic model.
    pub fn kinematic(&self) -> Result<trueaxis_model::kinematics::Policy, BadInput> {
        self.stored().map(of_blob)
    }
}
