//! The motion side, which is the master of SPI1: frames by DMA, with an interrupt at their end.
//!
//! While the select line is low the hardware does everything. At its rising edge [`frame`](Slave::frame) takes the
//! received bytes, and [`arm`](Slave::arm) prepares the next answer: after that the next frame may begin.

use core::sync::atomic::Ordering;

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::pac::{self, EXTI, SYSCFG};
use embassy_stm32::peripherals::{PA4, PA5, PA6, PD7, SPI1};
use trueaxis_firmware::controller::Slave;
use trueaxis_firmware::spi::{MOST, length};

use super::dma::Stream;
use crate::AXES;
use crate::bare::shared::Shared;

/// Length of a frame in bytes.
pub const LENGTH: usize = length(AXES);

/// Line of the select pin among the external interrupts.
const LINE: usize = 4;
/// Number of DMA polls until the last byte has certainly passed the FIFO of the SPI: a microsecond.
const LOOKS: u32 = 32;

/// The pins: select, clock, out, in.
pub type Pins = (
    Peri<'static, PA4>,
    Peri<'static, PA5>,
    Peri<'static, PA6>,
    Peri<'static, PD7>,
);

/// SPI1 as a slave.
pub struct Motion {
    _spi: Peri<'static, SPI1>,
    select: Flex<'static>,
    /// They stay connected as long as they have an owner.
    _others: [Flex<'static>; 3],
    receive: Stream,
    send: Stream,
    memory: &'static Shared,
    armed: bool,
}

impl Motion {
    /// Takes SPI1; from now on the rising edge of select triggers an interrupt.
    pub fn new(
        spi: Peri<'static, SPI1>,
        (select, clock, out, into): Pins,
        receive: Stream,
        send: Stream,
        memory: &'static Shared,
    ) -> Self {
        embassy_stm32::rcc::enable_and_reset::<SPI1>();
        let connected = |mut pin: Flex<'static>, kind| {
            pin.set_as_af_unchecked(5, kind);
            pin
        };
        // Without a motion side it is deselected.
        let select = connected(Flex::new(select), AfType::input(Pull::Up));
        let fast = AfType::output(OutputType::PushPull, Speed::VeryHigh);
        let others = [
            connected(Flex::new(clock), AfType::input(Pull::None)),
            connected(Flex::new(out), fast),
            connected(Flex::new(into), AfType::input(Pull::None)),
        ];
        // Port A.
        SYSCFG.exticr(LINE / 4).modify(|w| w.set_exti(LINE % 4, 0));
        EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
        EXTI.imr(0).modify(|w| w.set_line(LINE, true));
        Self {
            _spi: spi,
            select,
            _others: others,
            receive,
            send,
            memory,
            armed: false,
        }
    }
}

impl Slave for Motion {
    fn has_ended(&mut self) -> bool {
        let ended = EXTI.pr(0).read().line(LINE);
        if ended {
            // Writing a one clears a bit.
            EXTI.pr(0).write(|w| w.set_line(LINE, true));
        }
        ended
    }

    fn frame<'b>(&mut self, bytes: &'b mut [u8; MOST]) -> &'b [u8] {
        if !self.armed {
            return &[];
        }
        self.armed = false;
        for _ in 0..LOOKS {
            if self.receive.left() == 0 {
                break;
            }
        }
        let missing = self.receive.left();
        self.receive.stop();
        self.send.stop();
        for (byte, place) in bytes.iter_mut().zip(&self.memory.received) {
            *byte = place.load(Ordering::Relaxed);
        }
        bytes.get(..LENGTH - missing.min(LENGTH)).unwrap_or(&[])
    }

    fn arm(&mut self, answer: &[u8; MOST]) -> bool {
        if self.select.is_low() {
            return false;
        }
        for (place, byte) in self.memory.sent.iter().zip(answer) {
            place.store(*byte, Ordering::Relaxed);
        }
        let spi = pac::SPI1;
        // Empties both FIFOs, which contain bytes of a frame that was cut off.
        spi.cr1().write(|w| w.set_spe(false));
        spi.ifcr().write(|w| {
            w.set_udrc(true);
            w.set_ovrc(true);
            w.set_modfc(true);
            w.set_tifrec(true);
        });
        // Slave, mode 0, most significant bit first, hardware select: all as after a reset. 8 bits, with a request for
        // each byte.
        spi.cfg2().write(|_| ());
        spi.cfg1().write(|w| {
            w.set_dsize(7);
            w.set_crcsize(7);
            w.set_rxdmaen(true);
        });
        // In the order required by RM0433, 50.4.14.
        self.receive.start(&self.memory.received, false);
        self.send.start(&self.memory.sent, false);
        spi.cfg1().modify(|w| w.set_txdmaen(true));
        spi.cr1().write(|w| w.set_spe(true));
        self.armed = true;
        self.select.is_high()
    }
}
