//! Supply, clock, and the cause of the last reset.

use stm32f4xx_hal::pac::{FLASH, RCC};
use trueaxis_firmware::record::Flags;

/// Reads the cause of the last reset from the hardware and clears it for the next one.
pub fn flags(rcc: &RCC) -> Flags {
    let csr = rcc.csr().read();
    let flags = Flags {
        power_on: csr.porrstf().bit_is_set(),
        brown_out: csr.borrstf().bit_is_set(),
        watchdog: csr.wdgrstf().bit_is_set() || csr.wwdgrstf().bit_is_set(),
        software: csr.sftrstf().bit_is_set(),
        pin: csr.padrstf().bit_is_set(),
    };
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    flags
}

/// Brown-out level 3 in the option bytes: they count down from it, 3 is off (RM0090, table of the option bytes). The names
/// in `stm32f4` 0.16 count up.
const LEVEL_3: u8 = 0;

/// Makes sure that the chip is held in reset below 2.7 V (brown-out level 3): below that, flash and clock are out of
/// specification. It is written once in the life of a chip because the option bytes keep it.
///
/// RM0090, 3.6.2. Changes only this level in the option bytes, and nothing on a read-protected chip.
pub fn watch_over(flash: &FLASH) {
    let options = flash.optcr().read();
    if options.bor_lev().bits() == LEVEL_3 || !options.rdp().is_level0() {
        return;
    }
    while flash.sr().read().bsy().bit_is_set() {}
    for key in [0x0819_2A3B, 0x4C5D_6E7F] {
        flash.optkeyr().write(|w| w.optkeyr().set(key));
    }
    flash.optcr().modify(|_, w| w.bor_lev().set(LEVEL_3));
    flash.optcr().modify(|_, w| w.optstrt().set_bit());
    while flash.sr().read().bsy().bit_is_set() {}
    flash.optcr().modify(|_, w| w.optlock().set_bit());
}

/// Makes the processor detect a stopped crystal: a non-maskable exception (NMI).
#[cfg(not(feature = "hsi"))]
pub fn watch_crystal(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.csson().on());
}
