//! A serial line whose bytes are moved by DMA, with no interrupt of its own.
//!
//! What comes in goes round in a ring. The host sends at most one frame before it has an answer, and
//! the ring holds three: nothing is lost however long the main loop is away. What goes out is
//! collected in one buffer while the other is being sent.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, Ordering};

/// Bytes that wait for the main loop, and in each direction out.
const RING: usize = 4096;
const BUFFER: usize = 1280;

const _: () = assert!(RING >= 3 * trueaxis::link::MOST_WIRE && BUFFER >= trueaxis::link::MOST_WIRE);

/// What moves the bytes.
pub trait LineDma {
    /// Bytes that fit into the ring before it begins anew: its length, down to 1. From
    /// [`Line::start`] on the hardware goes round in [`LineMemory::ring`].
    fn left(&self) -> usize;
    /// Whether bytes are still being sent.
    fn is_sending(&self) -> bool;
    /// Sends these, none being sent any more.
    fn send(&mut self, bytes: &'static [AtomicU8]);
}

/// The bytes on their way, for a `static` that the DMA reaches.
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
    /// Nothing has come.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            come: [const { AtomicU8::new(0) }; RING],
            going: [const { [const { AtomicU8::new(0) }; BUFFER] }; 2],
        }
    }

    /// Where the hardware puts what comes, again and again.
    #[must_use]
    pub const fn ring(&'static self) -> &'static [AtomicU8] {
        &self.come
    }
}

/// The line as the link sees it.
pub struct Line<D> {
    dma: D,
    memory: &'static LineMemory,
    /// Returns after an interrupt.
    wait: fn(),
    /// Place in the ring of the next byte for the main loop.
    next: usize,
    /// Which buffer is being filled, and how far.
    filling: usize,
    filled: usize,
}

impl<D: LineDma> Line<D> {
    /// Takes a line that receives into the ring of `memory` from now on; `wait` returns after an
    /// interrupt, at the latest that of the next servo period.
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

    /// Place in the ring of the next byte that comes.
    fn end(&self) -> usize {
        RING.saturating_sub(self.dma.left()) % RING
    }

    /// Sends what has been collected, once the buffer before it is sent.
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

    /// Returns when all has been given to the hardware, which goes on by itself.
    fn flush(&mut self) -> Result<(), Infallible> {
        self.hand_over();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
