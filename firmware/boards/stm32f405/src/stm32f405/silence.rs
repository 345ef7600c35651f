//! The servo clock while frames are missing: TIM2.

use stm32f4xx_hal::pac::TIM2;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};
use trueaxis_firmware::controller;

use crate::RATE;

/// The timer for missing frames.
pub struct Silence {
    timer: TIM2,
    /// Number of ticks in half a period.
    half: u32,
}

impl Silence {
    /// Starts the timer.
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
            // It counts one and a half periods, of which half a period has already passed.
            self.timer.cnt().write(|w| w.cnt().set(self.half));
            self.timer.sr().write(|w| w.uif().clear());
        }
        over
    }
}
