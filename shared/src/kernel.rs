//! The evaluation; with `access.rs`, through which it gets at memory, and `kernel/`, all `unsafe` code of
//! this crate.
//!
//! **What the proofs rest on.** The guarantees of a [`Plan`], which are listed in `plan.rs`, by their
//! numbers there; some are checked again in debug builds.
//!
//! **What it is written for.** A Cortex-M4F in few instructions: `cargo xtask bench-target` counts
//! them. There a VFP load takes no index, a comparison costs three instructions, and a loop that is
//! unrolled for long runs costs more in its prologue than a bank of five tables. Rows of samples and
//! products have instructions of their own there (`kernel/cortex_m.rs`).

#[cfg_attr(
    all(target_arch = "arm", target_abi = "eabihf", not(feature = "checked")),
    path = "kernel/cortex_m.rs"
)]
mod rows;

use core::mem::MaybeUninit;

use crate::access::{From, To, at, at_mut, opaque, part, split, whole};
use crate::description::{AUXILIARIES, Direction};
use crate::inputs::{Inputs, Travel, Travelling};
use crate::plan::{BankLookup, FIXED, GridLookup, PAIRED, PLAIN_WIDTH, PackedTerm, Plan, Span};
use crate::product;
use crate::room::{Room, Row};
use crate::weights::Weights;

/// Table values of one evaluation; read as one array, `one` is number `TABLES`, `zero` the next.
#[repr(C)]
struct Scratch<C: Room> {
    tables: MaybeUninit<C::TableValues>,
    one: f32,
    zero: f32,
}

/// A stored sample.
trait Sample: Copy {
    fn value(self) -> f32;
    /// The value of a table, given what was interpolated between its samples.
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

/// Tables and terms, then grids, into the outputs of all axes.
#[inline(never)]
pub(crate) fn evaluate_tables<C: Room>(
    c: &Plan<'_, C>,
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
    // SAFETY: `TableValues` are TABLES values.
    let mut out = unsafe { To::start(scratch.tables.as_mut_ptr().cast(), C::TABLES) };
    let (banks, [linear, other]) = c.banks();
    // SAFETY: guarantees 10, 1 and 4: there is room for the tables of each bank; what each kind reads of the
    // samples is stated there; guarantee 9.
    unsafe {
        if linear != 0 {
            let floats = c.floats().unwrap_unchecked();
            lines(part(banks, 0, linear), inputs, floats, out.again());
        }
        for bank in part(banks, linear, other - linear) {
            let floats = c.floats().unwrap_unchecked();
            let x = *at(all(inputs), usize::from(bank.span.slot));
            let out = out.again().skip(usize::from(bank.table));
            match interval(&bank.span, x) {
                Some((i, t)) => mix(bank, floats, i, t, out),
                None => end(bank, x, floats, out),
            }
        }
        if other != banks.len() {
            let (_, banks) = split(banks, other);
            others(c, banks, inputs, travel, out.again());
        }
    }

    // SAFETY: the same compensation; the loops above wrote all `tables` tables: each bank wrote each
    // of its values, and the banks together have `tables` of them.
    unsafe {
        let c = &*opaque(c);
        let values = values(&scratch);
        let word = sum(c, values, corrections);
        if c.has_more() {
            more(c, values, word, inputs, weights, corrections);
        }
    }
}

/// Zeros, without the call that the compiler makes of it where code is to be small.
#[inline(always)]
fn clear<C: Room>(corrections: &mut C::Axes<f32>) {
    let mut out = corrections.as_mut().as_mut_ptr();
    // SAFETY: `AXES & !3`, then `AXES & 3` values.
    unsafe {
        let last = out.add(C::AXES & !3);
        while out != last {
            out.cast::<[f32; 4]>().write([0.0; 4]);
            out = opaque(out.add(4)).cast_mut();
        }
        let last = out.add(C::AXES & 3);
        while out != last {
            out.write(0.0);
            out = opaque(out.add(1)).cast_mut();
        }
    }
}

/// All grids.
#[cold]
#[inline(never)]
fn add_grids<C: Room>(
    c: &Plan<'_, C>,
    inputs: &Inputs<C::Axes<f32>>,
    corrections: &mut C::Axes<f32>,
) {
    for grid in c.grids() {
        let floats = c.floats().unwrap_or_default();
        let shorts = c.shorts().unwrap_or_default();
        if !(grid.plain && add_cell(grid, inputs, floats, corrections)) {
            add_grid(grid, inputs, floats, shorts, corrections);
        }
    }
}

/// The only grid of a compensation without terms: [`Plan::one_cell`].
#[inline(always)]
pub(crate) fn evaluate_cell<C: Room>(
    c: &Plan<'_, C>,
    inputs: &Inputs<C::Axes<f32>>,
    corrections: &mut C::Axes<f32>,
) {
    clear::<C>(corrections);
    debug_assert!(!c.grids().is_empty());
    // SAFETY: there is one; guarantee 9.
    let (grid, floats) = unsafe { (at(c.grids(), 0), c.floats().unwrap_unchecked()) };
    if !add_cell(grid, inputs, floats, corrections) {
        let shorts = c.shorts().unwrap_or_default();
        add_grid(grid, inputs, floats, shorts, corrections);
    }
}

/// All inputs: AXES axes, then the auxiliaries.
#[inline(always)]
fn all<A: Row<f32>>(inputs: &Inputs<A>) -> &[f32] {
    let count = inputs.axes.as_ref().len() + AUXILIARIES;
    // SAFETY: `Inputs` is `repr(C)` of two arrays of f32, so it is one array of AXES + AUXILIARIES
    // of them; the pointer comes from the whole.
    unsafe { core::slice::from_raw_parts(core::ptr::from_ref(inputs).cast(), count) }
}

/// Whether the tables of a bank count while its input last moved in direction `last`.
#[inline(always)]
fn holds(direction: Direction, last: Travel) -> bool {
    match direction {
        Direction::Both => true,
        Direction::Positive => last == Travel::Positive,
        Direction::Negative => last == Travel::Negative,
        Direction::Signed => last != Travel::Unknown,
    }
}

/// Largest integer not above `p`, for |p| ≤ 2²²; beyond that, and for not-a-number, ±2²².
#[inline(always)]
fn floor(p: f32) -> f32 {
    const END: f32 = 4_194_304.0;
    let p = if p < END { p } else { END };
    let p = if p > -END { p } else { -END };
    // SAFETY: −2²² ≤ p ≤ 2²² after the two selections (not-a-number became 2²² in the first).
    let k = unsafe { whole(p) } as f32;
    if k > p { k - 1.0 } else { k }
}

/// The interval around `x` of a span without modulo: index of its first point, below `last`, and
/// the fraction in it; `None` at and beyond the ends, and for not-a-number.
#[inline(always)]
fn interval(span: &Span, x: f32) -> Option<(u32, f32)> {
    let u = (x - span.start) * span.inverse_step;
    // Numbers from 0 on are in the order of their bits; negative ones and not-a-number have
    // larger bits than all of those.
    if u.to_bits() >= span.limit.to_bits() {
        return None;
    }
    // SAFETY: 0 ≤ u < last (guarantee 2).
    let i = unsafe { whole(u) };
    Some((i as u32, u - i as f32))
}

/// The only table of each of these banks, which has two points: a + (b − a)·t between them, and the end values.
///
/// # Safety
/// There is a bank. The banks are straight, and their inputs among `inputs` and their samples among `samples`;
/// from `out` on there is room for all tables.
#[inline(always)]
unsafe fn lines<A: Row<f32>>(
    banks: &[BankLookup],
    inputs: &Inputs<A>,
    samples: &[f32],
    mut out: To<'_>,
) {
    let inputs = From::start(all(inputs));
    let mut rest = banks;
    // SAFETY: the caller's.
    unsafe {
        while let Some((bank, others)) = rows::lines(rest, inputs, out.again()) {
            let x = inputs.at(usize::from(bank.span.slot));
            out.set(usize::from(bank.table), beyond(bank, x, samples));
            // One that is beyond its ends may be the last.
            if others.is_empty() {
                break;
            }
            rest = others;
        }
    }
}

/// The end value that a straight bank holds at `x`; not-a-number counts as the first point.
#[cold]
#[inline(never)]
fn beyond(bank: &BankLookup, x: f32, samples: &[f32]) -> f32 {
    let u = (x - bank.span.start) * bank.span.inverse_step;
    let place = bank.first as usize + usize::from(u >= 1.0);
    debug_assert!(place < samples.len());
    // SAFETY: guarantee 3: two points.
    unsafe { *at(samples, place) }
}

/// The interval around `x` of any span: indices of its points and fraction in between.
///
/// Compare-and-select throughout, so that not-a-number and infinity end at a point too.
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

/// Row `index` of a bank.
///
/// # Safety
/// `index ≤ bank.span.last`, and `samples` is the section of the bank's format.
#[inline(always)]
unsafe fn row<'s, S: Sample>(bank: &BankLookup, samples: &'s [S], index: u32) -> &'s [S] {
    debug_assert!(index <= bank.span.last);
    let width = usize::from(bank.tables);
    let start = bank.first as usize + index as usize * width;
    debug_assert!(start + width <= samples.len());
    // SAFETY: guarantee 3.
    unsafe { part(samples, start, width) }
}

/// All tables of a bank of f32 samples between its points `i` and `i + 1`.
///
/// # Operations
/// a + (b − a)·t per table.
///
/// # Memory
/// Two neighbouring rows of samples, each read once from front to back.
///
/// # Timing
/// Independent of the position.
///
/// # Safety
/// `i < bank.span.last`; the samples are f32; `out` has room for the tables of the bank.
#[inline(always)]
unsafe fn mix(bank: &BankLookup, samples: &[f32], i: u32, t: f32, out: To<'_>) {
    let width = usize::from(bank.tables);
    let start = bank.first as usize + i as usize * width;
    debug_assert!(width >= 1 && start + 2 * width <= samples.len());
    // SAFETY: guarantee 3: from both on there are `width` values.
    unsafe {
        let a = From::start(samples).skip(start);
        rows::mix(a, a.skip(width), width, t, out);
    }
}

/// All tables of a bank of f32 samples at and beyond its ends, where the end values hold;
/// not-a-number counts as the first point.
///
/// # Safety
/// The samples are f32; `out` has room for the tables of the bank.
#[cold]
#[inline(never)]
unsafe fn end(bank: &BankLookup, x: f32, samples: &[f32], out: To<'_>) {
    let u = (x - bank.span.start) * bank.span.inverse_step;
    let i = if u >= 1.0 { bank.span.last } else { 0 };
    // SAFETY: i ≤ last; `out` has room for a row.
    unsafe {
        let row = row(bank, samples, i);
        core::ptr::copy_nonoverlapping(row.as_ptr(), out.pointer(row.len()), row.len());
    }
}

/// All tables of banks of any kind.
///
/// # Safety
/// The banks are those of `c`, and from `out` on there is room for all tables.
#[cold]
#[inline(never)]
unsafe fn others<C: Room>(
    c: &Plan<'_, C>,
    banks: &[BankLookup],
    inputs: &Inputs<C::Axes<f32>>,
    travel: &Travelling<C::Axes<Travel>>,
    mut out: To<'_>,
) {
    for bank in banks {
        // SAFETY: guarantees 1 and 4, and the caller's.
        unsafe {
            let x = *at(all(inputs), usize::from(bank.span.slot));
            other(
                c,
                bank,
                x,
                travel,
                out.again().skip(usize::from(bank.table)),
            );
        }
    }
}

/// All tables of a bank of any kind.
///
/// # Safety
/// `out` has room for the tables of the bank, which is one of `c`.
#[inline(always)]
unsafe fn other<C: Room>(
    c: &Plan<'_, C>,
    bank: &BankLookup,
    x: f32,
    travel: &Travelling<C::Axes<Travel>>,
    out: To<'_>,
) {
    let width = usize::from(bank.tables);
    // SAFETY: the caller's.
    let values = unsafe {
        let first = out.pointer(width).cast::<MaybeUninit<f32>>();
        core::slice::from_raw_parts_mut(first, width)
    };
    let last = if bank.direction == Direction::Both {
        Travel::Unknown
    } else {
        debug_assert!(usize::from(bank.span.slot) < C::AXES);
        // SAFETY: guarantee 1.
        unsafe { *at(travel.0.as_ref(), usize::from(bank.span.slot)) }
    };
    if !holds(bank.direction, last) {
        values.fill(MaybeUninit::new(0.0));
        return;
    }
    if bank.integer {
        let table = usize::from(bank.table);
        // SAFETY: guarantee 4.
        let scales = unsafe { part(c.scales(), table, width) };
        fill(bank, x, c.shorts().unwrap_or_default(), scales, values);
    } else {
        fill(bank, x, c.floats().unwrap_or_default(), c.scales(), values);
    }
    if bank.direction == Direction::Signed && last == Travel::Negative {
        for value in values {
            // SAFETY: `fill` wrote every value.
            *value = MaybeUninit::new(-unsafe { value.assume_init() });
        }
    }
}

/// Reads all tables of one bank.
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
#[inline(always)]
fn fill<S: Sample>(
    bank: &BankLookup,
    x: f32,
    samples: &[S],
    scales: &[f32],
    values: &mut [MaybeUninit<f32>],
) {
    if bank.cubic {
        fill_cubic(bank, x, samples, scales, values);
        return;
    }
    let (i, next, t) = any_interval(&bank.span, x);
    // SAFETY: i, next ≤ last, from `any_interval`.
    let (a, b) = unsafe { (row(bank, samples, i), row(bank, samples, next)) };
    for (((value, &a), &b), &scale) in values.iter_mut().zip(a).zip(b).zip(scales) {
        let (a, b) = (a.value(), b.value());
        value.write(S::scaled(a + (b - a) * t, scale));
    }
}

/// Uniform cubic B-splines. The weights of a, c, d are those of differences from b, so constants stay
/// constant.
#[inline(never)]
fn fill_cubic<S: Sample>(
    bank: &BankLookup,
    x: f32,
    samples: &[S],
    scales: &[f32],
    values: &mut [MaybeUninit<f32>],
) {
    const SIXTH: f32 = 1.0 / 6.0;
    let span = &bank.span;
    let (i, _, t) = any_interval(span, x);
    let s = 1.0 - t;
    let w0 = SIXTH * (s * s * s);
    let w2 = SIXTH + 0.5 * t * (1.0 + t * s);
    let w3 = SIXTH * (t * t * t);
    // After the last row comes the first: without modulo only at the end, with w3 = 0.
    let from = |k: u32| if k <= span.last { k } else { k - span.last - 1 };
    debug_assert!(i <= span.last && span.last >= 3);
    // SAFETY: i ≤ last from `any_interval`; up to i + 3 ≤ last + 3 ≤ 2·last (guarantee 2), less
    // last + 1 that is below last.
    let (a, b, c, d) = unsafe {
        (
            row(bank, samples, i),
            row(bank, samples, from(i + 1)),
            row(bank, samples, from(i + 2)),
            row(bank, samples, from(i + 3)),
        )
    };
    let points = a.iter().zip(b).zip(c).zip(d).zip(scales);
    for (value, ((((&a, &b), &c), &d), &scale)) in values.iter_mut().zip(points) {
        let (a, b, c, d) = (a.value(), b.value(), c.value(), d.value());
        let inner = w0 * (a - b) + w2 * (c - b) + w3 * (d - b);
        value.write(S::scaled(b + inner, scale));
    }
}

/// Adds the terms to their outputs, in stored order.
///
/// # Operations
/// Per term weight · factor · factor …, from left to right, then one addition. A weight of 1 is
/// left out, where a factor is missing 1 may stand in, and a sum may begin with its first term:
/// nothing changes but perhaps the sign of a zero.
///
/// # Memory
/// 4 bytes per pair (others: 16 per term), 4 per factor.
///
/// # Timing
/// Independent of the values.
///
/// # Safety
/// All tables that a factor names are written.
#[inline(always)]
unsafe fn sum<'c, C: Room>(
    c: &'c Plan<'_, C>,
    values: From<'_, f32>,
    corrections: &mut C::Axes<f32>,
) -> From<'c, u32> {
    let (heads, [bare, singles]) = c.heads();
    let words = From::start(c.pairs());
    if singles == 0 {
        return words;
    }
    // SAFETY: guarantee 8; the tables were written (caller).
    unsafe {
        let (paired, bare) = (part(heads, 0, bare), part(heads, bare, singles - bare));
        rows::products(paired, bare, words, values, corrections.as_mut())
    }
}

/// What few compensations have: outputs that begin with single values, terms of other kinds, grids.
///
/// # Safety
/// That of [`sum`], of which `word` comes.
#[inline(never)]
unsafe fn more<C: Room>(
    c: &Plan<'_, C>,
    values: From<'_, f32>,
    mut word: From<'_, u32>,
    inputs: &Inputs<C::Axes<f32>>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    let (heads, [_, singles]) = c.heads();
    // SAFETY: the caller's.
    unsafe {
        for head in split(heads, singles).1 {
            let mut total = values.at_byte(usize::from(head.first));
            let mut rest = head.singles;
            while rest != 0 {
                let value = values.at_byte(word.at(0) as usize);
                total = product::add(total, 1.0, [value]);
                word = word.skip(1).opaque();
                rest -= 1;
            }
            *at_mut(corrections.as_mut(), usize::from(head.output) / 4) = total;
        }
        if c.has_runs() {
            sum_runs(c, values, weights, corrections);
        }
    }
    if !c.grids().is_empty() {
        add_grids(c, inputs, corrections);
    }
}

/// Values of all tables, then 1 and 0.
///
/// # Safety
/// All tables that are read from it are written.
#[inline(always)]
unsafe fn values<C: Room>(scratch: &Scratch<C>) -> From<'_, f32> {
    let first = core::ptr::from_ref(scratch).cast::<f32>();
    // SAFETY: `Scratch` is `repr(C)`: TABLES values, then two; the pointer comes from the whole. What
    // is not written is not read.
    unsafe { From::raw(first, C::TABLES + 2) }
}

/// Adds the terms that are not among the pairs, run by run.
///
/// # Safety
/// That of [`sum`].
#[inline(never)]
unsafe fn sum_runs<C: Room>(
    c: &Plan<'_, C>,
    values: From<'_, f32>,
    weights: &Weights,
    corrections: &mut C::Axes<f32>,
) {
    let mut rest = c.terms();
    while let Some(first) = rest.first() {
        debug_assert!(first.run >= 1 && usize::from(first.run) <= rest.len());
        // SAFETY: guarantee 6.
        let (run, others) = unsafe { split(rest, usize::from(first.run)) };
        rest = others;
        if first.most == PAIRED {
            continue;
        }
        debug_assert!(usize::from(first.output) < C::AXES);
        // SAFETY: guarantee 5.
        let total = unsafe { at_mut(corrections.as_mut(), usize::from(first.output)) };
        // SAFETY: as for the caller.
        *total = unsafe { weighted(*total, run, values, weights) };
    }
}

/// Adds a run of any shape to `total`.
///
/// # Safety
/// That of [`sum`].
#[inline(always)]
unsafe fn weighted(
    mut total: f32,
    run: &[PackedTerm],
    values: From<'_, f32>,
    weights: &Weights,
) -> f32 {
    let Some(&PackedTerm { most, place, .. }) = run.first() else {
        return total;
    };
    if place != FIXED {
        for (k, term) in run.iter().enumerate() {
            let k = usize::from(place) + k;
            debug_assert!(k < weights.values().len());
            // SAFETY: guarantee 5: the places of adjustable terms follow each other.
            let weight = unsafe { *at(weights.values(), k) };
            // SAFETY: the caller's.
            total = product::add(total, weight, unsafe { factors(term, values) });
        }
        return total;
    }
    // SAFETY: the caller's; the constants are less than FACTORS.
    let factor = |term: &PackedTerm, k: usize| unsafe { factor(term, k, values) };
    match most {
        0..=2 => {
            for term in run {
                let factors = [factor(term, 0), factor(term, 1)];
                total = product::add(total, term.weight, factors);
            }
        }
        3 => {
            for term in run {
                let factors = [factor(term, 0), factor(term, 1), factor(term, 2)];
                total = product::add(total, term.weight, factors);
            }
        }
        _ => {
            for term in run {
                // SAFETY: the caller's.
                total = product::add(total, term.weight, unsafe { factors(term, values) });
            }
        }
    }
    total
}

/// Factor number `k` of a term; 1 if it has none.
///
/// # Safety
/// `k < FACTORS`, and that of [`sum`].
#[inline(always)]
unsafe fn factor(term: &PackedTerm, k: usize, values: From<'_, f32>) -> f32 {
    // SAFETY: the factor is a table that was written or number TABLES, which is `one` (guarantee 5).
    unsafe { values.at(usize::from(*at(&term.factors, k))) }
}

/// All factors of a term.
///
/// # Safety
/// That of [`sum`].
#[inline(always)]
unsafe fn factors(term: &PackedTerm, values: From<'_, f32>) -> impl Iterator<Item = f32> {
    // SAFETY: `count ≤ FACTORS` (guarantee 5), and the caller's.
    (0..usize::from(term.count)).map(move |k| unsafe { factor(term, k, values) })
}

/// a at t = 0, towards b.
#[inline(always)]
fn line(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

/// Adds one grid of the plain kind, see [`GridLookup::plain`]; false, and nothing added, at and
/// beyond the ends of an input, and for not-a-number.
///
/// # Operations
/// As [`add_grid`], of which this is the straight way through.
#[inline(never)]
fn add_cell<A: Row<f32>>(
    grid: &GridLookup,
    inputs: &Inputs<A>,
    samples: &[f32],
    corrections: &mut A,
) -> bool {
    const WIDTH: usize = PLAIN_WIDTH;
    let mut start = grid.first as usize;
    macro_rules! along {
        ($k:literal) => {{
            let span = &grid.spans[$k];
            // SAFETY: guarantee 1.
            let x = unsafe { *at(all(inputs), usize::from(span.slot)) };
            let Some((i, t)) = interval(span, x) else {
                return false;
            };
            start += i as usize * grid.strides[$k] as usize;
            t
        }};
    }
    let t = [along!(0), along!(1), along!(2)];
    let (far, middle) = (grid.strides[0] as usize, grid.strides[1] as usize);
    // SAFETY: guarantees 2 and 3: each index is below `last`, so that all eight nodes are in the
    // grid, two and two neighbours; guarantee 7.
    unsafe {
        let near = From::start(samples).skip(start);
        let far = near.skip(far);
        let [near_far, far_far] = [near.skip(middle), far.skip(middle)];
        // Written out, so that no optimisation level makes a loop of it.
        let [u, v, w] = t;
        macro_rules! output {
            ($k:literal) => {
                let a = line(near.at($k), near.at($k + WIDTH), w);
                let b = line(near_far.at($k), near_far.at($k + WIDTH), w);
                let c = line(far.at($k), far.at($k + WIDTH), w);
                let d = line(far_far.at($k), far_far.at($k + WIDTH), w);
                let value = line(line(a, b, v), line(c, d, v), u);
                *at_mut(corrections.as_mut(), usize::from(grid.outputs[$k])) += value;
            };
        }
        output!(0);
        output!(1);
        output!(2);
    }
    true
}

/// Adds one grid to its outputs.
///
/// # Operations
/// a + (b − a)·t along the last input, then the middle, then the first: seven times per output.
///
/// # Memory
/// Eight nodes of `width` neighbouring samples.
///
/// # Timing
/// Independent of the position, except for wrapping.
#[cold]
#[inline(never)]
fn add_grid<A: Row<f32>>(
    grid: &GridLookup,
    inputs: &Inputs<A>,
    floats: &[f32],
    shorts: &[i16],
    corrections: &mut A,
) {
    // SAFETY: guarantee 1.
    let x = grid
        .spans
        .map(|span| unsafe { *at(all(inputs), usize::from(span.slot)) });
    if grid.integer {
        add_nodes(grid, x, shorts, corrections);
    } else {
        add_nodes(grid, x, floats, corrections);
    }
}

fn add_nodes<S: Sample, A: Row<f32>>(
    grid: &GridLookup,
    x: [f32; 3],
    samples: &[S],
    corrections: &mut A,
) {
    let mut near = [0_usize; 3];
    let mut far = [0_usize; 3];
    let mut t = [0.0_f32; 3];
    for k in 0..3 {
        let (i, next, fraction) = any_interval(&grid.spans[k], x[k]);
        near[k] = i as usize * grid.strides[k] as usize;
        far[k] = next as usize * grid.strides[k] as usize;
        t[k] = fraction;
    }
    let width = usize::from(grid.width);
    let first = grid.first as usize;
    let node = |a: usize, b: usize, c: usize| {
        let start = first + a + b + c;
        debug_assert!(start + width <= samples.len());
        // SAFETY: guarantees 2 and 3: each index is at most `last`, so the node is in the grid.
        unsafe { From::start(samples).skip(start) }
    };
    let nodes = [
        node(near[0], near[1], near[2]),
        node(near[0], near[1], far[2]),
        node(near[0], far[1], near[2]),
        node(near[0], far[1], far[2]),
        node(far[0], near[1], near[2]),
        node(far[0], near[1], far[2]),
        node(far[0], far[1], near[2]),
        node(far[0], far[1], far[2]),
    ];
    let mut add = |k: usize| {
        // SAFETY: k < width, and `node` points at `width` samples of the section.
        let v = nodes.map(|node| unsafe { node.at(k) }.value());
        let face0 = line(line(v[0], v[1], t[2]), line(v[2], v[3], t[2]), t[1]);
        let face1 = line(line(v[4], v[5], t[2]), line(v[6], v[7], t[2]), t[1]);
        let value = S::scaled(line(face0, face1, t[0]), grid.scales[k]);
        let output = usize::from(grid.outputs[k]);
        debug_assert!(output < corrections.as_ref().len());
        // SAFETY: guarantee 7.
        unsafe { *at_mut(corrections.as_mut(), output) += value };
    };
    // The bound that guarantee 7 gives is repeated for the compiler.
    for k in 0..width.min(grid.outputs.len()) {
        add(k);
    }
}

#[cfg(all(test, feature = "encode"))]
mod tests;
