//! Streams of DMA1 and DMA2, which move bytes between a peripheral and memory.

use core::sync::atomic::{AtomicU8, Ordering, fence};

use embassy_stm32::Peri;
use embassy_stm32::pac::dma::Dma;
use embassy_stm32::pac::dma::vals::{Dir, Dmdis, Pl};
use embassy_stm32::pac::{DMA1, DMA2, DMAMUX1, SPI1, USART3};
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH1, DMA2_CH0, DMA2_CH1};

/// Source of a DMA request: its number for the multiplexer (RM0433, table 121).
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Request {
    /// SPI1 has received a byte.
    Spi1Receives = 37,
    /// SPI1 can send a byte.
    Spi1Sends = 38,
    /// USART3 has received a byte.
    Usart3Receives = 45,
    /// USART3 can send a byte.
    Usart3Sends = 46,
}

impl Request {
    /// The data register.
    fn register(self) -> u32 {
        match self {
            Self::Spi1Receives => SPI1.rxdr8().as_ptr() as u32,
            Self::Spi1Sends => SPI1.txdr8().as_ptr() as u32,
            Self::Usart3Receives => USART3.rdr().as_ptr() as u32,
            Self::Usart3Sends => USART3.tdr().as_ptr() as u32,
        }
    }

    fn direction(self) -> Dir {
        match self {
            Self::Spi1Receives | Self::Usart3Receives => Dir::PERIPHERAL_TO_MEMORY,
            Self::Spi1Sends | Self::Usart3Sends => Dir::MEMORY_TO_PERIPHERAL,
        }
    }

    fn is_of_usart(self) -> bool {
        matches!(self, Self::Usart3Receives | Self::Usart3Sends)
    }
}

/// A stream with exclusive ownership.
pub struct Stream {
    dma: Dma,
    number: usize,
    /// The channel of the multiplexer that requests it.
    channel: usize,
    request: Request,
}

impl Stream {
    const fn new(dma: Dma, number: usize, channel: usize, request: Request) -> Self {
        Self {
            dma,
            number,
            channel,
            request,
        }
    }

    /// The stream for bytes received by SPI1.
    pub fn spi1_receives(_: Peri<'static, DMA2_CH0>) -> Self {
        Self::new(DMA2, 0, 8, Request::Spi1Receives)
    }

    /// The stream for bytes sent by SPI1.
    pub fn spi1_sends(_: Peri<'static, DMA2_CH1>) -> Self {
        Self::new(DMA2, 1, 9, Request::Spi1Sends)
    }

    /// The stream for bytes received by USART3.
    pub fn usart3_receives(_: Peri<'static, DMA1_CH0>) -> Self {
        Self::new(DMA1, 0, 0, Request::Usart3Receives)
    }

    /// The stream for bytes sent by USART3.
    pub fn usart3_sends(_: Peri<'static, DMA1_CH1>) -> Self {
        Self::new(DMA1, 1, 1, Request::Usart3Sends)
    }

    /// Starts a transfer of all `bytes`, once or cyclically. They must be in memory that was opened by
    /// [`bare::shared`](crate::bare::shared).
    pub fn start(&mut self, bytes: &'static [AtomicU8], again: bool) {
        self.stop();
        let stream = self.dma.st(self.number);
        DMAMUX1
            .ccr(self.channel)
            .write(|w| w.set_dmareq_id(self.request as u8));
        stream.par().write_value(self.request.register());
        stream.m0ar().write_value(bytes.as_ptr() as u32);
        // The shared memory is 32 KiB in total.
        let count = u16::try_from(bytes.len()).unwrap_or(0);
        stream.ndtr().write(|w| w.set_ndt(count));
        // Direct mode: each byte immediately.
        stream.fcr().write(|w| w.set_dmdis(Dmdis::ENABLED));
        // Bytes on both ends, as they are after a reset.
        stream.cr().write(|w| {
            w.set_dir(self.request.direction());
            w.set_minc(true);
            w.set_circ(again);
            w.set_pl(Pl::HIGH);
            // Without it a stream of a USART may stop permanently (ES0392, 2.3.1).
            w.set_trbuff(self.request.is_of_usart());
        });
        // Earlier stores must be visible to the hardware.
        cortex_m::asm::dsb();
        fence(Ordering::SeqCst);
        stream.cr().modify(|w| w.set_en(true));
    }

    /// Ends a transfer at any point.
    pub fn stop(&mut self) {
        let stream = self.dma.st(self.number);
        stream.cr().modify(|w| w.set_en(false));
        while stream.cr().read().en() {}
        let (group, place) = (self.number / 4, self.number % 4);
        self.dma.ifcr(group).write(|w| {
            w.set_feif(place, true);
            w.set_dmeif(place, true);
            w.set_teif(place, true);
            w.set_htif(place, true);
            w.set_tcif(place, true);
        });
        // Later reads must see what the hardware has written.
        fence(Ordering::SeqCst);
    }

    /// Bytes left in a transfer, or until a cyclic one restarts.
    pub fn left(&self) -> usize {
        self.dma.st(self.number).ndtr().read().ndt().into()
    }

    /// Whether a transfer is in progress.
    pub fn is_busy(&self) -> bool {
        self.dma.st(self.number).cr().read().en()
    }
}
