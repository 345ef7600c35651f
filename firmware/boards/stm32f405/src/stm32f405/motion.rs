//! The motion side, which is the master of SPI1: frames by DMA, with an interrupt at their end.
//!
//! While the select line is low the hardware does everything. At its rising edge [`frame`](Slave::frame) takes the
//! received bytes, and [`arm`](Slave::arm) prepares the next answer: after that the next frame may begin.

use core::sync::atomic::{AtomicU8, Ordering};

use stm32f4xx_hal::dma::traits::Stream;
use stm32f4xx_hal::dma::{DmaChannel, DmaDirection, Stream2, Stream3};
use stm32f4xx_hal::gpio::{Alternate, PA4};
use stm32f4xx_hal::pac::{DMA2, EXTI, SPI1};
use trueaxis_firmware::controller::Slave;
use trueaxis_firmware::spi::{MOST, length};

use crate::AXES;
use crate::bare::dma::{self, End};
use crate::bare::reset_spi1;

/// Length of a frame in bytes.
const LENGTH: usize = length(AXES);

static RECEIVED: [AtomicU8; LENGTH] = [const { AtomicU8::new(0) }; LENGTH];
static SENT: [AtomicU8; LENGTH] = [const { AtomicU8::new(0) }; LENGTH];

/// SPI1 as a slave.
pub struct Motion {
    spi: SPI1,
    /// DMA2, RM0090 table 43: both use channel 3.
    receive: Stream2<DMA2>,
    send: Stream3<DMA2>,
    select: PA4<Alternate<5>>,
    edges: EXTI,
    armed: bool,
}

impl Motion {
    /// Takes SPI1, whose clock must be running and whose pins must be connected, and the select line, whose rising edge
    /// triggers an interrupt.
    pub const fn new(
        spi: SPI1,
        receive: Stream2<DMA2>,
        send: Stream3<DMA2>,
        select: PA4<Alternate<5>>,
        edges: EXTI,
    ) -> Self {
        Self {
            spi,
            receive,
            send,
            select,
            edges,
            armed: false,
        }
    }
}

impl Slave for Motion {
    fn has_ended(&mut self) -> bool {
        let ended = self.edges.pr().read().pr4().bit_is_set();
        if ended {
            self.edges.pr().write(|w| w.pr4().clear_bit_by_one());
        }
        ended
    }

    fn frame<'b>(&mut self, bytes: &'b mut [u8; MOST]) -> &'b [u8] {
        if !self.armed {
            return &[];
        }
        self.armed = false;
        let missing = usize::from(self.receive.number_of_transfers());
        dma::stop(&mut self.receive);
        dma::stop(&mut self.send);
        for (byte, place) in bytes.iter_mut().zip(&RECEIVED) {
            *byte = place.load(Ordering::Relaxed);
        }
        bytes.get(..LENGTH - missing.min(LENGTH)).unwrap_or(&[])
    }

    fn arm(&mut self, answer: &[u8; MOST]) -> bool {
        if self.select.is_low() {
            return false;
        }
        for (place, byte) in SENT.iter().zip(answer) {
            place.store(*byte, Ordering::Relaxed);
        }
        // A frame that was cut off leaves a byte in the transmit buffer, which can only be removed this way.
        reset_spi1(&mut self.spi);
        // In the order required by RM0090, 28.3.9.
        self.spi.cr2().write(|w| w.rxdmaen().enabled());
        let channel = DmaChannel::Channel3;
        let to_memory = DmaDirection::PeripheralToMemory;
        dma::start(
            &mut self.receive,
            channel,
            to_memory,
            End::Spi1,
            &RECEIVED,
            false,
        );
        let from_memory = DmaDirection::MemoryToPeripheral;
        dma::start(
            &mut self.send,
            channel,
            from_memory,
            End::Spi1,
            &SENT,
            false,
        );
        self.spi.cr2().modify(|_, w| w.txdmaen().enabled());
        // Slave, mode 0, 8 bits, most significant bit first, hardware select.
        self.spi.cr1().write(|w| w.spe().enabled());
        self.armed = true;
        self.select.is_high()
    }
}
