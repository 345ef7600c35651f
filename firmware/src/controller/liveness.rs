//! Monitors servo interrupt and main loop, and drives the watchdog and the fault pin accordingly.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embedded_hal::digital::{OutputPin, PinState};

/// A watchdog that resets the processor unless it is fed.
pub trait Watchdog {
    /// Restarts the timeout.
    fn feed(&mut self);
}

/// Shared between the two, for a `static`: the main loop reports that it is alive, and the servo interrupt checks how
/// long ago that was.
///
/// Once either has been found dead, that is final until the watchdog restarts the controller.
pub struct Liveness {
    /// Number of servo periods for which the main loop may be silent.
    patience: u32,
    /// Servo periods since the last report.
    silent: AtomicU32,
    begun: AtomicBool,
    dead: AtomicBool,
}

impl Liveness {
    /// `patience`: longest permitted silence of the main loop, in servo periods.
    #[must_use]
    pub const fn new(patience: u32) -> Self {
        Self {
            patience,
            silent: AtomicU32::new(0),
            begun: AtomicBool::new(false),
            dead: AtomicBool::new(false),
        }
    }

    /// The main loop is alive; call this once per turn.
    pub fn main_loop(&self) {
        self.begun.store(true, Ordering::Relaxed);
        self.silent.store(0, Ordering::Relaxed);
    }

    /// The servo interrupt is alive; call this once per period. Returns whether the main loop is alive too.
    pub fn servo(&self) -> bool {
        let silent = self.silent.load(Ordering::Relaxed);
        if silent >= self.patience {
            self.dead.store(true, Ordering::Relaxed);
        } else {
            self.silent.store(silent + 1, Ordering::Relaxed);
        }
        !self.dead.load(Ordering::Relaxed)
    }

    /// Whether the main loop has started.
    #[must_use]
    pub(crate) fn has_begun(&self) -> bool {
        self.begun.load(Ordering::Relaxed)
    }
}

/// Fault pin and watchdog, both owned by the servo interrupt.
pub struct Heart<H, W> {
    /// High while there is no fault. So a controller that has lost its power or its program, or is being reset, signals
    /// a fault too.
    healthy: H,
    watchdog: W,
}

/// Result of [`Heart::beat`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Beat {
    /// Both are alive.
    Alive,
    /// The main loop is dead: the pin is low, and the watchdog is no longer fed.
    Dead,
}

impl<H: OutputPin, W: Watchdog> Heart<H, W> {
    /// The pin stays low until the main loop has started.
    pub fn new(mut healthy: H, watchdog: W) -> Self {
        // Pins of a microcontroller do not fail.
        let _ = healthy.set_low();
        Self { healthy, watchdog }
    }

    /// Call this at the end of a servo period; `healthy` is the result of its [tick](super::Shell::tick).
    pub fn beat(&mut self, liveness: &Liveness, healthy: bool) -> Beat {
        let alive = liveness.servo();
        let high = alive && healthy && liveness.has_begun();
        let _ = self.healthy.set_state(PinState::from(high));
        if alive {
            self.watchdog.feed();
            Beat::Alive
        } else {
            Beat::Dead
        }
    }
}

#[cfg(test)]
mod tests;
