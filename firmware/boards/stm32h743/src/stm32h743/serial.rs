//! The serial line to the host: both directions by DMA, without an interrupt.

use core::sync::atomic::AtomicU8;

use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::USART3;
use embassy_stm32::usart::Uart;
use trueaxis_firmware::controller::{Line, LineDma};

use super::dma::Stream;
use crate::bare::shared::Shared;

/// The hardware of the line.
pub struct Serial {
    /// Owns the pins and the configured baud rate.
    _line: Uart<'static, Blocking>,
    receive: Stream,
    send: Stream,
}

impl Serial {
    /// Takes USART3, which must be configured, and its streams.
    pub fn start(
        line: Uart<'static, Blocking>,
        mut receive: Stream,
        send: Stream,
        memory: &'static Shared,
    ) -> Line<Self> {
        receive.start(memory.line.ring(), true);
        USART3.cr3().modify(|w| {
            w.set_dmar(true);
            w.set_dmat(true);
        });
        let serial = Self {
            _line: line,
            receive,
            send,
        };
        Line::start(serial, &memory.line, cortex_m::asm::wfi)
    }
}

impl LineDma for Serial {
    fn left(&self) -> usize {
        self.receive.left()
    }

    fn is_sending(&self) -> bool {
        self.send.is_busy()
    }

    fn send(&mut self, bytes: &'static [AtomicU8]) {
        self.send.start(bytes, false);
    }
}
