//! Rows of samples on a Cortex-M with floating-point unit, in its own instructions.
//!
//! A load of one value takes two cycles there, one of n values n + 1, and a result that is used at once
//! one more. A compiler gives neighbouring values no neighbouring registers, so it cannot load several.
//! The operations are those of `mix`, each rounded once: the same bits.

use core::arch::asm;

use crate::access::{From, To};
use crate::plan::BankLookup;

/// a + (b − a)·t of so many neighbouring values; a, b and the place of the result move on behind them.
macro_rules! several {
    ($a:ident $b:ident $t:ident $out:ident, $last:literal to $end:literal, $($k:literal $l:literal)*) => {
        asm!(
            "vmov s14, {t}",
            concat!("vldmia {a}!, {{s0-s", $last, "}}"),
            concat!("vldmia {b}!, {{s7-s", $end, "}}"),
            $(concat!("vsub.f32 s", $l, ", s", $l, ", s", $k),)*
            $(concat!("vmul.f32 s", $l, ", s", $l, ", s14"),)*
            $(concat!("vadd.f32 s", $k, ", s", $k, ", s", $l),)*
            concat!("vstmia {out}!, {{s0-s", $last, "}}"),
            t = in(reg) $t,
            a = inout(reg) $a,
            b = inout(reg) $b,
            out = inout(reg) $out,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _,
            out("s7") _, out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _,
            out("s13") _, out("s14") _,
            options(nostack, preserves_flags)
        )
    };
}

/// `width` values between those from `a` on and those from `b` on.
///
/// # Safety
/// From `a` and `b` on there are `width` values, and from `out` on there is room for them.
#[inline(always)]
#[allow(unused_assignments)] // where the last ones end
pub(super) unsafe fn mix(a: From<'_, f32>, b: From<'_, f32>, width: usize, t: f32, out: To<'_>) {
    let t = t.to_bits();
    // SAFETY: the caller's.
    let (mut a, mut b, mut out) = (a.pointer(), b.pointer(), unsafe { out.pointer(width) });
    let mut rest = width;
    // SAFETY: each block reads and writes as many values as it takes from `rest`.
    unsafe {
        while rest >= 7 {
            several!(a b t out, 6 to 13, 0 7 1 8 2 9 3 10 4 11 5 12 6 13);
            rest -= 7;
        }
        match rest {
            0 => {}
            1 => several!(a b t out, 0 to 7, 0 7),
            2 => several!(a b t out, 1 to 8, 0 7 1 8),
            3 => several!(a b t out, 2 to 9, 0 7 1 8 2 9),
            4 => several!(a b t out, 3 to 10, 0 7 1 8 2 9 3 10),
            5 => several!(a b t out, 4 to 11, 0 7 1 8 2 9 3 10 4 11),
            6 => several!(a b t out, 5 to 12, 0 7 1 8 2 9 3 10 4 11 5 12),
            _ => core::hint::unreachable_unchecked(),
        }
    }
}

/// a + (b − a)·t of a bank's only table of two points, and the bits of t: if those are not below 1.0 the
/// result is none.
///
/// # Safety
/// `out` has room for a value.
#[inline(always)]
pub(super) unsafe fn straight(bank: &BankLookup, x: &f32, out: To<'_>) -> u32 {
    // `BankLookup` is `repr(C)` and begins with `line`, then start and inverse step; the pointer comes from
    // the whole.
    let line = core::ptr::from_ref(bank);
    let x = core::ptr::from_ref(x);
    // SAFETY: the caller's.
    let out = unsafe { out.pointer(1) };
    let t;
    // SAFETY: reads four values and one, writes one.
    unsafe {
        asm!(
            "vldr s4, [{x}]",
            "vldmia {line}, {{s0-s3}}",
            "vsub.f32 s4, s4, s2",
            "vmul.f32 s4, s4, s3",
            "vmul.f32 s1, s1, s4",
            "vmov {t}, s4",
            "vadd.f32 s0, s0, s1",
            "vstr s0, [{out}]",
            x = in(reg) x,
            line = in(reg) line,
            out = in(reg) out,
            t = out(reg) t,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _,
            options(nostack, preserves_flags)
        );
    }
    t
}

/// Adds `rest` products of two of `values` to the one `first` bytes from their begin; where the pairs end. Why
/// this is not `product::add` stands there.
///
/// # Safety
/// From `pair` on there are `rest` words; each half, and `first`, is where one of `values` lies, in bytes.
#[inline(always)]
pub(super) unsafe fn products<'p>(
    values: From<'_, f32>,
    first: usize,
    pair: From<'p, u32>,
    rest: u32,
    out: &mut f32,
) -> From<'p, u32> {
    let (values, mut pair) = (values.pointer(), pair.pointer());
    let out = core::ptr::from_mut(out);
    // SAFETY: the caller's.
    let total = unsafe { values.byte_add(first) };
    // SAFETY: one product if their number is odd, then two by two.
    unsafe {
        asm!(
            "vldr s0, [{total}]",
            "lsrs {rest}, {rest}, #1",
            "bcc 2f",
            "ldr {p}, [{pair}], #4",
            "uxtah {a}, {values}, {p}",
            "add {p}, {values}, {p}, lsr #16",
            "vldr s1, [{a}]",
            "vldr s2, [{p}]",
            "vmul.f32 s1, s1, s2",
            "cmp {rest}, #0",
            "vadd.f32 s0, s0, s1",
            "2:",
            "beq 4f",
            "3:",
            "ldrd {p}, {q}, [{pair}], #8",
            "uxtah {a}, {values}, {p}",
            "add {p}, {values}, {p}, lsr #16",
            "vldr s1, [{a}]",
            "vldr s2, [{p}]",
            "uxtah {a}, {values}, {q}",
            "add {q}, {values}, {q}, lsr #16",
            "vldr s3, [{a}]",
            "vldr s4, [{q}]",
            "vmul.f32 s1, s1, s2",
            "vmul.f32 s3, s3, s4",
            "vadd.f32 s0, s0, s1",
            "subs {rest}, {rest}, #1",
            "vadd.f32 s0, s0, s3",
            "bne 3b",
            "4:",
            "vstr s0, [{out}]",
            total = in(reg) total,
            pair = inout(reg) pair,
            rest = inout(reg) rest => _,
            values = in(reg) values,
            out = in(reg) out,
            p = out(reg) _,
            q = out(reg) _,
            a = out(reg) _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _,
            options(nostack)
        );
    }
    // SAFETY: the pairs of the next one are behind these.
    unsafe { From::raw(pair, 0) }
}
