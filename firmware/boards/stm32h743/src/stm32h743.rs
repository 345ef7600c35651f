//! Drivers for the STM32H743. The pins are free on a NUCLEO-H743ZI2.
//!
//! | pin | function |
//! |---|---|
//! | PD8, PD9 | USART3: link to the host, 115 200 baud; on that board the serial line of the probe |
//! | PA4, PA5, PA6, PD7 | SPI1, slave: select, clock, out, in: the motion side |
//! | PB8, PB9 | I²C: clock, data: TMP117 called `bed`, address pin to ground |
//! | PB0 | high while there is no fault |
//! | PB1 | high while the drives are off (pulled down) |
//! | PE1 | lamp |

pub mod dma;
mod flash;
mod motion;
mod random;
mod serial;
mod silence;
pub mod supply;

pub use flash::SecondBank;
pub use motion::{LENGTH, Motion};
pub use random::Random;
pub use serial::Serial;
pub use silence::Silence;

use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale,
};
use embassy_stm32::time::Hertz;

/// Baud rate of the link.
pub const BAUD: u32 = 115_200;
/// The clock at the pin OSC_IN, Hz: on a NUCLEO-H743ZI2 it comes from the probe's crystal.
const INPUT: Hertz = Hertz(8_000_000);
/// Clock of the processor, Hz.
pub const CORE: u32 = 400_000_000;

/// The clocks: 400 MHz for the processor, 200 MHz for the buses, 100 MHz for the peripherals.
#[must_use]
pub fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse {
        freq: INPUT,
        mode: if cfg!(feature = "crystal") {
            HseMode::Oscillator
        } else {
            HseMode::Bypass
        },
    });
    rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL100,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale1;
    config
}
