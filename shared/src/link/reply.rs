//! The controller's answers.

use serde::{Deserialize, Serialize};

use super::health::Health;
use super::progress::{Activation, Upload};
use super::refusal::Refusal;
use super::report::{Hello, Report};
use super::settings::{AtStart, TermWeight};
use crate::description::ADJUSTABLE;

/// An answer. Variants may only be appended; any other change requires a new [`PROTOCOL`](super::PROTOCOL).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// A reply lives on the stack while it is encoded, and the controller has no heap to box it.
#[allow(clippy::large_enum_variant)]
pub enum Reply<'a> {
    /// Identity of the controller.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// Current status.
    Status(Report),
    /// Progress of the upload.
    Upload(Upload),
    /// Progress of the activation.
    Activation(Activation),
    /// The request was carried out.
    Done,
    /// Corrections, one row of f32 for each requested row.
    Corrections(&'a [u8]),
    /// Rows in the format of [`MotionResult`](super::MotionResult), one for each commanded row.
    Motion(&'a [u8]),
    /// The request was refused, and nothing has changed.
    Refused(Refusal),
    /// State of the controller itself.
    Health(Health),
    /// Settings for the next start.
    AtStart(AtStart),
    /// The adjustable terms of the compensation in use.
    Weights(heapless::Vec<TermWeight, ADJUSTABLE>),
}
