//! Rows of samples, and products of table values; on a Cortex-M `cortex_m.rs` takes its place.

use crate::access::{From, To, at_mut};
use crate::plan::{BankLookup, Head};
use crate::product;

/// a + (b − a)·t of `width` neighbouring values.
///
/// # Safety
/// From `a` and `b` on there are `width` values, and from `out` on there is room for them.
#[inline(always)]
pub(super) unsafe fn mix(
    mut a: From<'_, f32>,
    mut b: From<'_, f32>,
    width: usize,
    t: f32,
    mut out: To<'_>,
) {
    macro_rules! several {
        ($($k:literal)*) => {{
            $(out.set($k, a.at($k) + (b.at($k) - a.at($k)) * t);)*
        }}
    }
    // SAFETY: from a, b and out on there are `rest` values.
    unsafe {
        let mut rest = width;
        while rest >= 8 {
            several!(0 1 2 3 4 5 6 7);
            (a, b, out) = (a.skip(8), b.skip(8), out.skip(8));
            rest -= 8;
        }
        match rest {
            0 => {}
            1 => several!(0),
            2 => several!(0 1),
            3 => several!(0 1 2),
            4 => several!(0 1 2 3),
            5 => several!(0 1 2 3 4),
            6 => several!(0 1 2 3 4 5),
            7 => several!(0 1 2 3 4 5 6),
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
    mut out: To<'_>,
) -> Option<(&'b BankLookup, &'b [BankLookup])> {
    debug_assert!(!banks.is_empty());
    let mut rest = banks;
    while let Some((bank, others)) = rest.split_first() {
        let [a, rise] = bank.line;
        // SAFETY: the caller's.
        unsafe {
            let x = inputs.at(usize::from(bank.span.slot));
            let t = (x - bank.span.start) * bank.span.inverse_step;
            // Numbers from 0 on are in the order of their bits; negative ones and not-a-number have larger
            // bits than all of those.
            if t.to_bits() >= 1.0_f32.to_bits() {
                return Some((bank, others));
            }
            out.set(usize::from(bank.table), a + rise * t);
        }
        rest = others;
    }
    None
}

/// Begins outputs: of `paired` each with its first value and the products of two that follow, of `bare` each
/// with its first value; where the words of these heads end.
///
/// # Safety
/// There is a head, and those of `bare` are behind those of `paired`. They have no single values, and as many
/// words from `word` on as they say; each half of a word, and each `first`, is where one of `values` lies, in
/// bytes, and each `output` where one of `outputs` does.
#[inline(always)]
pub(super) unsafe fn products<'p>(
    paired: &[Head],
    bare: &[Head],
    mut word: From<'p, u32>,
    values: From<'_, f32>,
    outputs: &mut [f32],
) -> From<'p, u32> {
    debug_assert!(paired.len() + bare.len() != 0);
    // SAFETY: the caller's.
    let first = |head: &Head| unsafe { values.at_byte(usize::from(head.first)) };
    for head in paired {
        let mut total = first(head);
        // SAFETY: the caller's.
        unsafe {
            for _ in 0..head.pairs {
                let both = word.at(0);
                let [a, b] = [both & 0xFFFF, both >> 16];
                let factors = [values.at_byte(a as usize), values.at_byte(b as usize)];
                total = product::add(total, 1.0, factors);
                word = word.skip(1);
            }
            *at_mut(outputs, usize::from(head.output) / 4) = total;
        }
    }
    for head in bare {
        // SAFETY: the caller's.
        unsafe { *at_mut(outputs, usize::from(head.output) / 4) = first(head) };
    }
    word
}
