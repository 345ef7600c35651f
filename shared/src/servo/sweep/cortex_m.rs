//! The same on a Cortex-M with floating-point unit while nothing is to be said of any axis, in its own
//! instructions: a load of n neighbouring values takes n + 1 cycles there, and no branch is taken but the one
//! back.

use core::arch::asm;
use core::mem::offset_of;
use core::ops::Range;

use super::super::lane::Lane;

/// Follows the axes that move on in their direction up to the first that does not; whether all do.
///
/// # Safety
/// There are as many positions as lanes, or more.
#[inline(always)]
pub(super) unsafe fn all_move_on(lanes: &mut [Lane], positions: &[f32]) -> bool {
    let Range { start, end } = lanes.as_mut_ptr_range();
    let mut lane = start;
    // SAFETY: the caller's. `Lane` is `repr(C)` and begins with sense, front and end, of
    // which front is written. Not-a-number is less than `front` in the sense of `lt`.
    unsafe {
        asm!(
            "cmp {lane}, {end}",
            "beq 3f",
            "2:",
            "vldmia {lane}, {{s1-s3}}",
            "vldmia {position}!, {{s0}}",
            "vmul.f32 s0, s0, s1",
            "mov {this}, {lane}",
            "vcmp.f32 s0, s2",
            "vmrs APSR_nzcv, fpscr",
            "blt 3f",
            "vcmp.f32 s0, s3",
            "vmrs APSR_nzcv, fpscr",
            "bhi 3f",
            "add {lane}, {lane}, #{size}",
            "vstr s0, [{this}, #4]",
            "cmp {lane}, {end}",
            "bne 2b",
            "3:",
            lane = inout(reg) lane,
            end = in(reg) end,
            position = inout(reg) positions.as_ptr() => _,
            this = out(reg) _,
            size = const size_of::<Lane>(),
            out("s0") _, out("s1") _, out("s2") _, out("s3") _,
            options(nostack)
        );
    }
    lane == end
}

/// Whether no rail can limit any of these corrections.
///
/// # Safety
/// There are as many of both corrections as lanes, or more.
#[inline(always)]
pub(super) unsafe fn all_are_free(lanes: &[Lane], last: &[f32], corrections: &[f32]) -> bool {
    // From the fourth value of one lane to that of the next.
    let Range { start, end } = lanes.as_ptr_range();
    let mut free = start.wrapping_byte_add(offset_of!(Lane, free));
    let end = end.wrapping_byte_add(offset_of!(Lane, free));
    // SAFETY: the caller's. `Lane` is `repr(C)`: free and most follow each other. Not-a-number is greater than
    // a bound in the sense of `hi`.
    unsafe {
        asm!(
            "cmp {free}, {end}",
            "beq 3f",
            "2:",
            "vldmia {dq}!, {{s0}}",
            "vldmia {last}!, {{s1}}",
            "vldmia {free}, {{s2-s3}}",
            "vsub.f32 s1, s0, s1",
            "vabs.f32 s0, s0",
            "vabs.f32 s1, s1",
            "vcmp.f32 s0, s2",
            "vmrs APSR_nzcv, fpscr",
            "bhi 3f",
            "vcmp.f32 s1, s3",
            "vmrs APSR_nzcv, fpscr",
            "bhi 3f",
            "add {free}, {free}, #{size}",
            "cmp {free}, {end}",
            "bne 2b",
            "3:",
            free = inout(reg) free,
            end = in(reg) end,
            last = inout(reg) last.as_ptr() => _,
            dq = inout(reg) corrections.as_ptr() => _,
            size = const size_of::<Lane>(),
            out("s0") _, out("s1") _, out("s2") _, out("s3") _,
            options(nostack, readonly)
        );
    }
    free == end
}
