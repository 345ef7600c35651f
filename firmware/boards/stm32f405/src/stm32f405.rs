//! Drivers for the STM32F405.
//!
//! | pin | what |
//! |---|---|
//! | PA2, PA3 | USART2: link to the host, 115 200 baud |
//! | PA4, PA5, PA6, PA7 | SPI1: select, clock, in, out: the motion side |
//! | PB6, PB7 | I²C: clock, data: TMP117 called `bed`, address pin to ground |
//! | PB0 | high while there is no fault |
//! | PB1 | high while the drives are off (pulled down) |
//! | PC13 | lamp |

mod flash;
mod serial;

pub use flash::InternalFlash;
pub use serial::{Received, Uart};

use cortex_m::peripheral::DWT;
use trueaxis::link::CostUnit;
use trueaxis_firmware::device::Clock;

/// Baud rate of the link.
pub const BAUD: u32 = 115_200;

/// The cycle counter of the processor, which must have been enabled.
pub struct Cycles;

impl Clock for Cycles {
    const UNIT: CostUnit = CostUnit::Cycles;

    fn now(&self) -> u32 {
        DWT::cycle_count()
    }
}
