//! The serial line: QEMU's `-serial`. Received in an interrupt, because polling the registers would keep QEMU from its
//! other work.

use core::convert::Infallible;

use heapless::spsc::{Consumer, Queue};

use crate::bare::uart;

/// The serial line.
pub struct Uart {
    bytes: Consumer<'static, u8>,
}

impl Uart {
    /// Enables it; `queue` connects the interrupt with the link.
    pub fn start<const N: usize>(queue: &'static mut Queue<u8, N>) -> Self {
        let (producer, bytes) = queue.split();
        uart::start(producer);
        Self { bytes }
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = Infallible;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        while !buffer.is_empty() && !self.bytes.ready() {
            cortex_m::asm::wfi();
        }
        let come = core::iter::from_fn(|| self.bytes.dequeue());
        let places = buffer.iter_mut().zip(come);
        Ok(places.map(|(place, byte)| *place = byte).count())
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.bytes.ready())
    }
}

impl embedded_io::Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        let Some(byte) = buffer.first() else {
            return Ok(0);
        };
        while !uart::writable() {}
        uart::send(*byte);
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while !uart::writable() {}
        Ok(())
    }
}
