//! Rows of samples, and products of table values; on a Cortex-M `cortex_m.rs` takes its place.

use crate::access::{From, To};
use crate::plan::BankLookup;
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

/// a + (b − a)·t of a bank's only table of two points, and the bits of t: if those are not below 1.0 the
/// result is none.
///
/// # Safety
/// `out` has room for a value.
#[inline(always)]
pub(super) unsafe fn straight(bank: &BankLookup, x: &f32, mut out: To<'_>) -> u32 {
    let [a, rise] = bank.line;
    let t = (*x - bank.span.start) * bank.span.inverse_step;
    // SAFETY: the caller's.
    unsafe { out.set(0, a + rise * t) };
    t.to_bits()
}

/// Adds `rest` products of two of `values` to the one `first` bytes from their begin; where the pairs end.
///
/// # Safety
/// From `pair` on there are `rest` words; each half, and `first`, is where one of `values` lies, in bytes.
#[inline(always)]
pub(super) unsafe fn products<'p>(
    values: From<'_, f32>,
    first: usize,
    mut pair: From<'p, u32>,
    mut rest: u32,
    out: &mut f32,
) -> From<'p, u32> {
    // SAFETY: the caller's.
    unsafe {
        let mut total = values.at_byte(first);
        while rest != 0 {
            let both = pair.at(0);
            let [a, b] = [both & 0xFFFF, both >> 16];
            let factors = [values.at_byte(a as usize), values.at_byte(b as usize)];
            total = product::add(total, 1.0, factors);
            pair = pair.skip(1);
            rest -= 1;
        }
        *out = total;
    }
    pair
}
