//! Terms as the kernel reads them, and the order in which it adds them.

use crate::description::FACTORS;
use crate::room::{List, MOST_AXES, Room};
use crate::work;

/// Marks a term with a fixed weight.
pub(crate) const FIXED: u8 = u8::MAX;

/// One term.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedTerm {
    pub weight: f32,
    /// Table indices; entries from `count` on are not read.
    pub factors: [u8; FACTORS],
    /// For a term that is added separately: the next such term, counted from 1, or 0 if it is the last.
    pub next: u16,
    pub output: u8,
    pub count: u8,
    /// Index among the adjustable weights, or [`FIXED`].
    pub place: u8,
}

/// What the kernel computes first for an output: one value, then products.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sum {
    /// Byte offset, among the table values, of the first value, or of the 0 after them.
    pub first: u16,
    /// Number of products that follow; the products of all sums are stored consecutively.
    pub products: u16,
}

/// Two factors as byte offsets among the table values, the first in the lower half. The 1 after the table values
/// replaces a missing factor, which changes no bit.
pub(crate) type Product = u32;

/// Divides the terms. For each output, the leading terms with weight 1 and up to two factors become a sum, which costs
/// less than the general method; all others are added to it one by one. The order of addition is preserved. Returns the
/// first of the other terms, counted from 1, or 0. Guarantees 6 and 8.
pub(super) fn divide<C: Room>(
    outputs: usize,
    terms: &mut [PackedTerm],
    sums: &mut C::AxisList<Sum>,
    products: &mut C::TermList<Product>,
) -> u16 {
    let one = 4 * C::TABLES as u32;
    let mut others = 0;
    if terms.is_empty() {
        return others;
    }
    // For each output, the number of the first term that is not part of the sum.
    let mut ends = [usize::MAX; MOST_AXES];
    for (output, end) in (0..outputs as u8).zip(&mut ends) {
        work::count(terms.len());
        let mut sum = Sum {
            first: one as u16 + 4,
            products: 0,
        };
        let mut begun = false;
        for (k, term) in terms.iter().enumerate().filter(|(_, t)| t.output == output) {
            if term.weight != 1.0 || term.place != FIXED || term.count > 2 {
                *end = k;
                break;
            }
            let [a, b, ..] = term.factors.map(|table| 4 * u32::from(table));
            match term.count {
                1 if !begun => sum.first = a as u16,
                _ => {
                    // Missing factors already refer to the 1. There is room for as many products as terms.
                    products.append(a | b << 16);
                    sum.products += 1;
                }
            }
            begun = true;
        }
        sums.append(sum);
    }
    // From last to first, so that each term knows the next.
    work::count(terms.len());
    for (k, term) in terms.iter_mut().enumerate().rev() {
        if ends
            .get(usize::from(term.output))
            .is_some_and(|&end| k >= end)
        {
            term.next = others;
            others = k as u16 + 1;
        }
    }
    others
}
