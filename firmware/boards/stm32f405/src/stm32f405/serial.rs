//! The serial line to the host: received in an interrupt, sent from the main loop.

use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::nb::{self, block};
use stm32f4xx_hal::pac::USART2;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Error, Rx, Tx};
use trueaxis_firmware::controller::received;

/// The receiving half: for the interrupt.
pub struct Received {
    line: Rx<USART2>,
    bytes: Producer<'static, u8>,
}

impl Received {
    /// Bytes of `line` are handed over through `bytes`.
    pub const fn new(line: Rx<USART2>, bytes: Producer<'static, u8>) -> Self {
        Self { line, bytes }
    }

    /// Takes what has come.
    pub fn take(&mut self) {
        loop {
            match self.line.read() {
                // Without room it is lost, and so is its frame, which is asked for again.
                Ok(byte) => drop(self.bytes.enqueue(byte)),
                // A damaged byte damages its frame, which is noticed there.
                Err(nb::Error::Other(_)) => {}
                Err(nb::Error::WouldBlock) => return,
            }
        }
    }
}

/// The line as the link sees it.
pub struct Uart {
    line: Tx<USART2>,
    bytes: Consumer<'static, u8>,
}

impl Uart {
    /// Sends on `line`; what has come is in `bytes`.
    pub const fn new(line: Tx<USART2>, bytes: Consumer<'static, u8>) -> Self {
        Self { line, bytes }
    }
}

/// An error of the line.
#[derive(Clone, Copy, Debug)]
pub struct LineError(pub Error);

impl core::fmt::Display for LineError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("serial line")
    }
}

impl core::error::Error for LineError {}

impl embedded_io::Error for LineError {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = LineError;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, LineError> {
        Ok(received(&mut self.bytes, buffer, cortex_m::asm::wfi))
    }
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, LineError> {
        Ok(self.bytes.ready())
    }
}

impl embedded_io::Write for Uart {
    fn write(&mut self, buffer: &[u8]) -> Result<usize, LineError> {
        let Some(&byte) = buffer.first() else {
            return Ok(0);
        };
        block!(self.line.write(byte)).map_err(LineError)?;
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), LineError> {
        block!(self.line.flush()).map_err(LineError)
    }
}
