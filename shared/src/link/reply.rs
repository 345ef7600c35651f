//! What the controller answers.

use serde::{Deserialize, Serialize};

use super::health::Health;
use super::progress::{Activation, Upload};
use super::refusal::Refusal;
use super::report::{Hello, Report};
use super::settings::{AtStart, TermWeight};
use crate::description::ADJUSTABLE;

/// An answer. The variants may only be appended to; anything else is a new
/// [`PROTOCOL`](super::PROTOCOL).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// A reply lives on the stack while it is encoded, and the controller has no heap to box it.
#[allow(clippy::large_enum_variant)]
pub enum Reply<'a> {
    /// Who is there.
    #[serde(borrow)]
    Hello(Hello<'a>),
    /// How things are.
    Status(Report),
    /// How far the upload has come.
    Upload(Upload),
    /// How far the change of compensation has come.
    Activation(Activation),
    /// It is done.
    Done,
    /// Corrections, one row of f32 for each row asked for.
    Corrections(&'a [u8]),
    /// Rows as [`MotionResult`](super::MotionResult) writes them, one for each row commanded.
    Motion(&'a [u8]),
    /// It is not done, and nothing has changed.
    Refused(Refusal),
    /// How well the controller is.
    Health(Health),
    /// What the next start goes by.
    AtStart(AtStart),
    /// The adjustable terms of the compensation in use.
    Weights(heapless::Vec<TermWeight, ADJUSTABLE>),
}
