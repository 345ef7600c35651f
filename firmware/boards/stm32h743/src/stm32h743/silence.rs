//! The servo clock while frames are missing: TIM2.

use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::TIM2;
use trueaxis_firmware::controller;

use crate::RATE;

/// The timer for missing frames.
pub struct Silence {
    _timer: Peri<'static, TIM2>,
    /// Number of ticks in half a period.
    half: u32,
}

impl Silence {
    /// Starts the timer.
    pub fn start(timer: Peri<'static, TIM2>) -> Self {
        embassy_stm32::rcc::enable_and_reset::<TIM2>();
        let half = embassy_stm32::rcc::frequency::<TIM2>().0 / (2 * RATE);
        let registers = pac::TIM2;
        registers.arr().write_value(3 * half - 1);
        registers.dier().write(|w| w.set_uie(true));
        registers.cr1().write(|w| w.set_cen(true));
        Self {
            _timer: timer,
            half,
        }
    }
}

impl controller::Silence for Silence {
    fn restart(&mut self) {
        pac::TIM2.cnt().write_value(0);
        // Writing a zero clears a bit.
        pac::TIM2.sr().write(|w| w.set_uif(false));
    }

    fn is_over(&mut self) -> bool {
        let over = pac::TIM2.sr().read().uif();
        if over {
            // It counts one and a half periods, of which half a period has already passed.
            pac::TIM2.cnt().write_value(self.half);
            pac::TIM2.sr().write(|w| w.set_uif(false));
        }
        over
    }
}
