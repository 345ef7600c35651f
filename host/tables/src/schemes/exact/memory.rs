//! Cache of samples along variables, which are requested repeatedly.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trueaxis_model::machine::PerAxis;

/// Switches of a component and whether it is even, node, variable, and the bits of the position along it.
type Place = ((u32, bool), usize, usize, u64);

/// A place, and a monomial.
pub type Key = (Place, usize);

/// Samples taken so far.
#[derive(Debug, Default)]
pub struct Memory(Mutex<HashMap<Key, PerAxis>>);

impl Memory {
    /// Access to all samples.
    pub fn known(&self) -> MutexGuard<'_, HashMap<Key, PerAxis>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
