//! Samples along variables are asked for again and again: each is made once.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trueaxis_model::machine::PerAxis;

/// Component, node, variable, and the bits of the position along it.
type Place = (usize, usize, usize, u64);

/// A place, and a monomial.
pub type Key = (Place, usize);

/// What has been sampled so far.
#[derive(Debug, Default)]
pub struct Memory(Mutex<HashMap<Key, PerAxis>>);

impl Memory {
    /// All of it.
    pub fn known(&self) -> MutexGuard<'_, HashMap<Key, PerAxis>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
