//! Rows of samples on a Cortex-M with floating-point unit, in its own instructions.
//!
//! A load of one value takes two cycles there, one of n values n + 1, and a result that is used at once
//! one more. A compiler gives neighbouring values no neighbouring registers, so it cannot load several.
//! The operations are those of `mix`, each rounded once: the same bits.

use core::arch::asm;

use core::mem::offset_of;
use core::ops::Range;

use crate::access::{From, To};
use crate::plan::{BankLookup, Head, Span};

/// The bits of 1.
const ONE: u32 = 1.0_f32.to_bits();

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

/// a + (b − a)·t of the only table of each of `banks`, up to one of which the input is not between its two
/// points: that one, and those behind it.
///
/// # Safety
/// There is a bank. The banks are straight, their inputs are among `inputs`, and from `out` on there is room
/// for all tables.
#[inline(always)]
pub(super) unsafe fn lines<'b>(
    banks: &'b [BankLookup],
    inputs: From<'_, f32>,
    out: To<'_>,
) -> Option<(&'b BankLookup, &'b [BankLookup])> {
    let Range { start, end } = banks.as_ptr_range();
    let mut behind = start;
    let t: u32;
    // SAFETY: the caller's: reads banks and one input each, writes one value each. `BankLookup` is `repr(C)`
    // and begins with `line`, then start and inverse step.
    unsafe {
        asm!(
            "2:",
            "ldrb {t}, [{bank}, #{slot}]",
            "ldrh {place}, [{bank}, #{table}]",
            "vldmia {bank}, {{s0-s3}}",
            "add {t}, {inputs}, {t}, lsl #2",
            "vldr s4, [{t}]",
            "vsub.f32 s4, s4, s2",
            "add {place}, {out}, {place}, lsl #2",
            "vmul.f32 s4, s4, s3",
            "adds {bank}, #{size}",
            "vmul.f32 s1, s1, s4",
            "vmov {t}, s4",
            // Numbers from 0 on are in the order of their bits; negative ones and not-a-number have larger
            // bits than all of those.
            "cmp {t}, #{one}",
            "vadd.f32 s0, s0, s1",
            "bhs 3f",
            "vstr s0, [{place}]",
            "cmp {bank}, {end}",
            "bne 2b",
            "3:",
            bank = inout(reg) behind,
            end = in(reg) end,
            inputs = in(reg) inputs.pointer(),
            out = in(reg) out.pointer(1),
            t = out(reg) t,
            place = out(reg) _,
            slot = const offset_of!(BankLookup, span) + offset_of!(Span, slot),
            table = const offset_of!(BankLookup, table),
            size = const size_of::<BankLookup>(),
            one = const ONE,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _,
            options(nostack)
        );
    }
    if t < ONE {
        return None;
    }
    // SAFETY: `behind` is behind the bank of which it was found, which is one of `banks`.
    unsafe {
        let others = end.offset_from_unsigned(behind);
        Some((&*behind.sub(1), core::slice::from_raw_parts(behind, others)))
    }
}

/// Begins outputs: of `paired` each with its first value and the products of two that follow, of `bare` each
/// with its first value; where the words of these heads end. Why this is not `product::add` stands there.
///
/// # Safety
/// There is a head, and those of `bare` are behind those of `paired`. They have no single values, and as many
/// words from `word` on as they say; each half of a word, and each `first`, is where one of `values` lies, in
/// bytes, and each `output` where one of `outputs` does.
#[inline(always)]
pub(super) unsafe fn products<'p>(
    paired: &[Head],
    bare: &[Head],
    word: From<'p, u32>,
    values: From<'_, f32>,
    outputs: &mut [f32],
) -> From<'p, u32> {
    let mut word = word.pointer();
    // SAFETY: the caller's. `Head` is `repr(C)`: first and singles, which are 0, output and pairs. One product
    // if their number is odd, then two by two.
    unsafe {
        asm!(
            "cmp {head}, {bare}",
            "beq 6f",
            "2:",
            "ldrd {p}, {q}, [{head}], #8",
            "add {p}, {values}, {p}",
            "vldr s0, [{p}]",
            "uxtah {out}, {outputs}, {q}",
            "lsrs {rest}, {q}, #17",
            "bcc 4f",
            "ldr {p}, [{word}], #4",
            "uxtah {q}, {values}, {p}",
            "add {p}, {values}, {p}, lsr #16",
            "vldr s1, [{q}]",
            "vldr s2, [{p}]",
            "vmul.f32 s1, s1, s2",
            "cmp {rest}, #0",
            "vadd.f32 s0, s0, s1",
            "beq 5f",
            "4:",
            "ldrd {p}, {q}, [{word}], #8",
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
            "bne 4b",
            "5:",
            "cmp {head}, {bare}",
            "vstr s0, [{out}]",
            "bne 2b",
            "6:",
            "cmp {head}, {end}",
            "beq 8f",
            "7:",
            "ldrd {p}, {q}, [{head}], #8",
            "add {p}, {values}, {p}",
            "vldr s0, [{p}]",
            "add {q}, {outputs}, {q}",
            "cmp {head}, {end}",
            "vstr s0, [{q}]",
            "bne 7b",
            "8:",
            head = inout(reg) paired.as_ptr() => _,
            bare = in(reg) bare.as_ptr(),
            end = in(reg) bare.as_ptr_range().end,
            word = inout(reg) word,
            values = in(reg) values.pointer(),
            outputs = in(reg) outputs.as_mut_ptr(),
            out = out(reg) _,
            rest = out(reg) _,
            p = out(reg) _,
            q = out(reg) _,
            a = out(reg) _,
            out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _,
            options(nostack)
        );
    }
    // SAFETY: the words of the next ones are behind these.
    unsafe { From::raw(word, 0) }
}
