//! Streams of DMA1 and DMA2, which move bytes between a peripheral and memory.

use core::sync::atomic::{AtomicU8, Ordering, fence};

use embassy_stm32::Peri;
use embassy_stm32::pac::dma::Dma;
use embassy_stm32::pac::dma::vals::{Dir, Dmdis, Pl};
use embassy_stm32::pac::{DMA1, DMA2, DMAMUX1, SPI1, USART3};
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH1, DMA2_CH0, DMA2_CH1};

/// What asks for bytes, or gives them: its number for the multiplexer (RM0433, table 121).
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Request {
    /// SPI1 has received.
    Spi1Receives = 37,
    /// SPI1 sends.
    Spi1Sends = 38,
    /// USART3 has received.
    Usart3Receives = 45,
    /// USART3 sends.
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

/// A stream, which belongs to its owner alone.
pub struct Stream {
    dma: Dma,
    number: usize,
    /// Its channel of the multiplexer.
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

    /// What SPI1 receives.
    pub fn spi1_receives(_: Peri<'static, DMA2_CH0>) -> Self {
        Self::new(DMA2, 0, 8, Request::Spi1Receives)
    }

    /// What SPI1 sends.
    pub fn spi1_sends(_: Peri<'static, DMA2_CH1>) -> Self {
        Self::new(DMA2, 1, 9, Request::Spi1Sends)
    }

    /// What USART3 receives.
    pub fn usart3_receives(_: Peri<'static, DMA1_CH0>) -> Self {
        Self::new(DMA1, 0, 0, Request::Usart3Receives)
    }

    /// What USART3 sends.
    pub fn usart3_sends(_: Peri<'static, DMA1_CH1>) -> Self {
        Self::new(DMA1, 1, 1, Request::Usart3Sends)
    }

    /// Starts a transfer of all `bytes`, or of all of them again and again. They are in memory that
    /// [`bare::shared`](crate::bare::shared) has opened.
    pub fn start(&mut self, bytes: &'static [AtomicU8], again: bool) {
        self.stop();
        let stream = self.dma.st(self.number);
        DMAMUX1
            .ccr(self.channel)
            .write(|w| w.set_dmareq_id(self.request as u8));
        stream.par().write_value(self.request.register());
        stream.m0ar().write_value(bytes.as_ptr() as u32);
        // All that is shared is 32 KiB.
        let count = u16::try_from(bytes.len()).unwrap_or(0);
        stream.ndtr().write(|w| w.set_ndt(count));
        // Direct mode: each byte at once.
        stream.fcr().write(|w| w.set_dmdis(Dmdis::ENABLED));
        // Bytes on both ends, as they are after a reset.
        stream.cr().write(|w| {
            w.set_dir(self.request.direction());
            w.set_minc(true);
            w.set_circ(again);
            w.set_pl(Pl::HIGH);
            // Without it a stream of a USART may stop for ever (ES0392, 2.3.1).
            w.set_trbuff(self.request.is_of_usart());
        });
        // What has been stored before is there when the hardware reads it.
        cortex_m::asm::dsb();
        fence(Ordering::SeqCst);
        stream.cr().modify(|w| w.set_en(true));
    }

    /// Ends a transfer wherever it is.
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
        // What is read after this is what the hardware has written.
        fence(Ordering::SeqCst);
    }

    /// Bytes that are left of a transfer; of one that begins again, until then.
    pub fn left(&self) -> usize {
        self.dma.st(self.number).ndtr().read().ndt().into()
    }

    /// Whether a transfer is under way.
    pub fn is_busy(&self) -> bool {
        self.dma.st(self.number).cr().read().en()
    }
}
