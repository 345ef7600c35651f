//! A serial line whose bytes are transferred by DMA, without an interrupt of its own.
//!
//! Received bytes go into a ring. The host sends at most one frame before it has an answer, and the ring holds three,
//! so nothing is lost however long the main loop is busy. Outgoing bytes are collected in one buffer while the other is
//! being sent.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, Ordering};

/// Length in bytes of the receive ring and of each send buffer.
const RING: usize = 4096;
const BUFFER: usize = 1280;

const _: () = assert!(RING >= 3 * trueaxis::link::MOST_WIRE && BUFFER >= trueaxis::link::MOST_WIRE);

/// The hardware that transfers the bytes.
pub trait LineDma {
    /// Bytes left before the ring wraps: from its length down to 1. From [`Line::start`] on the hardware fills
    /// [`LineMemory::ring`] cyclically.
    fn left(&self) -> usize;
    /// Whether bytes are still being sent.
    fn is_sending(&self) -> bool;
    /// Sends these bytes; no earlier send may still be in progress.
    fn send(&mut self, bytes: &'static [AtomicU8]);
}

/// Buffers of the line, for a `static` that the DMA can reach.
pub struct LineMemory {
    come: [AtomicU8; RING],
    going: [[AtomicU8; BUFFER]; 2],
}

impl Default for LineMemory {
    fn default() -> Self {
        Self::new()
    }
}

impl LineMemory {
    /// Empty buffers.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            come: [const { AtomicU8::new(0) }; RING],
            going: [const { [const { AtomicU8::new(0) }; BUFFER] }; 2],
        }
    }

    /// The buffer that the hardware fills cyclically.
    #[must_use]
    pub const fn ring(&'static self) -> &'static [AtomicU8] {
        &self.come
    }
}

/// The line as used by the link.
pub struct Line<D> {
    dma: D,
    memory: &'static LineMemory,
    /// Waits for an interrupt.
    wait: fn(),
    /// Position in the ring of the next byte for the main loop.
    next: usize,
    /// Index of the buffer being filled, and its fill level.
    filling: usize,
    filled: usize,
}

impl<D: LineDma> Line<D> {
    /// Starts using a line that receives into the ring of `memory`. `wait` returns after an interrupt, no later than
    /// that of the next servo period.
    pub const fn start(dma: D, memory: &'static LineMemory, wait: fn()) -> Self {
        Self {
            dma,
            memory,
            wait,
            next: 0,
            filling: 0,
            filled: 0,
        }
    }

    /// Position in the ring of the next byte to be received.
    fn end(&self) -> usize {
        RING.saturating_sub(self.dma.left()) % RING
    }

    /// Sends the collected bytes once the previous buffer has been sent.
    fn hand_over(&mut self) {
        if self.filled == 0 {
            return;
        }
        while self.dma.is_sending() {
            core::hint::spin_loop();
        }
        let buffer = self.memory.going.get(self.filling);
        if let Some(bytes) = buffer.and_then(|all| all.get(..self.filled)) {
            self.dma.send(bytes);
        }
        self.filling = 1 - self.filling;
        self.filled = 0;
    }
}

impl<D> embedded_io::ErrorType for Line<D> {
    type Error = Infallible;
}

impl<D: LineDma> embedded_io::Read for Line<D> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while self.end() == self.next {
            (self.wait)();
        }
        let mut count = 0;
        for place in buffer {
            if self.end() == self.next {
                break;
            }
            let byte = self.memory.come.get(self.next);
            *place = byte.map_or(0, |byte| byte.load(Ordering::Relaxed));
            self.next = (self.next + 1) % RING;
            count += 1;
        }
        Ok(count)
    }
}

impl<D: LineDma> embedded_io::ReadReady for Line<D> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.end() != self.next)
    }
}

impl<D: LineDma> embedded_io::Write for Line<D> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if self.filled == BUFFER {
            self.hand_over();
        }
        let buffer = self.memory.going.get(self.filling);
        let places = buffer.and_then(|all| all.get(self.filled..));
        let mut count = 0;
        for (place, byte) in places.unwrap_or(&[]).iter().zip(bytes) {
            place.store(*byte, Ordering::Relaxed);
            count += 1;
        }
        self.filled += count;
        Ok(count)
    }

    /// Returns when everything has been handed to the hardware, which continues by itself.
    fn flush(&mut self) -> Result<(), Infallible> {
        self.hand_over();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
