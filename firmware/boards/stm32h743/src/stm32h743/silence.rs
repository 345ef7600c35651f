//! The servo clock while no frames come: TIM2.

use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::TIM2;
use trueaxis_firmware::controller;

use crate::RATE;

/// The timer.
pub struct Silence {
    _timer: Peri<'static, TIM2>,
    /// Ticks of half a period.
    half: u32,
}

impl Silence {
    /// Starts it.
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
        // What is written as zero is cleared.
        pac::TIM2.sr().write(|w| w.set_uif(false));
    }

    fn is_over(&mut self) -> bool {
        let over = pac::TIM2.sr().read().uif();
        if over {
            // Of the one period and a half that it counts, half a period is over already.
            pac::TIM2.cnt().write_value(self.half);
            pac::TIM2.sr().write(|w| w.set_uif(false));
        }
        over
    }
}
