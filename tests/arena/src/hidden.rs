//! The machines of a round.

use crate::class::Class;
use crate::drawn;
use crate::task::Hidden;
use crate::warming;

impl Hidden {
    /// A machine of a round.
    ///
    /// # Panics
    /// If what the arena writes cannot be read: a mistake in it.
    #[must_use]
    pub fn new(round: u64, number: usize) -> Self {
        match Class::of(number) {
            Class::Thermal => warming::hidden(round, number),
            _ => drawn::hidden(round, number),
        }
    }
}
