//! What can be set, and what is stored of it.

use serde::{Deserialize, Serialize};

use super::refusal::Refusal;
use super::slot::Slot;

/// What the next start goes by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtStart {
    /// The slot that it takes.
    pub in_use: Option<Slot>,
    /// The slot that was in use before: for a rollback, and for a start at which the other one is
    /// not valid.
    pub before: Option<Slot>,
    /// A valid slot that was never in use: no start takes it.
    pub waiting: Option<Slot>,
    /// The corrections are let in.
    pub enable: bool,
    /// Whether this is what is wanted.
    pub storing: Storing,
}

/// Whether what is wanted at the next start is stored.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Storing {
    /// It is.
    Stored,
    /// It will be, as soon as the flash can be written: at standstill with drives off, where that
    /// stalls the servo.
    Pending,
    /// It is not, for this reason.
    Failed(Refusal),
}

/// An adjustable term of the compensation in use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TermWeight {
    /// Its index in the blob.
    pub term: u16,
    /// Number of the axis that it corrects.
    pub output: u8,
    /// The weight that is wanted.
    pub value: f32,
    /// Lowest and highest weight that is accepted.
    pub limits: [f32; 2],
}
