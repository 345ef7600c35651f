//! The lamp.

use embedded_hal::digital::{OutputPin, PinState};
use trueaxis::Room;

use crate::device::{ServoAccess, ServoSide};

/// State shown by the lamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Shown {
    /// Corrections are in: on.
    Correcting,
    /// Corrections are disabled or ramping: 1 s on, 1 s off.
    Idle,
    /// A fault: five flashes per second.
    Fault,
}

impl Shown {
    /// The state to show.
    pub fn of<C: Room>(side: &ServoSide<C>) -> Self {
        if !side.is_healthy() {
            Self::Fault
        } else if side.is_enabled() && side.servo().factor() == 1.0 {
            Self::Correcting
        } else {
            Self::Idle
        }
    }
}

/// The lamp. The fault pin is set from the servo interrupt: [`Heart`](super::Heart).
pub struct Signals<L> {
    lamp: L,
}

impl<L: OutputPin> Signals<L> {
    /// Off until a state is shown.
    pub const fn new(lamp: L) -> Self {
        Self { lamp }
    }

    /// Shows the state at time `now`, ms; call it from the main loop.
    pub fn show<C: Room>(&mut self, servo: &mut impl ServoAccess<C>, now: u32) -> Shown {
        let shown = servo.with(|side| Shown::of(side));
        let on = match shown {
            Shown::Correcting => true,
            Shown::Idle => (now / 1000).is_multiple_of(2),
            Shown::Fault => (now / 100).is_multiple_of(2),
        };
        // Pins of a microcontroller do not fail.
        let _ = self.lamp.set_state(PinState::from(on));
        shown
    }
}

#[cfg(test)]
mod tests;
