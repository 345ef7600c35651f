//! The serial line to the host: both directions by DMA, without an interrupt.

use stm32f4xx_hal::dma::traits::Stream;
use stm32f4xx_hal::dma::{DmaChannel, DmaDirection, Stream5, Stream6};
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::serial::Serial;
use trueaxis_firmware::controller::{Line, LineDma, LineMemory};

use core::sync::atomic::AtomicU8;

use crate::bare::dma::{self, End};

static MEMORY: LineMemory = LineMemory::new();

/// DMA1, RM0090 table 42: both use channel 4.
const CHANNEL: DmaChannel = DmaChannel::Channel4;

/// The hardware of the line.
pub struct Uart {
    /// Owns the pins and the configured baud rate.
    _line: Serial<USART2>,
    receive: Stream5<DMA1>,
    send: Stream6<DMA1>,
}

impl Uart {
    /// Takes a line that is configured for DMA in both directions; call this once.
    pub fn start(
        line: Serial<USART2>,
        mut receive: Stream5<DMA1>,
        send: Stream6<DMA1>,
    ) -> Line<Self> {
        let to_memory = DmaDirection::PeripheralToMemory;
        let ring = MEMORY.ring();
        dma::start(&mut receive, CHANNEL, to_memory, End::Usart2, ring, true);
        let uart = Self {
            _line: line,
            receive,
            send,
        };
        Line::start(uart, &MEMORY, cortex_m::asm::wfi)
    }
}

impl LineDma for Uart {
    fn left(&self) -> usize {
        self.receive.number_of_transfers().into()
    }

    fn is_sending(&self) -> bool {
        self.send.is_enabled()
    }

    fn send(&mut self, bytes: &'static [AtomicU8]) {
        let from_memory = DmaDirection::MemoryToPeripheral;
        let end = End::Usart2;
        dma::start(&mut self.send, CHANNEL, from_memory, end, bytes, false);
    }
}
