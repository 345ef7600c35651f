//! Memory and registers at fixed addresses: the only file of this crate with `unsafe`.
#![allow(unsafe_code)]

/// The table slots of the STM32F405, as `memory.x` places them.
pub mod slots {
    use trueaxis_firmware::slots::Slot;

    unsafe extern "C" {
        safe static __slot_a_start: u8;
        safe static __slot_a_end: u8;
        safe static __slot_b_start: u8;
        safe static __slot_b_end: u8;
    }

    /// First address of a slot, and the one behind its last.
    pub fn addresses(slot: Slot) -> [usize; 2] {
        let [start, end] = match slot {
            Slot::A => [&raw const __slot_a_start, &raw const __slot_a_end],
            Slot::B => [&raw const __slot_b_start, &raw const __slot_b_end],
        };
        [start.addr(), end.addr()]
    }

    /// The bytes of a slot in place.
    pub fn bytes(slot: Slot) -> &'static [u8] {
        let [start, end] = addresses(slot);
        // SAFETY: `memory.x` gives this range to nothing else, it is flash that the processor can
        // read for as long as it runs, and every byte of it is a valid u8. The flash controller
        // changes it only for `NorFlash::erase` and `write` of the one driver, which `Slots` calls
        // for a slot that is not active only; of such a slot nobody keeps a reference across a
        // change (`TableFlash::in_place`, `Loader::vacate`), and the driver's own ends before.
        unsafe { core::slice::from_raw_parts(start as *const u8, end - start) }
    }
}

/// Lets interrupts come, whose handlers are in place.
pub fn start_interrupts<const N: usize>(
    nvic: &mut cortex_m::peripheral::NVIC,
    interrupts: [stm32f4xx_hal::pac::Interrupt; N],
) {
    for interrupt in interrupts {
        // SAFETY: no code of this crate relies on an interrupt being masked by its priority or by
        // its enable bit: what handlers share with the main loop is in a `Mutex` of
        // `critical_section`, which masks all of them.
        unsafe {
            // All the same: none interrupts another.
            nvic.set_priority(interrupt, 0x10);
            cortex_m::peripheral::NVIC::unmask(interrupt);
        }
    }
}
