//! What can be set, and which settings are stored.

use serde::{Deserialize, Serialize};

use super::refusal::Refusal;
use super::slot::Slot;

/// Settings for the next start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtStart {
    /// The slot to use.
    pub in_use: Option<Slot>,
    /// The slot in use before: for a rollback, and for a start at which the other slot is not valid.
    pub before: Option<Slot>,
    /// A valid slot that was never in use, so no start selects it.
    pub waiting: Option<Slot>,
    /// Corrections are enabled at start.
    pub enable: bool,
    /// Whether these settings are stored.
    pub storing: Storing,
}

/// Whether the requested settings for the next start are stored.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Storing {
    /// Stored.
    Stored,
    /// Not yet stored. They will be as soon as the flash can be written: at standstill with drives off, if writing
    /// stalls the servo.
    Pending,
    /// Could not be stored, for this reason.
    Failed(Refusal),
}

/// An adjustable term of the compensation in use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TermWeight {
    /// Index of the term in the blob.
    pub term: u16,
    /// Index of the axis that it corrects.
    pub output: u8,
    /// The requested weight.
    pub value: f32,
    /// Lowest and highest accepted weight.
    pub limits: [f32; 2],
}
