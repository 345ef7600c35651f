//! Counts instructions with SysTick of a Cortex-M, which QEMU moves by them (`-icount shift=10`). Elsewhere all
//! counts are 0.

/// Starts the counter. How many of its ticks pass in one instruction is the clock of the board.
pub fn start() {
    #[cfg(cortex_m)]
    // SAFETY: the registers of SysTick, which nothing else uses: reload with all bits, clear, count the processor's
    // clock.
    unsafe {
        (0xE000_E014 as *mut u32).write_volatile(MASK);
        (0xE000_E018 as *mut u32).write_volatile(0);
        (0xE000_E010 as *mut u32).write_volatile(0b101);
    }
}

/// SysTick has 24 bits.
const MASK: u32 = 0x00FF_FFFF;

/// Ticks of one call.
#[inline(never)]
pub fn ticks(call: impl FnOnce()) -> u32 {
    let before = now();
    call();
    // It counts down.
    before.wrapping_sub(now()) & MASK
}

fn now() -> u32 {
    #[cfg(cortex_m)]
    // SAFETY: reading the value of SysTick changes nothing.
    return unsafe { (0xE000_E018 as *const u32).read_volatile() };
    #[cfg(not(cortex_m))]
    0
}

/// Ticks of 1000 instructions.
pub fn ticks_of_1000() -> u32 {
    ticks(|| {
        #[cfg(cortex_m)]
        // SAFETY: counts a register down.
        unsafe {
            core::arch::asm!("2: subs {0}, #1", "bne 2b", inout(reg) 500 => _, options(nomem, nostack));
        }
    })
}
