//! Servo periods for a board that is the SPI slave: clocked by the end of a frame, or by a timer while frames are
//! missing.

use trueaxis::Room;

use super::servo::Shell;
use crate::device::{Clock, Regularity};
use crate::spi::{Exchange, MOST, Tolerance};

/// An SPI slave whose hardware transfers the bytes while the select line is low.
pub trait Slave {
    /// Whether a frame has ended since the last call.
    fn has_ended(&mut self) -> bool;
    /// The bytes of the frame that has ended: fewer than expected if it was cut off, none if no answer was prepared for
    /// it.
    fn frame<'b>(&mut self, bytes: &'b mut [u8; MOST]) -> &'b [u8];
    /// Prepares the answer to the next frame, using as many bytes as a frame has. Returns false if that frame has
    /// already begun: it is lost.
    fn arm(&mut self, answer: &[u8; MOST]) -> bool;
}

/// A timer that fires when a frame is half a period late, and then once per period.
pub trait Silence {
    /// A frame has arrived: start waiting for the next one.
    fn restart(&mut self);
    /// Whether the frame is overdue; the timer fires again one period later.
    fn is_over(&mut self) -> bool;
}

/// Turns frames into servo periods, for the servo interrupt, which is triggered both by the end of a frame and by the
/// timer.
pub struct ByFrames<S, T, const AXES: usize> {
    slave: S,
    silence: T,
    exchange: Exchange<AXES>,
}

impl<S: Slave, T: Silence, const AXES: usize> ByFrames<S, T, AXES> {
    /// Prepares the first answer; from here on both interrupts may occur.
    pub fn start(mut slave: S, silence: T, tolerance: Tolerance) -> Self {
        let exchange = Exchange::new(tolerance);
        let mut answer = [0; MOST];
        exchange.answer(&mut answer);
        // If a frame has already begun it is lost, but the next one is not.
        let _ = slave.arm(&answer);
        Self {
            slave,
            silence,
            exchange,
        }
    }

    /// Runs one servo period if one is due and returns the result of [`Shell::tick`]. `None` if the other of the two
    /// interrupts has already handled it.
    pub fn period<C>(&mut self, shell: &Shell<C>, clock: &impl Clock) -> Option<bool>
    where
        C: Room<Axes<f32> = [f32; AXES]>,
    {
        let ended = self.slave.has_ended();
        if ended {
            self.silence.restart();
            self.exchange.hear(self.slave.frame(&mut [0; MOST]));
        } else if !self.silence.is_over() {
            return None;
        }
        let (mut source, mut sink) = self.exchange.ends();
        let healthy = shell.tick(&mut source, &mut sink, clock);
        if ended {
            let mut answer = [0; MOST];
            self.exchange.answer(&mut answer);
            if !self.slave.arm(&answer) {
                shell.overrun();
            }
        }
        Some(healthy)
    }

    /// Counts so far.
    #[must_use]
    pub const fn seen(&self) -> Regularity {
        self.exchange.seen()
    }
}

#[cfg(test)]
mod tests;
