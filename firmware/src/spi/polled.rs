//! For a board with its own clock, which polls the motion side once per period.

use embedded_hal::spi::SpiDevice;

use super::exchange::{Exchange, Sink, Source};
use super::frame::{MOST, length};
use super::intake::Tolerance;

/// The exchange with a motion side that is the slave on an SPI bus.
///
/// The frames of the master and the periods of this side have two clocks: occasionally a frame is skipped or used
/// twice, see [`Tolerance`]. If the motion side can be the master, that is better.
#[derive(Debug)]
pub struct Polled<D, const AXES: usize> {
    device: D,
    exchange: Exchange<AXES>,
}

impl<D: SpiDevice, const AXES: usize> Polled<D, AXES> {
    /// Nothing has been exchanged yet.
    pub const fn new(device: D, tolerance: Tolerance) -> Self {
        Self {
            device,
            exchange: Exchange::new(tolerance),
        }
    }

    /// Exchanges one frame; call it once per period, before the update.
    pub fn poll(&mut self) -> (Source<'_, AXES>, Sink<'_, AXES>) {
        let (mut said, mut received) = ([0; MOST], [0; MOST]);
        self.exchange.answer(&mut said);
        let received = received.get_mut(..length(AXES)).unwrap_or_default();
        let said = said.get(..length(AXES)).unwrap_or_default();
        // A failed transfer leaves no valid frame in the buffer.
        match self.device.transfer(received, said) {
            Ok(()) => self.exchange.hear(received),
            Err(_) => self.exchange.hear(&[]),
        }
        self.exchange.ends()
    }

    /// The SPI device.
    pub const fn device(&mut self) -> &mut D {
        &mut self.device
    }

    /// The exchange, for its counts.
    pub const fn exchange(&self) -> &Exchange<AXES> {
        &self.exchange
    }
}
