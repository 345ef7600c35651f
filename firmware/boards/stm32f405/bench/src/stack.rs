//! Stack usage of a call: the free part is painted, and inspected afterwards. Contains all `unsafe` of this program
//! except the mark in `counter.rs`.

use core::arch::asm;

/// Number of bytes painted below the stack pointer.
const AREA: usize = 16 * 1024;
/// Bytes between the stack pointer and the paint, for the painting itself.
const MARGIN: usize = 256;
const PAINT: u32 = 0x5AC3_A53C;

/// The stack pointer.
#[inline(always)]
fn pointer() -> usize {
    let sp: usize;
    // SAFETY: reads a register and accesses neither memory nor flags.
    unsafe { asm!("mov {}, sp", out(reg) sp, options(nomem, nostack, preserves_flags)) };
    sp
}

/// Bytes of stack below this frame that one call of `work` uses, in words of 4.
#[inline(never)]
pub fn peak(work: impl FnOnce()) -> usize {
    let top = (pointer() - MARGIN) & !3;
    let bottom = top - AREA;
    for address in (bottom..top).step_by(4) {
        // SAFETY: the stack starts at the end of 4 MiB of RAM, of which this program's statics take a few hundred kB,
        // and grows down; `main` is at most a few kB deep. So this is RAM below every live frame (by MARGIN, more than
        // this function needs), and belongs to nothing.
        unsafe { (address as *mut u32).write_volatile(PAINT) };
    }
    work();
    // SAFETY: as above.
    let touched = (bottom..top)
        .step_by(4)
        .find(|&a| unsafe { (a as *const u32).read_volatile() } != PAINT);
    touched.map_or(0, |lowest| top + MARGIN - lowest)
}
