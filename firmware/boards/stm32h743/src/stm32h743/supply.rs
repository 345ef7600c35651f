//! Supply, clock, and why the last reset was.

use embassy_stm32::pac::{DBGMCU, FLASH, RCC};
use trueaxis_firmware::record::Flags;

/// Brown-out level 3.
const LEVEL: u8 = 3;
/// Level 0 of the read protection: none.
const OPEN: u8 = 0xAA;

/// Why the last reset was, as the hardware says; the next one begins with a clean slate.
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

/// Sees to it that the chip is held in reset below 2.7 V (brown-out level 3): of 3.3 V that is a supply
/// which fails, and flash must not be programmed while it does. True if it has just been set, which
/// happens once in the life of a chip: the option bytes keep it.
///
/// RM0433, 4.4.3. Of the option bytes nothing but this level changes; of a chip that is read-protected
/// they stay as they are. Before the servo interrupt: the program waits meanwhile.
pub fn watch_over() -> bool {
    let options = FLASH.optsr_cur().read();
    if options.bor_lev() == LEVEL || options.rdp() != OPEN {
        return false;
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
    FLASH.optsr_cur().read().bor_lev() == LEVEL
}

/// Lets the processor notice when the external clock stops: an exception that nothing masks (NMI).
pub fn watch_clock() {
    RCC.cr().modify(|w| w.set_hsecsson(true));
}

/// A probe that halts the program is no fault of it: watchdog and timer wait too.
pub fn wait_for_probe() {
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    DBGMCU.apb1lfzr1().modify(|w| w.set_tim2(true));
}
