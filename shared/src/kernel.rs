//! The evaluation: table values, then sums of products, then grids. Together with `access.rs`, through which it reads
//! and writes memory, this is all the `unsafe` code of an evaluation.
//!
//! **Basis of the proofs.** The guarantees of a [`Plan`], cited by their numbers in `plan.rs`. Debug builds check some
//! of them again.
//!
//! **Performance goal.** Few instructions on a Cortex-M4F, in portable Rust; `cargo xtask bench-target` counts them.
//! There a comparison of floats takes three instructions, a comparison of their bits one. A loop that the compiler
//! unrolls for long rows costs more than a bank of five tables.

mod grids;

use core::mem::MaybeUninit;

use crate::access::{Cursor, CursorMut, at, at_mut, part, split, whole};
use crate::description::{AUXILIARIES, Direction};
use crate::inputs::{Inputs, Travel, Travelling};
use crate::plan::{BankLookup, FIXED, Plan, Span};
use crate::product;
use crate::room::{Room, Row};
use crate::weights::Weights;
use grids::add_grids;

/// The table values of one evaluation and two constants. Read as one array, `one` has index `TABLES` and `zero` comes
/// next.
#[repr(C)]
struct Scratch<C: Room> {
    tables: MaybeUninit<C::TableValues>,
    one: f32,
    zero: f32,
}

/// A stored sample.
trait Sample: Copy {
    fn value(self) -> f32;
    /// The value of a table, given the interpolated samples.
    fn scaled(value: f32, scale: f32) -> f32;
}

impl Sample for f32 {
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
    #[inline(always)]
    fn scaled(value: f32, _: f32) -> f32 {
        value
    }
}

impl Sample for i16 {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
    #[inline(always)]
    fn scaled(value: f32, scale: f32) -> f32 {
        value * scale
    }
}

/// The corrections of all axes; entries beyond the last axis stay unchanged or become 0.
#[inline(always)]
pub(crate) fn evaluate<C: Room>(
    plan: &Plan<'_, C>,
    inputs: &Inputs<C::Axes<f32>>,
    travel: &Travelling<C::Axes<Travel>>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    if plan.sums().is_empty() {
        clear(corrections.as_mut());
    } else {
        evaluate_terms(plan, inputs, travel, weights, corrections);
    }
    if !plan.grids().is_empty() {
        add_grids(plan, inputs, corrections);
    }
}

/// Writes zeros. Volatile, because otherwise the compiler calls a function for these few writes.
#[inline(always)]
fn clear(corrections: &mut [f32]) {
    // SAFETY: the pointer comes from a reference.
    let write = |value: &mut f32| unsafe { core::ptr::write_volatile(value, 0.0) };
    // Eight axes, the default capacity, are cleared without a loop.
    let (chunks, rest) = corrections.as_chunks_mut::<8>();
    for [a, b, c, d, e, f, g, h] in chunks {
        write(a);
        write(b);
        write(c);
        write(d);
        write(e);
        write(f);
        write(g);
        write(h);
    }
    rest.iter_mut().for_each(write);
}

/// Evaluates every table, then adds the terms of each output.
#[inline(never)]
fn evaluate_terms<C: Room>(
    plan: &Plan<'_, C>,
    inputs: &Inputs<C::Axes<f32>>,
    travel: &Travelling<C::Axes<Travel>>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    let mut scratch = Scratch::<C> {
        tables: MaybeUninit::uninit(),
        one: 1.0,
        zero: 0.0,
    };
    // SAFETY: `TableValues` consists of TABLES values.
    let mut out = unsafe { CursorMut::raw(scratch.tables.as_mut_ptr().cast(), C::TABLES) };
    let floats = Cursor::start_of(plan.floats());
    for bank in plan.banks() {
        let width = usize::from(bank.tables);
        // SAFETY: guarantee 1; `out` has room for the tables of this bank and of the following ones (guarantee 4);
        // guarantee 3 covers what is read.
        unsafe {
            let x = *at(all(inputs), usize::from(bank.span.slot));
            match steps(&bank.span, x) {
                Some(t) if bank.straight => out.set(0, bank.line[0] + bank.line[1] * t),
                Some(steps) => {
                    let (i, t) = interval(steps);
                    let start = bank.first as usize + i * width;
                    mix(floats.skip(start), width, t, out.reborrow());
                }
                None => read_bank(plan, bank, x, travel, out.reborrow()),
            }
            out = out.skip(width);
        }
    }
    // SAFETY: `Scratch` is `repr(C)`: TABLES values, then two more; the pointer comes from the whole struct. The loop
    // above has written all `tables` of them (guarantee 4), and no others are read (guarantees 5 and 8).
    let values = unsafe {
        let first = core::ptr::from_ref(&scratch).cast::<f32>();
        Cursor::raw(first, C::TABLES + 2)
    };
    // SAFETY: the tables are written.
    unsafe { sum(plan, values, weights, corrections) };
}

/// All inputs: AXES axes, then the auxiliaries.
#[inline(always)]
fn all<A: Row<f32>>(inputs: &Inputs<A>) -> &[f32] {
    let count = inputs.axes.as_ref().len() + AUXILIARIES;
    // SAFETY: `Inputs` is `repr(C)` with two arrays of f32, so it is one array of AXES + AUXILIARIES values; the
    // pointer comes from the whole struct.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(inputs).cast(), count) }
}

/// Distance of `x` from the start in steps, if the span can be read directly there: from 0 to below `last`. `None` at
/// and beyond the ends, for NaN, and for a span that cannot be read directly.
#[inline(always)]
fn steps(span: &Span, x: f32) -> Option<f32> {
    let u = (x - span.start) * span.inverse_step;
    // Non-negative floats sort like their bits; negative ones and NaN have larger bits than all of those.
    (u.to_bits() < span.direct.to_bits()).then_some(u)
}

/// Splits a distance in steps into the index of the interval and the fraction in it.
///
/// # Safety
/// `steps` comes from [`steps`].
#[inline(always)]
unsafe fn interval(steps: f32) -> (usize, f32) {
    // SAFETY: 0 ≤ steps < last < 2²⁴ (guarantee 2).
    let i = unsafe { whole(steps) };
    (i as usize, steps - i as f32)
}

/// a + (b − a)·t for each of `width` tables: a starts at `row`, b in the next row.
///
/// # Operations
/// One subtraction, one multiplication and one addition per table.
///
/// # Memory
/// Two neighbouring rows of samples, each read once from front to back.
///
/// # Timing
/// Independent of the position.
///
/// # Safety
/// There are two rows of `width` values from `row`, and room for one row from `out`.
#[inline(always)]
unsafe fn mix(row: Cursor<'_, f32>, width: usize, t: f32, mut out: CursorMut<'_>) {
    // SAFETY: upheld by the caller.
    unsafe {
        let (mut a, mut b) = (row, row.skip(width));
        // Interleaves several tables, because using a result immediately costs one more cycle.
        macro_rules! several {
            ($($k:literal $a:ident $b:ident)*) => {{
                $(let ($a, $b) = (a.at($k), b.at($k));)*
                $(let $b = $b - $a;)*
                $(let $b = $b * t;)*
                $(let $a = $a + $b;)*
                $(out.set($k, $a);)*
            }}
        }
        let mut rest = width;
        while rest >= 8 {
            several!(0 a0 b0 1 a1 b1 2 a2 b2 3 a3 b3);
            several!(4 a0 b0 5 a1 b1 6 a2 b2 7 a3 b3);
            (a, b, out) = (a.skip(8), b.skip(8), out.skip(8));
            rest -= 8;
        }
        match rest {
            0 => {}
            1 => several!(0 a0 b0),
            2 => several!(0 a0 b0 1 a1 b1),
            3 => several!(0 a0 b0 1 a1 b1 2 a2 b2),
            4 => several!(0 a0 b0 1 a1 b1 2 a2 b2 3 a3 b3),
            5 => several!(0 a0 b0 1 a1 b1 2 a2 b2 3 a3 b3 4 a4 b4),
            6 => several!(0 a0 b0 1 a1 b1 2 a2 b2 3 a3 b3 4 a4 b4 5 a5 b5),
            7 => several!(0 a0 b0 1 a1 b1 2 a2 b2 3 a3 b3 4 a4 b4 5 a5 b5 6 a6 b6),
            _ => core::hint::unreachable_unchecked(),
        }
    }
}

/// a at t = 0, towards b.
#[inline(always)]
fn line(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Adds the terms to their outputs, in stored order.
///
/// # Operations
/// Per term weight · factor · factor …, from left to right, then one addition. A weight of 1 is skipped, a missing
/// factor may be replaced by 1, and a sum may begin with its first term: this changes nothing except possibly the sign
/// of a zero.
///
/// # Memory
/// 4 bytes per product (other terms: 16), 4 per factor.
///
/// # Timing
/// Independent of the values.
///
/// # Safety
/// All tables named by a factor have been written.
#[inline(always)]
unsafe fn sum<C: Room>(
    plan: &Plan<'_, C>,
    values: Cursor<'_, f32>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    let mut products = plan.products();
    let mut out = CursorMut::start(corrections.as_mut());
    for sum in plan.sums() {
        // SAFETY: guarantee 8; the tables have been written (caller).
        unsafe {
            let mut total = values.at_byte(usize::from(sum.first));
            let (own, others) = split(products, usize::from(sum.products));
            for product in own {
                let [a, b] = [product & 0xFFFF, product >> 16];
                total += values.at_byte(a as usize) * values.at_byte(b as usize);
            }
            products = others;
            out.set(0, total);
            out = out.skip(1);
        }
    }
    if plan.others() != 0 {
        // SAFETY: upheld by the caller.
        unsafe { add_others(plan, values, weights, corrections) };
    }
}

/// Adds the terms that are not part of a sum.
///
/// # Safety
/// All tables named by a factor have been written.
#[inline(never)]
unsafe fn add_others<C: Room>(
    plan: &Plan<'_, C>,
    values: Cursor<'_, f32>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    let mut next = plan.others();
    while next != 0 {
        // SAFETY: guarantees 5 and 6, and the caller's guarantee.
        unsafe {
            let term = at(plan.terms(), usize::from(next) - 1);
            let weight = if term.place == FIXED {
                term.weight
            } else {
                *at(weights.values(), usize::from(term.place))
            };
            let factors = part(&term.factors, 0, usize::from(term.count)).iter();
            let factors = factors.map(|&table| values.at(usize::from(table)));
            let total = at_mut(corrections.as_mut(), usize::from(term.output));
            *total = product::add(*total, weight, factors);
            next = term.next;
        }
    }
}

/// Whether the tables of a bank apply after its input last moved in direction `last`.
#[inline(always)]
fn holds(direction: Direction, last: Travel) -> bool {
    match direction {
        Direction::Both => true,
        Direction::Positive => last == Travel::Positive,
        Direction::Negative => last == Travel::Negative,
        Direction::Signed => last != Travel::Unknown,
    }
}

/// Largest integer not above `p`, for |p| ≤ 2²²; beyond that, and for NaN, ±2²².
#[inline(always)]
fn floor(p: f32) -> f32 {
    const END: f32 = 4_194_304.0;
    let p = if p < END { p } else { END };
    let p = if p > -END { p } else { -END };
    // SAFETY: −2²² ≤ p ≤ 2²² after the two selections (NaN became 2²² in the first).
    let k = unsafe { whole(p) } as f32;
    if k > p { k - 1.0 } else { k }
}

/// The interval around `x` in any span: indices of its two points and the fraction between them.
///
/// Uses compare-and-select throughout, so that NaN and infinity also end at a point.
#[inline(always)]
fn any_interval(span: &Span, x: f32) -> (u32, u32, f32) {
    let mut d = x - span.start;
    if span.is_modulo() {
        d -= floor(d * span.inverse_period) * span.period;
    }
    let u = d * span.inverse_step;
    let u = if u > 0.0 { u } else { 0.0 };
    let u = if u < span.limit { u } else { span.beyond };
    debug_assert!(u >= 0.0 && u <= span.last as f32 + 1.0);
    // SAFETY: 0 ≤ u < 2²⁴ + 1 (guarantee 2).
    let i = unsafe { whole(u) };
    let t = u - i as f32;
    let i = i as u32;
    let next = if i < span.last { i + 1 } else { span.after };
    debug_assert!(i <= span.last && next <= span.last);
    (i, next, t)
}

/// Evaluates all tables of any kind of bank, at any position.
///
/// # Safety
/// The bank belongs to the plan; `out` has room for its tables.
#[cold]
#[inline(never)]
unsafe fn read_bank<C: Room>(
    plan: &Plan<'_, C>,
    bank: &BankLookup,
    x: f32,
    travel: &Travelling<C::Axes<Travel>>,
    mut out: CursorMut<'_>,
) {
    let width = usize::from(bank.tables);
    if bank.span.direct > 0.0 {
        // Directly readable except at its ends, where the end values hold; NaN counts as the first point.
        let samples = Cursor::start_of(plan.floats());
        let end = if x > bank.span.start {
            bank.span.last
        } else {
            0
        };
        // SAFETY: guarantee 3, and the caller's guarantee.
        unsafe {
            let row = samples.skip(bank.first as usize + end as usize * width);
            for k in 0..width {
                out.set(k, row.at(k));
            }
        }
        return;
    }
    let last = if bank.direction == Direction::Both {
        Travel::Unknown
    } else {
        debug_assert!(usize::from(bank.span.slot) < C::AXES);
        // SAFETY: guarantee 1.
        unsafe { *at(travel.0.as_ref(), usize::from(bank.span.slot)) }
    };
    if !holds(bank.direction, last) {
        for k in 0..width {
            // SAFETY: upheld by the caller.
            unsafe { out.set(k, 0.0) };
        }
        return;
    }
    let sign = if bank.direction == Direction::Signed && last == Travel::Negative {
        -1.0
    } else {
        1.0
    };
    // SAFETY: guarantee 4, and the caller's guarantee.
    unsafe {
        let scales = part(plan.scales(), usize::from(bank.table), width);
        if bank.integer {
            fill(
                bank,
                x,
                plan.shorts().unwrap_or_default(),
                scales,
                sign,
                out,
            );
        } else {
            fill(
                bank,
                x,
                plan.floats().unwrap_or_default(),
                scales,
                sign,
                out,
            );
        }
    }
}

/// Interpolates all tables of one bank and multiplies them by `sign`, which is 1 or −1.
///
/// # Operations
/// Linear: a + (b − a)·t per table, after the index and the fraction of the bank.
/// Cubic: b + (w₀·(a − b) + w₂·(c − b) + w₃·(d − b)) per table, after the three weights.
///
/// # Memory
/// Two neighbouring rows of samples (cubic: four), each read once from front to back.
///
/// # Timing
/// Independent of the position, except for wrapping.
///
/// # Safety
/// `samples` is the section of the bank's format; `out` has room for its tables.
unsafe fn fill<S: Sample>(
    bank: &BankLookup,
    x: f32,
    samples: &[S],
    scales: &[f32],
    sign: f32,
    mut out: CursorMut<'_>,
) {
    let span = &bank.span;
    let (i, next, t) = any_interval(span, x);
    let row = |index: u32| {
        debug_assert!(index <= span.last);
        let width = usize::from(bank.tables);
        // SAFETY: guarantee 3.
        unsafe { part(samples, bank.first as usize + index as usize * width, width) }
    };
    if !bank.cubic {
        // Both come from `any_interval` and are at most `last`.
        let points = row(i).iter().zip(row(next));
        for (k, ((a, b), &scale)) in points.zip(scales).enumerate() {
            let value = line(a.value(), b.value(), t);
            // SAFETY: upheld by the caller: there is one scale per table.
            unsafe { out.set(k, sign * S::scaled(value, scale)) };
        }
        return;
    }
    // Uniform cubic B-splines. The weights of a, c, d apply to differences from b, so constants are reproduced exactly.
    const SIXTH: f32 = 1.0 / 6.0;
    let s = 1.0 - t;
    let w0 = SIXTH * (s * s * s);
    let w2 = SIXTH + 0.5 * t * (1.0 + t * s);
    let w3 = SIXTH * (t * t * t);
    // The first row follows the last. Without modulo this happens only at the end, with w3 = 0. i + 3 ≤ last + 3 ≤
    // 2·last (guarantee 2), so subtracting last + 1 gives an index below last.
    let from = |k: u32| row(if k <= span.last { k } else { k - span.last - 1 });
    let points = from(i).iter().zip(from(i + 1)).zip(from(i + 2));
    let points = points.zip(from(i + 3)).zip(scales);
    for (k, ((((a, b), c), d), &scale)) in points.enumerate() {
        let (a, b, c, d) = (a.value(), b.value(), c.value(), d.value());
        let inner = w0 * (a - b) + w2 * (c - b) + w3 * (d - b);
        // SAFETY: as above.
        unsafe { out.set(k, sign * S::scaled(b + inner, scale)) };
    }
}

#[cfg(all(test, feature = "exhaustive"))]
mod exhaustive;
#[cfg(all(test, feature = "encode"))]
mod tests;
