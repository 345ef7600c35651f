//! Counts instructions with the SysTick of a Cortex-M or the cycles of a RISC-V, which QEMU advances with them (`-icount
//! shift=10`). Elsewhere all counts are 0.

/// Starts the counter. The clock of the board determines how many ticks one instruction takes.
pub fn start() {
    #[cfg(cortex_m)]
    // SAFETY: the registers of SysTick, used by nothing else: reload with all bits set, clear, count the processor
    // clock.
    unsafe {
        (0xE000_E014 as *mut u32).write_volatile(MASK);
        (0xE000_E018 as *mut u32).write_volatile(0);
        (0xE000_E010 as *mut u32).write_volatile(0b101);
    }
}

/// SysTick has 24 bits.
const MASK: u32 = if cfg!(cortex_m) {
    0x00FF_FFFF
} else {
    u32::MAX
};

/// Number of ticks of one call.
#[inline(never)]
pub fn ticks(call: impl FnOnce()) -> u32 {
    let before = now();
    call();
    // It counts down.
    before.wrapping_sub(now()) & MASK
}

fn now() -> u32 {
    #[cfg(cortex_m)]
    // SAFETY: reading the value of SysTick has no side effects.
    return unsafe { (0xE000_E018 as *const u32).read_volatile() };
    #[cfg(target_arch = "riscv32")]
    {
        let cycles: u32;
        // SAFETY: reading the register has no side effects.
        unsafe { core::arch::asm!("csrr {0}, mcycle", out(reg) cycles, options(nomem, nostack)) };
        // It counts up.
        cycles.wrapping_neg()
    }
    #[cfg(not(any(cortex_m, target_arch = "riscv32")))]
    0
}

/// Number of ticks of 1000 instructions.
pub fn ticks_of_1000() -> u32 {
    ticks(|| {
        #[cfg(cortex_m)]
        // SAFETY: counts a register down.
        unsafe {
            core::arch::asm!("2: subs {0}, #1", "bne 2b", inout(reg) 500 => _, options(nomem, nostack));
        }
        #[cfg(target_arch = "riscv32")]
        // SAFETY: counts a register down.
        unsafe {
            core::arch::asm!("2: addi {0}, {0}, -1", "bnez {0}, 2b", inout(reg) 500 => _, options(nomem, nostack));
        }
    })
}
