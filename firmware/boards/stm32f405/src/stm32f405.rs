//! Drivers for the STM32F405.
//!
//! | pin | function |
//! |---|---|
//! | PA2, PA3 | USART2: link to the host, 115 200 baud |
//! | PA4, PA5, PA6, PA7 | SPI1, slave: select, clock, out, in: the motion side |
//! | PB6, PB7 | I²C: clock, data: TMP117 called `bed`, address pin to ground |
//! | PB0 | high while there is no fault |
//! | PB1 | high while the drives are off (pulled down) |
//! | PC13 | lamp |

mod flash;
mod motion;
mod random;
mod serial;
mod silence;
pub mod supply;
mod watchdog;

pub use flash::InternalFlash;
pub use motion::Motion;
pub use random::Random;
pub use serial::Uart;
pub use silence::Silence;
pub use watchdog::Dog;

use stm32f4xx_hal::time::Hertz;

/// Baud rate of the link.
pub const BAUD: u32 = 115_200;
/// The crystal; not needed with the feature `hsi`.
pub const CRYSTAL: Hertz = Hertz::MHz(8);
