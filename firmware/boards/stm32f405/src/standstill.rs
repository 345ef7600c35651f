//! Whether the machine stands still with its drives off.

use core::cell::RefCell;

use embedded_hal::digital::InputPin;
use trueaxis_firmware::device::Machine;

use crate::AXES;

/// So long the commands must not have changed, ms.
const QUIET: u32 = 200;

/// The state of the drives from a pin, and whether the commands have stopped.
pub struct Standstill<P> {
    /// High while the drives are off.
    drives_off: RefCell<P>,
    commands: [f32; AXES],
    /// When they changed last, ms; `None` if not since start.
    changed: Option<u32>,
    quiet: bool,
}

impl<P: InputPin> Standstill<P> {
    /// `drives_off` is high while the drives are off.
    pub const fn new(drives_off: P) -> Self {
        Self {
            drives_off: RefCell::new(drives_off),
            commands: [0.0; AXES],
            changed: None,
            quiet: false,
        }
    }

    /// Looks at the machine: to be called from the main loop, with the last commands.
    pub fn observe(&mut self, commands: &[f32; AXES], now: u32) {
        if self.commands != *commands {
            self.commands = *commands;
            self.changed = Some(now);
        }
        let quiet = |changed: u32| now.wrapping_sub(changed) >= QUIET;
        self.quiet = self.changed.is_none_or(quiet);
    }
}

impl<P: InputPin> Machine for Standstill<P> {
    fn standstill(&self) -> bool {
        // The pin as it is now, not as it was before an answer was sent. One that cannot be read says
        // nothing, so the drives may be on.
        let pin = self.drives_off.try_borrow_mut();
        self.quiet && pin.is_ok_and(|mut pin| pin.is_high().unwrap_or(false))
    }
}
