//! What the page computes with: the machine, its errors and the tables, as numbers.

use crate::errors::ErrorModel;
use crate::machine::Machine;
use crate::validate::Runtime;
use serde::Serialize;

/// A machine with its errors, and a compensation if there is one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Model {}

impl Model {
    /// Takes what the page needs.
    #[must_use]
    pub fn new(_: &Machine, _: &ErrorModel, _: Option<&Runtime<'_>>) -> Self {
        Self {}
    }
}
