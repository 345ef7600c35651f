//! The servo period of a board that is the slave: the end of a frame, or a timer while none come.

use trueaxis::Room;

use super::servo::Shell;
use crate::device::{Clock, Regularity};
use crate::spi::{Exchange, MOST, Tolerance};

/// An SPI slave whose bytes are moved by the hardware while the select line is low.
pub trait Slave {
    /// Whether a frame has ended since this was asked last.
    fn has_ended(&mut self) -> bool;
    /// The bytes of the frame that has ended: fewer than it should have if it was cut off, none if
    /// nothing was laid out for it.
    fn frame<'b>(&mut self, bytes: &'b mut [u8; MOST]) -> &'b [u8];
    /// Lays out the answer for the next frame, of which it takes as many bytes as a frame has. False
    /// if that frame has begun: it is lost.
    fn arm(&mut self, answer: &[u8; MOST]) -> bool;
}

/// A timer that calls when a frame is half a period late, and then once per period.
pub trait Silence {
    /// A frame has come: from now on the next one is waited for.
    fn restart(&mut self);
    /// Whether none has come in time; the next call follows a period later.
    fn is_over(&mut self) -> bool;
}

/// What makes servo periods out of frames: for the servo interrupt, which the end of a frame and the
/// timer call.
pub struct ByFrames<S, T, const AXES: usize> {
    slave: S,
    silence: T,
    exchange: Exchange<AXES>,
}

impl<S: Slave, T: Silence, const AXES: usize> ByFrames<S, T, AXES> {
    /// The first answer is laid out; both interrupts may come.
    pub fn start(mut slave: S, silence: T, tolerance: Tolerance) -> Self {
        let exchange = Exchange::new(tolerance);
        let mut answer = [0; MOST];
        exchange.answer(&mut answer);
        // One that has begun is lost; the next is not.
        let _ = slave.arm(&answer);
        Self {
            slave,
            silence,
            exchange,
        }
    }

    /// One servo period, if there is one: what [`Shell::tick`] says. `None` if the other of the two
    /// interrupts has done it.
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

    /// What has been counted.
    #[must_use]
    pub const fn seen(&self) -> Regularity {
        self.exchange.seen()
    }
}

#[cfg(test)]
mod tests;
