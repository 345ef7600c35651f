//! The servo clock while no frames come: TIM2.

use stm32f4xx_hal::pac::TIM2;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};
use trueaxis_firmware::controller;

use crate::RATE;

/// The timer.
pub struct Silence {
    timer: TIM2,
    /// Ticks of half a period.
    half: u32,
}

impl Silence {
    /// Starts it.
    pub fn start(timer: TIM2, rcc: &mut Rcc) -> Self {
        TIM2::enable(rcc);
        TIM2::reset(rcc);
        let half = rcc.clocks.timclk1().raw() / (2 * RATE);
        timer.arr().write(|w| w.arr().set(3 * half - 1));
        timer.dier().write(|w| w.uie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        Self { timer, half }
    }
}

impl controller::Silence for Silence {
    fn restart(&mut self) {
        self.timer.cnt().write(|w| w.cnt().set(0));
        self.timer.sr().write(|w| w.uif().clear());
    }

    fn is_over(&mut self) -> bool {
        let over = self.timer.sr().read().uif().bit_is_set();
        if over {
            // Of the one period and a half that it counts, half a period is over already.
            self.timer.cnt().write(|w| w.cnt().set(self.half));
            self.timer.sr().write(|w| w.uif().clear());
        }
        over
    }
}
