//! Whether the machine stands still with its drives off.

use core::cell::RefCell;

use embedded_hal::digital::InputPin;
use trueaxis::{Room, Row};

use crate::device::Machine;

/// How long the commands must have been unchanged, ms.
const QUIET: u32 = 200;

/// Combines the drive state from a pin with the time since the commands last changed.
pub struct Standstill<P, C: Room> {
    /// High while the drives are off.
    drives_off: RefCell<P>,
    commands: C::Axes<f32>,
    /// Time of the last change, ms; `None` if there was none since start.
    changed: Option<u32>,
    quiet: bool,
}

impl<P: InputPin, C: Room> Standstill<P, C> {
    /// `drives_off` is high while the drives are off.
    #[must_use]
    pub fn new(drives_off: P) -> Self {
        Self {
            drives_off: RefCell::new(drives_off),
            commands: C::Axes::<f32>::all(0.0),
            changed: None,
            quiet: false,
        }
    }

    /// Observes the machine; call it from the main loop with the last commands.
    pub fn observe(&mut self, commands: &C::Axes<f32>, now: u32) {
        if self.commands != *commands {
            self.commands = *commands;
            self.changed = Some(now);
        }
        let quiet = |changed: u32| now.wrapping_sub(changed) >= QUIET;
        self.quiet = self.changed.is_none_or(quiet);
    }
}

impl<P: InputPin, C: Room> Machine for Standstill<P, C> {
    fn standstill(&self) -> bool {
        // Reads the pin now, because its state may have changed since the last answer was sent. If it cannot be read,
        // the drives may be on.
        let pin = self.drives_off.try_borrow_mut();
        self.quiet && pin.is_ok_and(|mut pin| pin.is_high().unwrap_or(false))
    }
}

#[cfg(test)]
mod tests;
