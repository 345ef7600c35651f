//! The lamp and the fault pin.

use embedded_hal::digital::{OutputPin, PinState};
use trueaxis::{Conditions, Room};

use crate::device::{ServoAccess, ServoSide};

/// Conditions that are a fault: the corrections are not what they should be.
const FAULTS: Conditions = Conditions(
    Conditions::BAD_INPUT.0 | Conditions::BAD_PERIOD.0 | Conditions::HELD.0 | Conditions::FROZEN.0,
);

/// What the lamp shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Shown {
    /// Corrections are in: on.
    Correcting,
    /// None are wanted, or they come or go: 1 s on, 1 s off.
    Idle,
    /// A fault: five times per second.
    Fault,
}

impl Shown {
    /// What there is to show.
    pub fn of<C: Room>(side: &ServoSide<C>, fault: bool) -> Self {
        let conditions = side.last().status.conditions.0;
        // Before the first command nothing is held that matters.
        let held = side.is_enabled() && conditions & FAULTS.0 != 0;
        if fault || held {
            Self::Fault
        } else if side.is_enabled() && side.driven().factor() == 1.0 {
            Self::Correcting
        } else {
            Self::Idle
        }
    }
}

/// Lamp and fault pin.
pub struct Signals<L, H> {
    lamp: L,
    /// High while there is no fault: a controller that has lost its power or its program reports
    /// one too.
    healthy: H,
}

impl<L: OutputPin, H: OutputPin> Signals<L, H> {
    /// Both off until something is shown.
    pub const fn new(lamp: L, healthy: H) -> Self {
        Self { lamp, healthy }
    }

    /// Shows the state at `now`, ms: to be called from the main loop.
    pub fn show<C: Room>(
        &mut self,
        servo: &mut impl ServoAccess<C>,
        fault: bool,
        now: u32,
    ) -> Shown {
        let shown = servo.with(|side| Shown::of(side, fault));
        let on = match shown {
            Shown::Correcting => true,
            Shown::Idle => (now / 1000).is_multiple_of(2),
            Shown::Fault => (now / 100).is_multiple_of(2),
        };
        // Pins of a microcontroller do not fail.
        let _ = self.lamp.set_state(PinState::from(on));
        let _ = self
            .healthy
            .set_state(PinState::from(shown != Shown::Fault));
        shown
    }
}

#[cfg(test)]
mod tests;
