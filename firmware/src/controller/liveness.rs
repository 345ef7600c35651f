//! Whether servo interrupt and main loop both live, and what follows for watchdog and fault pin.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embedded_hal::digital::{OutputPin, PinState};

/// A watchdog that resets the processor unless it is fed.
pub trait Watchdog {
    /// It has to wait as long as before.
    fn feed(&mut self);
}

/// Shared between the two, for a `static`: the main loop says that it lives, and the servo
/// interrupt looks how long ago that was.
///
/// Whoever has been dead once stays so, until the watchdog has started the controller again.
pub struct Liveness {
    /// So many servo periods the main loop may be silent.
    patience: u32,
    /// Periods since it has said something.
    silent: AtomicU32,
    begun: AtomicBool,
    dead: AtomicBool,
}

impl Liveness {
    /// The longest silence of the main loop, in servo periods.
    #[must_use]
    pub const fn new(patience: u32) -> Self {
        Self {
            patience,
            silent: AtomicU32::new(0),
            begun: AtomicBool::new(false),
            dead: AtomicBool::new(false),
        }
    }

    /// The main loop lives: once per turn.
    pub fn main_loop(&self) {
        self.begun.store(true, Ordering::Relaxed);
        self.silent.store(0, Ordering::Relaxed);
    }

    /// The servo interrupt lives: once per period. Whether the main loop does too.
    pub fn servo(&self) -> bool {
        let silent = self.silent.load(Ordering::Relaxed);
        if silent >= self.patience {
            self.dead.store(true, Ordering::Relaxed);
        } else {
            self.silent.store(silent + 1, Ordering::Relaxed);
        }
        !self.dead.load(Ordering::Relaxed)
    }

    /// Whether the main loop has begun.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.begun.load(Ordering::Relaxed)
    }
}

/// Fault pin and watchdog, which belong to the servo interrupt.
pub struct Heart<H, W> {
    /// High while there is no fault: a controller that has lost its power or its program, or is
    /// being reset, reports one too.
    healthy: H,
    watchdog: W,
}

/// What [`Heart::beat`] has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Beat {
    /// Both live.
    Alive,
    /// The main loop does not: the pin is low, and the watchdog will not be fed any more.
    Dead,
}

impl<H: OutputPin, W: Watchdog> Heart<H, W> {
    /// The pin is low until the main loop has begun.
    pub fn new(mut healthy: H, watchdog: W) -> Self {
        // Pins of a microcontroller do not fail.
        let _ = healthy.set_low();
        Self { healthy, watchdog }
    }

    /// The end of a servo period: `healthy` as its [tick](super::Shell::tick) says.
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
