//! The serial line to the host: both directions by DMA, no interrupt.
//!
//! What comes in goes round in a ring. The host sends at most one frame before it has an answer, and
//! the ring holds three: nothing is lost however long the main loop is away. What goes out is
//! collected in one buffer while the other is being sent.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU8, Ordering};

use stm32f4xx_hal::dma::traits::Stream;
use stm32f4xx_hal::dma::{DmaChannel, DmaDirection, Stream5, Stream6};
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::serial::Serial;

use crate::bare::dma::{self, End};

/// Bytes that wait for the main loop, and in each direction out.
const RING: usize = 4096;
const BUFFER: usize = 1280;

const _: () = assert!(RING >= 3 * trueaxis::link::MOST_WIRE && BUFFER >= trueaxis::link::MOST_WIRE);

static COME: [AtomicU8; RING] = [const { AtomicU8::new(0) }; RING];
static GOING: [[AtomicU8; BUFFER]; 2] = [const { [const { AtomicU8::new(0) }; BUFFER] }; 2];

/// DMA1, RM0090 table 42: both are channel 4.
const CHANNEL: DmaChannel = DmaChannel::Channel4;

/// The line as the link sees it.
pub struct Uart {
    /// The pins, and what has set up the rate.
    _line: Serial<USART2>,
    receive: Stream5<DMA1>,
    send: Stream6<DMA1>,
    /// Place in the ring of the next byte for the main loop.
    next: usize,
    /// Which buffer is being filled, and how far.
    filling: usize,
    filled: usize,
}

impl Uart {
    /// Takes a line that is set up for DMA in both directions.
    pub fn start(line: Serial<USART2>, mut receive: Stream5<DMA1>, send: Stream6<DMA1>) -> Self {
        let to_memory = DmaDirection::PeripheralToMemory;
        dma::start(&mut receive, CHANNEL, to_memory, End::Usart2, &COME, true);
        Self {
            _line: line,
            receive,
            send,
            next: 0,
            filling: 0,
            filled: 0,
        }
    }

    /// Place in the ring of the next byte that comes.
    fn end(&self) -> usize {
        (RING - usize::from(self.receive.number_of_transfers())) % RING
    }

    /// Sends what has been collected, once the buffer before it is sent.
    fn hand_over(&mut self) {
        if self.filled == 0 {
            return;
        }
        while self.send.is_enabled() {
            core::hint::spin_loop();
        }
        if let Some(bytes) = GOING
            .get(self.filling)
            .and_then(|all| all.get(..self.filled))
        {
            let from_memory = DmaDirection::MemoryToPeripheral;
            dma::start(
                &mut self.send,
                CHANNEL,
                from_memory,
                End::Usart2,
                bytes,
                false,
            );
        }
        self.filling = 1 - self.filling;
        self.filled = 0;
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = Infallible;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while self.end() == self.next {
            cortex_m::asm::wfi();
        }
        let mut count = 0;
        for place in buffer {
            if self.end() == self.next {
                break;
            }
            *place = COME
                .get(self.next)
                .map_or(0, |byte| byte.load(Ordering::Relaxed));
            self.next = (self.next + 1) % RING;
            count += 1;
        }
        Ok(count)
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.end() != self.next)
    }
}

impl embedded_io::Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if self.filled == BUFFER {
            self.hand_over();
        }
        let places = GOING
            .get(self.filling)
            .and_then(|all| all.get(self.filled..));
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
