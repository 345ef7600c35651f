//! Supply, clock, and the cause of the last reset.

use embassy_stm32::pac::{DBGMCU, FLASH, RCC};
use trueaxis_firmware::record::Flags;

/// Brown-out level 3.
const LEVEL: u8 = 3;
/// Read protection level 0: none.
const OPEN: u8 = 0xAA;

/// Reads the cause of the last reset from the hardware and clears it for the next one.
pub fn flags() -> Flags {
    let rsr = RCC.rsr().read();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    Flags {
        power_on: rsr.porrstf(),
        brown_out: rsr.borrstf(),
        watchdog: rsr.iwdg1rstf(),
        software: rsr.sftrstf(),
        pin: rsr.pinrstf(),
    }
}

/// Makes sure that the chip is held in reset below 2.7 V (brown-out level 3): with a nominal supply of 3.3 V that means
/// the supply is failing, and flash must not be programmed then. It is written once in
/// the life of a chip because the option bytes keep it.
///
/// RM0433, 4.4.3. Changes only this level in the option bytes, and nothing on a read-protected chip. Call it before the
/// servo interrupt starts, because the program waits meanwhile.
pub fn watch_over() {
    let options = FLASH.optsr_cur().read();
    if options.bor_lev() == LEVEL || options.rdp() != OPEN {
        return;
    }
    let busy = || FLASH.optsr_cur().read().opt_busy();
    while busy() {}
    if FLASH.optcr().read().optlock() {
        for key in [0x0819_2A3B, 0x4C5D_6E7F] {
            FLASH.optkeyr().write_value(key);
        }
    }
    FLASH.optsr_prg().modify(|w| w.set_bor_lev(LEVEL));
    FLASH.optcr().modify(|w| w.set_optstart(true));
    while busy() {}
    FLASH.optcr().modify(|w| w.set_optlock(true));
}

/// Makes the processor detect a stopped external clock: a non-maskable exception (NMI).
pub fn watch_clock() {
    RCC.cr().modify(|w| w.set_hsecsson(true));
}

/// A probe that halts the program must not cause a fault: watchdog and timer stop too.
pub fn wait_for_probe() {
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    DBGMCU.apb1lfzr1().modify(|w| w.set_tim2(true));
}
